"""The clicked panel as a metric rectangle on its run's plane, and its mask in every frame by reprojection."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.calibration import probability
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.depth import FrontDepth, front_depth
from r2c2r_core.model.capture import Frame, Room
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.rectangle import TOWARDS, Rectangle3
from r2c2r_core.model.track import FrontHandle, FrontPanel
from r2c2r_core.segment.fronts.units import unit_cell
from r2c2r_core.segment.fronts.unseen import with_unseen_top
from r2c2r_core.segment.mosaics.edges import panel_edges, surface_of
from r2c2r_core.segment.mosaics.handles import GridHandle, find_handle
from r2c2r_core.segment.mosaics.orthomosaic import Cell, PlaneGrid, joined
from r2c2r_core.segment.mosaics.panel_net import SUREST
from r2c2r_core.segment.mosaics.strips import clear_of_strips
from r2c2r_core.segment.motion.board import hand_px, patches_unlike
from r2c2r_core.segment.occlusion import Facet, Tolerance, at_size, visible_mask
from r2c2r_core.segment.occlusion import Params as SightParams
from r2c2r_core.segment.runs.contrast import edge_changes
from r2c2r_core.segment.runs.partition import Clicks, Partitioner
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

NOWHERE = np.zeros((0, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the panel choice and of the carcass sides."""

    usual_protrusion_m: float = param(
        0.035, "m", "Protrusion of a handle without relief", source="bar handles protrude by 25-40 mm"
    )
    seam_scale: float = param(
        3.0,
        "log",
        "Log-likelihood ratio that counts as one: evidence of a seam and of both its sides is correlated",
        gt=0,
        source="of 1, 3 and 6 the one that tells right from wrong fronts best, in 46 development kitchens",
    )
    handle_share: float = param(0.35, "share", "Maximum fraction of a panel that its handle may cover: more is its frame")
    pair_width_share: float = param(
        0.08, "share", "Maximum relative difference in width of the two doors of a pair: they are equally wide"
    )
    met_width_share: float = param(
        0.2, "share", "Maximum relative difference where their handles meet: a cell may include the gap beside its door"
    )
    handles_meet: float = param(0.5, "score", "Minimum pair score of doors whose handles meet")
    two_names: float = param(
        3.0, "log", "Log-odds gain of a seam between two clicks of different names", source="one click in twenty is a slip"
    )
    off_plane_m: float = param(
        0.06, "m", "Maximum distance from the plane of a click on the panel", source="handles protrude by up to 5 cm"
    )
    far_before_m: float = param(
        0.30, "m", "Distance in front of a side beyond which occluders are ignored as no evidence about it"
    )
    side_samples: int = param(200, "count", "Minimum number of observed points of a side for it to be known", ge=1)
    side_share: float = param(0.5, "share", "Minimum fraction of those points that depth must confirm")
    side_inset_m: float = param(0.10, "m", "Minimum distance behind the front of side samples: nearer ones are its edge")
    steady_m: float = param(0.012, "m", "Maximum distance from a border of clicks that are within its pose error")
    border_m: float = param(0.035, "m", "Maximum distance from a border of clicks that correct it: no panel is so narrow")
    edge_lab: float = param(
        3.0,
        "grey",
        "Minimum CIELAB colour change at an edge for it to be visible",
        gt=0,
        source="development kitchens of both generators: of 6 edges below it none was within 10 mm, of 1246 above it 97 %",
    )
    unseen_edge: float = param(
        0.125,
        "share",
        "Maximum probability of an edge that is not visible",
        ge=0,
        le=1,
        source="same kitchens: none of 6, with Laplace's rule of succession",
    )
    hull_share: float = param(
        1.3, "ratio", "Maximum area of two panels' joint rectangle, relative to their own, for them to belong together"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """A panel on a run, with the sides of its carcass that the scan shows."""

    run: Run
    cell: Cell
    handle: GridHandle | None
    depth_m: float  # to the wall behind, or the usual depth
    sides: tuple[HingeSide, ...] = ()  # faces of the carcass in view
    strips: tuple[float, float] = (0.0, 0.0)  # heights of strips of another material at its upper, lower edge, grid cells

    @property
    def outline(self) -> Rectangle3:
        """Its rectangle along the lines of its grid, which may lean."""
        return self.run.grid.rectangle(self.cell)

    @property
    def rectangle(self) -> Rectangle3:
        """Its rectangle with level edges, as fronts hang."""
        outline = self.outline
        return replace(outline, world_from_front=Rigid3(self.run.region.world_from_plane.rotation, outline.centre))


def find_front(
    run: Run, positives: Points, negatives: Points, *, pair: bool, kind: Category | None = None, others: Points = NOWHERE
) -> Front | None:
    """Panel under the clicks (world points; the first one decides); None when the first misses the run's panels.

    `pair` joins the two doors of a cabinet, `kind` is the clicked category; `others` are clicks on other objects.
    """
    on, off = run.grid.cells_of(near_plane(run.grid, positives)), run.grid.cells_of(near_plane(run.grid, negatives))
    first = _clicked(run, float(on[0, 0]), float(on[0, 1]), kind) if len(on) else None
    if first is None:
        return None
    cells = [first]
    partner = _partner(run, first) if pair else None
    cells += [partner] if partner is not None else []
    cell = joined(cells)
    for column, row in on[1:]:
        cell, taken = _with(cell, float(column), float(row), run)
        cells += taken
    for column, row in off:
        cell = _without(cell, float(column), float(row), run, on)
    cell = _own_part(cell, on, run.grid.cells_of(near_plane(run.grid, others)), run)
    handle = next((handle for part in cells if (handle := _handle_on(run, part)) is not None), None)
    surface = surface_of(run.mosaic, run.relief)
    refined = panel_edges(cell, surface, run.grid.cell_m)
    panel = clear_of_strips(refined, surface, run.grid.cell_m)
    strips = panel.top - refined.top, refined.bottom - panel.bottom
    panel = with_unseen_top(panel, run, kind)
    return Front(run, panel, own_handle(handle, panel), 0.0, strips=strips)


def own_handle(handle: GridHandle | None, panel: Cell) -> GridHandle | None:
    """Part of a handle that lies on a panel; None for a neighbour's handle, and for a raised frame, which covers too much."""
    if handle is None or not panel.contains((handle.left + handle.right) / 2, (handle.top + handle.bottom) / 2):
        return None
    left, right = max(handle.left, panel.left), min(handle.right, panel.right)
    top, bottom = max(handle.top, panel.top), min(handle.bottom, panel.bottom)
    if (right - left) * (bottom - top) > tuned(Params).handle_share * panel.width * panel.height:
        return None
    return replace(handle, left=left, right=right, top=top, bottom=bottom)


def front_panel(front: Front) -> FrontPanel:
    """Measured rectangle in the `front` frame."""
    face, changes = front.rectangle, edge_changes(front.run.mosaic, front.cell)
    strengths = _edge_strengths(front, changes)
    return FrontPanel(
        world_from_front=face.world_from_front,
        width_m=face.width_m,
        height_m=face.height_m,
        handle=_handle_in_front(front, front.cell) if front.handle is not None else None,
        confidence=float(np.mean(strengths)),
        roll_rad=front.run.roll_rad,
        edges=strengths,
        changes=changes,
        seam=seam_inside(front),
        strip_over_m=front.strips[0] * front.run.grid.cell_m,
    )


def front_mask(front: Front, scene: Scene, frame: Frame, part: Points | None = None) -> tuple[Mask, float]:
    """Visible pixels of the front, or of a part of it, in a frame, and the visible fraction of its projection."""
    grid = front.run.grid
    if (frame.world_from_camera.translation - grid.world_from_plane.translation) @ grid.outward < 0.03:
        return np.zeros((frame.rgb_camera.height, frame.rgb_camera.width), bool), 0.0
    slide, cell = front.run.slide_of(frame.index, scene), front.cell
    panes = front.run.panes[max(round(cell.top), 0) : round(cell.bottom), max(round(cell.left), 0) : round(cell.right)]
    corners = grid.rectangle(cell, slide).corners if part is None else part
    face, share = visible_mask([Facet(corners)], scene, frame)
    if panes.any():
        through, share = visible_mask([Facet(corners)], scene, frame, Tolerance(behind_m=np.inf))
        face |= through & (grid.in_photo(front.run.panes.astype(np.uint8), frame, slide) > 0)
    face = face & ~_before(face, front, scene, frame)
    return face | sides_mask(front, scene, frame) if part is None else face, share


def _before(face: Mask, front: Front, scene: Scene, frame: Frame) -> Mask:
    """Pixels without depth, of another colour than the front has in most frames: a sleeve, or the black glass of an open door.

    Where no frame has depth on the front, it is black glass itself.
    """
    dark, place = (scene.depth(frame.index) == 0).astype(np.uint8), front.outline.centre
    wide = cv2.erode(dark, np.ones((hand_px(place, frame, frame.depth_camera) // 2,) * 2, np.uint8)) > 0
    if not (face & at_size(wide, face)).any():
        return np.zeros_like(face)
    slide = front.run.slide_of(frame.index, scene)
    usual, seen = (front.run.grid.in_photo(one, frame, slide) for one in (front.run.mosaic, front.run.seen.astype(np.uint8)))
    usual_lab = cv2.cvtColor(usual, cv2.COLOR_RGB2LAB)
    return patches_unlike(usual_lab, at_size(dark > 0, face) & (seen > 0), place, scene, frame)


def sides_mask(front: Front, scene: Scene, frame: Frame) -> Mask:
    """Visible pixels of the carcass's observed sides alone."""
    face = front.run.grid.rectangle(front.cell, front.run.slide_of(frame.index, scene))
    facing = [
        Facet(side_corners(face, side, front.depth_m), confirm=True)
        for side in front.sides
        if side_faces(front.outline, side, frame.world_from_camera.translation)
    ]
    return visible_mask(facing, scene, frame)[0]


def depth_behind(front: Front, room: Room, category: Category) -> FrontDepth:
    """Depth of a front of a category here, as far as the walls constrain it."""
    return front_depth(room.walls, front.outline.centre, front.outline.outward, category.depth)


def seen_sides(front: Front, scene: Scene) -> tuple[HingeSide, ...]:
    """Faces of the carcass that depth confirms over most of their area, away from the front's own edge."""
    found, params = list[HingeSide](), tuned(Params)
    sides: tuple[HingeSide, ...] = ("left", "right", "bottom")
    for side in sides:
        agree = total = 0
        points = _side_samples(front, side)
        for frame in scene.frames[:: max(1, len(scene.frames) // 40)]:
            if not side_faces(front.outline, side, frame.world_from_camera.translation):
                continue
            z, depth, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
            known = (depth > 0) & ~scene.noise.occluded(depth, z, params.far_before_m)  # far occluders are no evidence
            agree += int(scene.noise.agrees(depth, z, tuned(SightParams).confirm_m).sum())
            total += int(known.sum())
        if total > params.side_samples and agree > params.side_share * total:
            found.append(side)
    return tuple(found)


def _clicked(run: Run, column: float, row: float, kind: Category | None) -> Cell | None:
    """Panel under a click, or a neighbour of plausible size where the click is near its border and its own panel has none."""
    cell = run.cell_at(column, row)
    if cell is None or kind is None:
        return cell
    if kind.one_front:
        return unit_cell(run, column, row, kind) or cell
    if _may_be(cell, run, kind):
        return cell
    near = tuned(Params).border_m / run.grid.cell_m
    beside = [(_apart(other, column, row), other) for other in run.cells if _may_be(other, run, kind)]
    return min((pair for pair in beside if pair[0] < near), key=lambda pair: pair[0], default=(0.0, cell))[1]


def _may_be(cell: Cell, run: Run, kind: Category) -> bool:
    """Whether a panel's size is plausible for a front of that category, or for one of its two doors."""
    width_m, height_m = cell.width * run.grid.cell_m, cell.height * run.grid.cell_m
    return kind.height.holds(height_m) and (kind.width.holds(width_m) or (kind.may_be_pair and kind.width.holds(2 * width_m)))


def _apart(cell: Cell, column: float, row: float) -> float:
    """Distance of a grid position from a panel."""
    beyond = max(cell.left - column, column - cell.right, 0.0), max(cell.top - row, row - cell.bottom, 0.0)
    return float(np.hypot(*beyond))


def _partner(run: Run, cell: Cell) -> Cell | None:
    """Other door of a pair: adjacent, equally high and wide, preferably where the handle points."""
    slack = 0.02 / run.grid.cell_m
    beside = [
        other
        for other in run.cells
        if abs(other.top - cell.top) < slack
        and abs(other.bottom - cell.bottom) < slack
        and min(abs(other.left - cell.right), abs(other.right - cell.left)) < slack
        and abs(other.width - cell.width) < _width_slack(run, cell, other) * cell.width
    ]
    if not beside:
        return None
    return max(beside, key=lambda other: (_pair_score(run, cell, other), -abs(other.width - cell.width)))


def _width_slack(run: Run, cell: Cell, other: Cell) -> float:
    """Maximum relative width difference of two doors of a pair: larger where their handles meet at the seam."""
    params = tuned(Params)
    return params.met_width_share if _pair_score(run, cell, other) > params.handles_meet else params.pair_width_share


def _pair_score(run: Run, cell: Cell, other: Cell) -> float:
    """Score of handles beside the shared seam of a pair."""
    score = 0.0
    for door, mate in ((cell, other), (other, cell)):
        handle = run.handles[run.cells.index(door)]
        if handle is not None:
            offset = ((handle.left + handle.right) / 2 - door.left) / door.width
            towards = offset if mate.left > door.left else 1 - offset
            score += handle.confidence * (towards - 0.5)
    return score


def near_plane(grid: PlaneGrid, clicks: Points) -> Points:
    """Clicks that lie on the panels' plane: others hit sides or objects in front, and are no evidence about panels."""
    away = grid.world_from_plane.inverse.apply(clicks)[:, 1]
    return clicks[np.abs(away) < tuned(Params).off_plane_m]


def holds(grid: PlaneGrid, cell: Cell, point: Vector3) -> bool:
    """Whether a world point lies on a cell of a plane."""
    on = grid.cells_of(near_plane(grid, point[None]))
    return len(on) > 0 and cell.contains(*on[0].tolist())


def nudged(cell: Cell, column: float, row: float, label: int, cell_m: float) -> Cell | None:
    """Cell with its border moved to a click beside it, or unchanged within pose error; None for clicks farther away."""
    params = tuned(Params)
    if (label == 1) == cell.contains(column, row):
        return cell
    edges = np.array([cell.left, cell.top, cell.right, cell.bottom])
    beyond = np.array([cell.left - column, cell.top - row, column - cell.right, row - cell.bottom])
    moved = np.flatnonzero(beyond > 0) if label == 1 else np.array([int(np.argmax(beyond))])
    off = np.abs(beyond[moved]).max() * cell_m
    if off > params.border_m:
        return None
    if off > params.steady_m:
        edges[moved] = np.array([column, row, column, row])[moved]
    return Cell(*edges.tolist())


def _with(cell: Cell, column: float, row: float, run: Run) -> tuple[Cell, list[Cell]]:
    """Cell extended to contain a click, and the panels it absorbed: a click well off it selects the panel there.

    Where the two form no rectangle, or no panel is there, the border moves to the click.
    """
    corrected = nudged(cell, column, row, 1, run.grid.cell_m)
    if corrected is not None:
        return corrected, []
    other = run.cell_at(column, row)
    both = joined([cell, other]) if other is not None else cell
    if other is None or _area(both) > tuned(Params).hull_share * (_area(cell) + _area(other)):
        return joined([cell, Cell(column, row, column, row)]), []
    return both, [other]


def _area(cell: Cell) -> float:
    return cell.width * cell.height


def _without(cell: Cell, column: float, row: float, run: Run, kept: np.ndarray) -> Cell:
    """Cell without a negative click: its border moves to the click if that is near, else it is cut along the clearest line."""
    corrected = nudged(cell, column, row, 0, run.grid.cell_m)
    return corrected if corrected is not None else _cut_off(cell, column, row, run, kept)


def _cut_off(cell: Cell, column: float, row: float, run: Run, kept: np.ndarray) -> Cell:
    """Part of the cell without the negative click, by the most probable division that parts it from the kept ones."""
    return _part_of(cell, [kept, np.array([[column, row]])], run, np.inf)


def _own_part(cell: Cell, on: np.ndarray, others: np.ndarray, run: Run) -> Cell:
    """Part of a cell with its own clicks (n, 2), where other objects' clicks (m, 2) on the same plane lie in it too."""
    inside = [other[None] for other in others if cell.contains(*other.tolist())]
    return _part_of(cell, [on, *inside], run, tuned(Params).two_names) if inside else cell


def _part_of(cell: Cell, clicked: list[np.ndarray], run: Run, shared_cost: float) -> Cell:
    """Part of a cell that holds the first click of the first object."""
    parts = Partitioner(run.odds, run.grid.cell_m).divide(cell, Clicks(clicked, shared_cost))
    return next((part for part in parts if part.contains(*clicked[0][0].tolist())), cell)


def _handle_on(run: Run, cell: Cell) -> GridHandle | None:
    if cell in run.cells:
        return run.handles[run.cells.index(cell)]
    return find_handle(run.odds, run.relief, cell)


def _handle_in_front(front: Front, cell: Cell) -> FrontHandle:
    assert front.handle is not None
    cell_m, handle = front.run.grid.cell_m, front.handle
    middle_x, middle_z = (cell.left + cell.right) / 2, (cell.top + cell.bottom) / 2
    return FrontHandle(
        left_m=(handle.left - middle_x) * cell_m,
        right_m=(handle.right - middle_x) * cell_m,
        bottom_m=(middle_z - handle.bottom) * cell_m,
        top_m=(middle_z - handle.top) * cell_m,
        protrusion_m=handle.protrusion_m or tuned(Params).usual_protrusion_m,
        confidence=handle.confidence,
        source=handle.source,
        protrusion_source="measured" if handle.protrusion_m else "default",
    )


def _edge_strengths(front: Front, changes: Iterable[float]) -> tuple[float, ...]:
    """Probability that each edge is where it was found, from its CIELAB colour change: left, right, top, bottom.

    Where no colour changes, an edge comes from depth alone, and depth ends 1-3 cm short of edges.
    """
    params, odds = tuned(Params), front.run.odds.of_edges(front.cell)
    return tuple(
        min(probability(SUREST if strip else own), 1.0 if change >= params.edge_lab else params.unseen_edge)
        for own, strip, change in zip(odds, (0.0, 0.0, *front.strips), changes, strict=True)
    )


def seam_inside(front: Front) -> float:
    """Probability that a panel is two fronts or more, by the best division of it."""
    params = tuned(Params)
    shown = replace(front.cell, top=max(front.cell.top, 0.0))
    gain = Partitioner(front.run.odds, front.run.grid.cell_m).seam_gain(shown, params.border_m)
    return probability(gain / params.seam_scale)


_SIDE_EDGES: dict[HingeSide, tuple[int, int]] = {"left": (0, 3), "right": (1, 2), "bottom": (2, 3), "top": (0, 1)}


def side_corners(face: Rectangle3, side: HingeSide, depth_m: float) -> Points:
    """World corners of the carcass face that starts at one edge of a panel."""
    corners = face.corners[list(_SIDE_EDGES[side])]
    back = corners - face.outward * depth_m
    return np.stack([corners[0], corners[1], back[1], back[0]])


def side_faces(face: Rectangle3, side: HingeSide, camera_world: Vector3) -> bool:
    """Whether a camera is on the outer side of a carcass face."""
    beyond = face.world_from_front.inverse.apply(camera_world) - face.corners_front[_SIDE_EDGES[side][0]]
    return bool(beyond @ TOWARDS[side] > 0)


def _side_samples(front: Front, side: HingeSide) -> Points:
    corners = side_corners(front.outline, side, front.depth_m)
    inset_m = tuned(Params).side_inset_m
    first = min(inset_m / max(front.depth_m, 1.1 * inset_m), 0.5)
    along, deep = np.meshgrid(np.linspace(0.1, 0.9, 9), np.linspace(first, 0.9, 9))
    a, d = along.ravel()[:, None], deep.ravel()[:, None]
    return (1 - d) * ((1 - a) * corners[0] + a * corners[1]) + d * ((1 - a) * corners[3] + a * corners[2])
