"""Clicks on a front that stands open in the clicked frame, mapped back to where that front is closed."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.rectangle import TOWARDS
from r2c2r_core.segment.fronts.clicked_dark import best_frames, dark_beyond, dark_frames
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.fronts.units import unit_cell
from r2c2r_core.segment.motion.filmed import Params as FilmedParams
from r2c2r_core.segment.motion.hypotheses import USUAL_WAYS, Hypothesis, hypotheses
from r2c2r_core.segment.motion.leaf import Leaf, face_points
from r2c2r_core.segment.motion.likelihood import evidence, lay_out
from r2c2r_core.segment.motion.track import Params as TrackParams
from r2c2r_core.segment.planes import PlaneRegion, regions_at
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of clicks on moved fronts."""

    past_share: float = param(
        0.25, "share", "Minimum fraction of the frames observing the click that must look past the clicked surface"
    )
    least_frames: int = param(3, "count", "Minimum number of frames that must look past it", ge=1)
    past_m: float = param(0.06, "m", "Minimum distance of depth behind the clicked surface for a frame to look past it")
    reach_m: float = param(
        1.0, "m", "Maximum distance from a click to the centre of a front that may have been opened to there"
    )
    least_m: float = param(
        0.1, "m", "Minimum side of a leaf: narrower panels belong to a frame", source="makers' narrowest fronts: 150 mm"
    )
    off_m: float = param(0.03, "m", "Maximum distance of a click from a leaf in one of the tested states")
    gain: float = param(20.0, "log", "Minimum log-likelihood ratio of the open over the closed leaf in the clicked frame")
    near_steps: int = param(
        2, "count", "Number of states beside the likeliest one under a click that do not count as rivals", ge=0
    )
    least: float = param(
        7.0,
        "log",
        "Minimum log-likelihood ratio of the open leaf over rival states and over unknown: the rest may be its empty place",
    )
    row: float = param(
        1.5,
        "ratio",
        "Ratio of a plane's width or height to a leaf's above which the plane has more closed fronts than that leaf",
    )
    unknown: float = param(0.1, "share", "Fraction of frames that carry no information: hands, gloss, wrong camera pose")


def closed_place(prepared: PreparedCapture, point: Vector3, frame_index: int, category: Category) -> Vector3:
    """Closed position of a clicked point (world) on an open front; the point itself where nothing moved there.

    An open front uncovers the sides and back of its unit, which are boards too; an open drawer looks like one outside; and a
    front may be filmed open for longer than closed. So all frames together weigh three cases: a nearby leaf was opened to the
    click, the click is on a closed leaf that was opened itself, or nothing moved.
    """
    params, scene = tuned(Params), prepared.scene
    if not was_moved(point, scene):
        return point
    frame = scene.frame(frame_index)
    leaves = [leaf for leaf in _leaves_near(prepared, point, category) if _has_unit(leaf, scene, category)]
    opened: list[tuple[Leaf, Hypothesis, int, Vector3]] = []
    for leaf in leaves:
        if _in_a_row(prepared, point, leaf):
            continue
        for hypothesis in _ways(leaf):
            there, elsewhere, shut, state, closed_point = _as_opened(leaf, hypothesis, point, scene, frame)
            if there - max(elsewhere, 0.0) > params.least and there - shut > params.gain:
                opened.append((leaf, hypothesis, state, closed_point))
    if not opened:
        return point
    held = [_explained(_in_all(leaf, each, scene)) for leaf in leaves if _holds(leaf, point) for each in _ways(leaf)]
    closed, best, place = max(held, default=0.0), tuned(TrackParams).gain, point
    for leaf, hypothesis, state, closed_point in opened:
        log = _in_all(leaf, hypothesis, scene)
        gain = _opens_by(log) + (tuned(FilmedParams).usual if hypothesis.way in USUAL_WAYS.get(category.opens, ()) else 0.0)
        if _explained(log) > closed and gain > best and _is_free(log, state):
            best, place = gain, closed_point
    return place


def was_moved(point: Vector3, scene: Scene) -> bool:
    """Whether enough of the frames observing a point look past it."""
    params = tuned(Params)
    past = there = 0
    for frame in scene.frames:
        z, seen, _ = look_up(point[None], frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        past += int(scene.noise.seen_through(seen, z, params.past_m)[0])
        there += int(scene.noise.agrees(seen, z, params.past_m)[0])
    return past >= params.least_frames and past > params.past_share * (past + there)


def _leaves_near(prepared: PreparedCapture, point: Vector3, category: Category) -> list[Leaf]:
    """Panels of the runs within reach that a point lies on or in front of; for an appliance, faces of its size."""
    found = []
    for region in prepared.planes:
        local = region.world_from_plane.inverse.apply(point)
        reach = tuned(Params).reach_m
        if not -reach < local[1] < tuned(Params).off_m or abs(local[0]) > region.width_m / 2 + reach:
            continue
        run = prepared.run_of(region)
        leaves = [] if run is None else [Leaf.of(Front(run, cell, None, 0.0).rectangle) for cell in run.cells]
        if category.kind == "appliance":
            faces = (Leaf.of(region.bounds), *leaves)
            leaves = [leaf for leaf in faces if category.width.allows(leaf.width_m) and category.height.allows(leaf.height_m)]
        if category.one_front:
            leaves += _dark_units(prepared, region, point, category)
        leaves = [leaf for leaf in leaves if min(leaf.width_m, leaf.height_m) > tuned(Params).least_m]
        found += [leaf for leaf in leaves if np.linalg.norm(leaf.centre - point) < reach]
    return found


def _dark_units(prepared: PreparedCapture, region: PlaneRegion, point: Vector3, category: Category) -> Iterator[Leaf]:
    """Units of black glass on a plane that would reach a point if opened by about a right angle."""
    local = region.world_from_plane.inverse.apply(point)
    for way in USUAL_WAYS.get(category.opens, ()):
        hinge = next((towards for side, towards in TOWARDS.items() if side == way), np.zeros(3))
        place = region.world_from_plane.apply(local * [1, 0, 1] + local[1] * hinge)
        frames = dark_frames(prepared.scene, region, place, best_frames(prepared.scene, place))
        beyond_m = dark_beyond(prepared.scene, region, place, frames, category)
        run = prepared.run_of(region, margin_m=beyond_m) if frames else None
        if run is None:
            continue
        column, row = run.grid.cells_of(place[None])[0].tolist()
        cell = unit_cell(run, column, row, category)
        if cell is not None:
            yield Leaf.of(Front(run, cell, None, 0.0).rectangle)


def _has_unit(leaf: Leaf, scene: Scene, category: Category) -> bool:
    """Whether a unit may stand behind a leaf: few frames look through its place except through the leaf's own.

    Behind an open door there is none: the same motion seen in reverse, open where it is closed, is told apart by that.
    """
    params = tuned(Params)
    points = leaf.world_from_front.apply(face_points(leaf) + np.array([0.0, category.depth.low / 2, 0.0]))
    local, free = leaf.world_from_front.inverse.apply(points), np.zeros(len(points), int)
    for frame in scene.frames:
        z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        eye = leaf.world_from_front.inverse.apply(frame.world_from_camera.translation[None])[0]
        crossing = eye + (local - eye) * (eye[1] / (eye[1] - local[:, 1]))[:, None]
        by_the_leaf = (eye[1] < 0) & leaf.covers(crossing)
        free += scene.noise.seen_through(seen, z, params.past_m) & ~by_the_leaf
    return bool((free >= params.least_frames).mean() < tuned(TrackParams).free_share)


def _holds(leaf: Leaf, point: Vector3) -> bool:
    """Whether a point lies on a closed leaf."""
    local = leaf.world_from_front.inverse.apply(point)
    return bool(abs(local[1]) < tuned(Params).off_m and leaf.covers(local))


def _in_a_row(prepared: PreparedCapture, point: Vector3, leaf: Leaf) -> bool:
    """Whether the clicked point lies on a plane larger than a leaf: closed fronts stand in a row."""
    row = tuned(Params).row
    return any(
        region.width_m > row * leaf.width_m or region.height_m > row * leaf.height_m
        for region in regions_at(prepared.planes, point)
    )


def _ways(leaf: Leaf) -> list[Hypothesis]:
    """Joint hypotheses that move a leaf out of its plane."""
    return [each for each in hypotheses(leaf) if not each.lateral]


def _in_all(leaf: Leaf, hypothesis: Hypothesis, scene: Scene) -> np.ndarray:
    """Log-likelihood ratios (frames, states) of each state to an unknown one, with an outlier fraction."""
    states, unknown = lay_out(leaf, hypothesis), tuned(Params).unknown
    log = np.stack([evidence(states, scene, frame) for frame in scene.frames])
    return np.logaddexp(np.log(unknown), np.log1p(-unknown) + log)


def _explained(log: np.ndarray) -> float:
    """Log-likelihood ratio over all frames of a leaf on a joint, at its best state in each, to nothing being known there."""
    return float(log.max(axis=1).sum())


def _opens_by(log: np.ndarray) -> float:
    """Log-likelihood ratio over all frames of a leaf opened by a joint to a leaf that never moved."""
    return float((log.max(axis=1) - log[:, 0]).sum())


def _is_free(log: np.ndarray, state: int) -> bool:
    """Whether the space of an open state is empty in the frames that show the leaf closed: another front would fill it."""
    closed = log.argmax(axis=1) == 0
    return bool(log[closed, state].sum() < 0)


def _as_opened(
    leaf: Leaf, hypothesis: Hypothesis, point: Vector3, scene: Scene, frame: Frame
) -> tuple[float, float, float, int, Vector3]:
    """Log-likelihoods in one frame of the best state under a click, the best rival and the closed one; that state; and the
    click where the leaf is closed.

    The log-likelihoods are relative to nothing being known there.
    """
    front = leaf.world_from_front.inverse.apply(point[None])
    local = np.concatenate([hypothesis.pose(float(state)).inverse.apply(front) for state in hypothesis.states])
    off = np.minimum(np.abs(local[:, 1]), np.abs(local[:, 1] - leaf.thickness_m))
    on = (off < tuned(Params).off_m) & leaf.covers(local)
    on[0] = False
    if not on.any():
        return 0.0, 0.0, 0.0, 0, point
    log = evidence(lay_out(leaf, hypothesis), scene, frame)
    best = int(np.argmax(np.where(on, log, -np.inf)))
    closed = leaf.world_from_front.apply(np.array([local[best, 0], 0.0, local[best, 2]]))
    near = np.abs(np.arange(len(log)) - best) <= tuned(Params).near_steps
    return float(log[best]), float(log[~near & ~on].max(initial=-np.inf)), float(log[0]), best, closed
