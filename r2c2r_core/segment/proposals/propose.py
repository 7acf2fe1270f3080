"""Object proposals before any click: fronts, appliances and free-standing objects, each with the click that confirms it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Mask, Vector3
from r2c2r_core.errors import R2C2RError
from r2c2r_core.geometry.camera import project
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.kitchen.categories import every_category
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.segment.appliances.found import FoundAppliance
from r2c2r_core.segment.certainty import front_certainty
from r2c2r_core.segment.found import Found
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import front_mask, front_panel
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.proposals.clicks import best_views, click_on, clump_clicks, panel_clicks
from r2c2r_core.segment.proposals.clutter import Clump, find_clumps
from r2c2r_core.segment.proposals.naming import name_thing
from r2c2r_core.segment.proposals.panels import Panel, find_panels, is_on_wall, without_sides
from r2c2r_core.tuning import param, tuned

Steps = Iterator[tuple[float, tuple[Proposal, ...]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the proposals."""

    most_things: int = param(24, "count", "Maximum number of free-standing clusters considered")
    least_confidence: float = param(0.3, "score", "Minimum confidence, 0 to 1, of a front")
    least_of_boxes: float = param(0.5, "score", "Minimum confidence, 0 to 1, of an appliance")
    least_of_things: float = param(0.4, "score", "Minimum confidence, 0 to 1, of a free-standing object")
    least_plane_m2: float = param(0.02, "m²", "Minimum area of a plane that is cut")
    least_side_m: float = param(0.09, "m", "Minimum side of a plane that is cut")
    shallowest_box_m: float = param(
        0.25, "m", "Minimum depth of an appliance", source="microwaves are at least 0.3 m deep; objects on a shelf are not"
    )
    same_plane_m: float = param(0.12, "m", "Maximum distance between the planes of two fronts at one place")
    box_slack_m: float = param(0.03, "m", "Margin around a box within which points belong to it")
    same_front: float = param(0.7, "score", "Minimum IoU of a click's result with the proposed panel")
    larger: float = param(1.8, "ratio", "Maximum size of a click's result relative to the cluster")
    larger_m: float = param(0.05, "m", "Additional tolerance of that size")
    taken_share: float = param(0.4, "share", "Maximum fraction of an outline that other proposals may cover")
    clash_m: float = param(
        0.01,
        "m",
        "Overlap of two fronts in both directions above which one is doubted",
        source="edges of correct fronts are 2 mm off",
    )
    tall_m: float = param(1.25, "m", "Minimum height of a refrigerator's front")
    least_seen_m: float = param(0.12, "m", "Minimum observed side of a microwave's front, of which glass may leave little")


def propose_steps(prepared: PreparedCapture) -> Steps:
    """Proposals so far, the most confident first, with the fraction of the work done. The last step has them all."""
    params = tuned(Params)
    panels: list[Panel] = []
    planes = [plane for plane in prepared.planes if _worth_cutting(plane)]
    for position, plane in enumerate(planes):
        run = prepared.run_of(plane)
        panels += find_panels(run, prepared.scene.capture.room) if run is not None else []
        panels += _boxes(prepared, plane)
        yield 0.5 * (position + 1) / len(planes), ()
    fronts = without_sides([panel for panel in panels if panel.confidence > 0.5 * params.least_confidence])
    wanted = _apart([panel for panel in fronts if panel.confidence >= _least(panel.category)])
    found: list[Proposal] = []
    shown: list[tuple[Proposal, Panel]] = []
    for position, panel in enumerate(wanted):
        proposal = _present_panel(prepared, panel)
        if proposal is not None:
            proposal = replace(proposal, doubts=clashes(panel, shown))
            found.append(proposal)
            shown.append((proposal, panel))
        yield 0.5 + 0.3 * (position + 1) / len(wanted), _ranked(found)
    clumps = find_clumps(prepared.scene.capture, prepared.planes)[: params.most_things]
    for position, clump in enumerate(clumps):
        inside = any(_holds(proposal, panel, clump) for proposal, panel in shown)
        proposal = None if inside else _present_clump(prepared, clump, found)
        found += [proposal] if proposal is not None else []
        yield 0.8 + 0.2 * (position + 1) / len(clumps), _ranked(found)
    yield 1.0, _ranked(found)


def is_taken(share: float) -> bool:
    """Whether a mask that covers this fraction of a proposal's outline is of the same object."""
    return share > tuned(Params).taken_share


def covered_share(outline: Mask, mask: Mask) -> float:
    """Fraction 0..1 of a proposal's outline that is in a mask of the same frame and size."""
    size = int(np.count_nonzero(outline))
    return int(np.count_nonzero(outline & mask)) / size if size else 0.0


def _least(category: str) -> float:
    params = tuned(Params)
    return params.least_of_boxes if _is_box(category) else params.least_confidence


def _is_box(category: str) -> bool:
    return category_of(category).kind == "appliance"


def _ranked(found: list[Proposal]) -> tuple[Proposal, ...]:
    return tuple(sorted(found, key=lambda proposal: -proposal.confidence))


def _worth_cutting(plane: PlaneRegion) -> bool:
    params = tuned(Params)
    return plane.area_m2 > params.least_plane_m2 and min(plane.width_m, plane.height_m) > params.least_side_m


def _apart(panels: list[Panel]) -> list[Panel]:
    """Non-maximum suppression of overlapping panels on one plane: boxes before their doors, then by confidence."""
    kept: list[Panel] = []
    for panel in sorted(panels, key=lambda panel: (not _is_box(panel.category), -panel.confidence)):
        if not any(_covers(other, panel) or _covers(panel, other) or _same_box(panel, other) for other in kept):
            kept.append(panel)
    return kept


def _same_box(panel: Panel, other: Panel) -> bool:
    """Whether two faces belong to one appliance: two of one category never stand corner to corner."""
    if panel.category != other.category or not _is_box(panel.category):
        return False
    one, two = panel.rectangle, other.rectangle
    return bool(np.linalg.norm(one.centre - two.centre) < max(one.width_m, two.width_m))


def _covers(panel: Panel, other: Panel) -> bool:
    """Whether the centre of another panel lies on a panel."""
    local = panel.rectangle.world_from_front.inverse.apply(other.rectangle.centre)
    return bool(abs(local[1]) < tuned(Params).same_plane_m and panel.rectangle.covers(local))


def clashes(panel: Panel, others: Iterable[tuple[Proposal, Panel]]) -> tuple[str, ...]:
    """Doubts about a panel that overlaps fronts proposed before it: no two fronts share a place."""
    params = tuned(Params)
    half_w, half_h = panel.rectangle.half_m
    doubts = []
    for proposal, other in others:
        x, off, z = panel.rectangle.world_from_front.inverse.apply(other.front.outline.corners).T
        across = min(x.max(), half_w) - max(x.min(), -half_w)
        down = min(z.max(), half_h) - max(z.min(), -half_h)
        if np.abs(off).max() < params.same_plane_m and min(across, down) > params.clash_m:
            doubts.append(f"overlaps the proposed {proposal.category} beside it by {100 * min(across, down):.0f} cm")
    return tuple(doubts)


def _holds(proposal: Proposal, panel: Panel, clump: Clump) -> bool:
    """Whether a cluster is part of the box behind a front."""
    params = tuned(Params)
    x, behind, z = panel.rectangle.world_from_front.inverse.apply(clump.points.mean(axis=0))
    width, depth, height = np.array(proposal.size_m) / [2, 1, 2] + params.box_slack_m
    return bool(abs(x) < width and abs(z) < height and -2 * params.box_slack_m < behind < depth)


# Boxes: refrigerators of several doors, microwaves


def _machine(width_m: float, height_m: float, bottom_m: float) -> Category | None:
    """Appliance category whose front a plane could be: the whole front of one from the floor up, or part of a glass front."""
    params = tuned(Params)
    for kind in every_category():
        if kind.kind != "appliance" or kind.place is None or not kind.place.holds(bottom_m):
            continue
        whole = kind.width.holds(width_m) and params.tall_m < height_m < kind.height.high
        part = params.least_seen_m < width_m < kind.width.high and params.least_seen_m < height_m < kind.height.high
        if part if kind.dark else whole:
            return kind
    return None


def _boxes(prepared: PreparedCapture, plane: PlaneRegion) -> list[Panel]:
    """Appliance whose front a whole plane could be."""
    params = tuned(Params)
    room = prepared.scene.capture.room
    if not room.floor_found:
        return []
    middle = plane.world_from_plane.translation
    kind = _machine(plane.width_m, plane.height_m, float(middle[2]) - plane.height_m / 2)
    if kind is None:
        return []
    found = _confirmed(prepared, kind.name, click_on(prepared.scene, middle, plane.outward))
    if not isinstance(found, FoundAppliance) or is_on_wall(found.front.run, room, params.shallowest_box_m):
        return []
    front = replace(found.front, depth_m=min(found.front.depth_m, kind.depth.high))
    return [Panel(front, kind.name, front_certainty(front_panel(front), kind))]


# Presentation: the frame that shows a proposal best, and a click there that selects it


def _present_panel(prepared: PreparedCapture, panel: Panel) -> Proposal | None:
    scene, is_box = prepared.scene, _is_box(panel.category)
    views = best_views(scene, panel.front.outline.corners, panel.run.grid.outward)
    shown = [(front_mask(panel.front, scene, frame), frame) for frame in views]
    for (mask, _), frame in sorted(shown, key=lambda view: -np.count_nonzero(view[0][0])):
        for click in panel_clicks(scene, panel, frame, mask):
            found = _confirmed(prepared, panel.category, click)
            if isinstance(found, FoundFront | FoundAppliance) and isinstance(found, FoundAppliance) == is_box:
                if _overlap(panel, found) > tuned(Params).same_front:
                    return _proposal(prepared, panel, found, frame, click)
                break
    return None


def _proposal(
    prepared: PreparedCapture, panel: Panel, found: FoundFront | FoundAppliance, frame: Frame, click: PromptPoint
) -> Proposal:
    face = panel.rectangle
    return Proposal(
        kind=found.kind,
        category=panel.category,
        confidence=round(panel.confidence, 3),
        click=click,
        outline=pack_mask(found.see(frame).mask),
        size_m=(face.width_m, panel.front.depth_m or found.front.depth_m, face.height_m),
        centre_world=face.centre,
        handle_px=_handle_px(panel, frame),
    )


def _present_clump(prepared: PreparedCapture, clump: Clump, others: list[Proposal]) -> Proposal | None:
    params = tuned(Params)
    scene = prepared.scene
    for click in clump_clicks(scene, clump):
        frame = scene.frame(click.frame)
        floor = clump.base_m if scene.capture.room.floor_found else None
        category = name_thing(clump.extent_m, floor)
        found = _confirmed(prepared, category, click)
        if found is None or found.kind != "thing":
            continue
        mask, box = found.see(frame).mask, found.box()
        if box is None or np.count_nonzero(mask) < prepared.config.least_area_px:
            continue
        if box.dimensions_m.max() > params.larger * clump.extent_m.max() + params.larger_m or _hits(mask, frame, others):
            return None
        width, depth, height = box.dimensions_m
        confidence = clump.confidence * _agreement(clump, box.dimensions_m)
        if confidence < params.least_of_things:
            continue
        return Proposal(
            kind="thing",
            category=category,
            confidence=round(confidence, 3),
            click=click,
            outline=pack_mask(mask),
            size_m=(float(width), float(depth), float(height)),
            centre_world=box.world_from_object.translation,
            handle_px=(),
        )
    return None


def _agreement(clump: Clump, dimensions_m: np.ndarray) -> float:
    """Agreement (0..1) of a click's result with the cluster; depth is left out, as it is observed worst."""
    seen = np.array([clump.extent_m[:2].max(), clump.extent_m[2]])
    given = np.array([dimensions_m[:2].max(), dimensions_m[2]])
    return float(np.exp(-np.abs(np.log(given / seen)).sum()))


def _hits(mask: Mask, frame: Frame, others: list[Proposal]) -> bool:
    return any(other.click.frame == frame.index and mask[int(other.click.y), int(other.click.x)] for other in others) or any(
        _inside(mask, frame, other.centre_world) for other in others if other.kind != "front"
    )


def _inside(mask: Mask, frame: Frame, point: Vector3) -> bool:
    local = frame.world_from_camera.inverse.apply(point[None])
    if local[0, 2] < 0.1:
        return False
    u, v = project(local, frame.rgb_camera)[0]
    return bool(0 <= u < mask.shape[1] and 0 <= v < mask.shape[0] and mask[int(v), int(u)])


def _confirmed(prepared: PreparedCapture, category: str, click: PromptPoint | None) -> Found | None:
    """Result that a person would get from this click."""
    if click is None:
        return None
    try:
        return prepared.find(ObjectPrompt(name="proposal", category=category, points=(click,)))
    except R2C2RError:
        return None


def _overlap(panel: Panel, found: FoundFront | FoundAppliance) -> float:
    """IoU of two rectangles on about the same plane."""
    (half_w, half_h), other = panel.rectangle.half_m, found.front.outline.corners
    (x0, y0, z1), _, (x1, y1, z0), _ = panel.rectangle.world_from_front.inverse.apply(other)
    if max(abs(y0), abs(y1)) > tuned(Params).same_plane_m:
        return 0.0
    across = max(min(x1, half_w) - max(x0, -half_w), 0.0)
    down = max(min(z1, half_h) - max(z0, -half_h), 0.0)
    shared = across * down
    return float(shared / (4 * half_w * half_h + (x1 - x0) * (z1 - z0) - shared))


def _handle_px(panel: Panel, frame: Frame) -> tuple[tuple[float, float], ...]:
    handle = panel.front.handle
    if handle is None:
        return ()
    corners = [
        [handle.left, handle.top],
        [handle.right, handle.top],
        [handle.right, handle.bottom],
        [handle.left, handle.bottom],
    ]
    local = frame.world_from_camera.inverse.apply(panel.run.grid.points_at(np.array(corners), -0.02))
    return tuple((round(float(u), 1), round(float(v), 1)) for u, v in project(local, frame.rgb_camera))
