"""A click on a front that stands open in its frame, taken back to where that front is closed."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.fronts.front import Front, front_leaf
from r2c2r_core.segment.motion.hypotheses import Hypothesis, hypotheses
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.motion.leaf import Params as LeafParams
from r2c2r_core.segment.motion.likelihood import closed_counts, evidence, lay_out
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When a click is on something that moved."""

    past_share: float = param(0.3, "share", "of the frames that look there, that must look past what was clicked")
    least_frames: int = param(3, "count", "frames that must look past it", ge=1)
    past_m: float = param(0.06, "m", "behind it, from where they do")
    reach_m: float = param(1.0, "m", "from a click to the middle of a front that may have been swung or drawn there")
    off_m: float = param(0.03, "m", "of a click off a leaf in one of the states that are tried")
    gain: float = param(20.0, "log", "by which the clicked frame must show the leaf there rather than in its place")


def closed_place(prepared: PreparedCapture, point: Vector3, frame_index: int) -> Vector3:
    """Where a clicked point (world) of an open front lies when it is closed; the point itself where nothing moved there."""
    scene = prepared.scene
    if not _moved(point, scene):
        return point
    best, place = tuned(Params).gain, point
    leaves = _leaves_near(prepared, point)
    if any(_holds(leaf, point) and _stands_there(leaf, scene) for leaf in leaves):
        return point
    for leaf in leaves:
        for hypothesis in hypotheses(leaf):
            if hypothesis.lateral:
                continue
            gain, closed = _as_opened(leaf, hypothesis, point, scene, scene.frame(frame_index))
            if gain > best:
                best, place = gain, closed
    return place


def _moved(point: Vector3, scene: Scene) -> bool:
    """Whether many frames that look there look past it."""
    params = tuned(Params)
    past = there = 0
    for frame in scene.frames:
        z, seen, _ = look_up(point[None], frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        past += int(scene.noise.seen_through(seen, z, params.past_m)[0])
        there += int(scene.noise.agrees(seen, z, params.past_m)[0])
    return past >= params.least_frames and past > params.past_share * (past + there)


def _leaves_near(prepared: PreparedCapture, point: Vector3) -> list[Leaf]:
    """The panels of the runs that it stands before."""
    found = []
    for region in prepared.planes:
        local = region.world_from_plane.inverse.apply(point[None])[0]
        reach = tuned(Params).reach_m
        if not -reach < local[1] < 0 or abs(local[0]) > region.width_m / 2 + reach:
            continue
        run = prepared.run_of(region)
        leaves = [] if run is None else [front_leaf(Front(run, cell, None, 0.0)) for cell in run.cells]
        found += [leaf for leaf in leaves if np.linalg.norm(leaf.world_from_front.translation - point) < reach]
    return found


def _holds(leaf: Leaf, point: Vector3) -> bool:
    """Whether a point lies on a closed leaf."""
    local = leaf.world_from_front.inverse.apply(point[None])[0]
    return bool(abs(local[1]) < tuned(Params).off_m and abs(local[0]) < leaf.half_m[0] and abs(local[2]) < leaf.half_m[1])


def _stands_there(leaf: Leaf, scene: Scene) -> bool:
    """Whether frames see a board in its closed place more often than they look past it: of one held open, the scan has both."""
    agrees, through, _ = closed_counts(leaf, scene.frames, scene).sum(axis=0)
    return bool(agrees > through)


def _as_opened(leaf: Leaf, hypothesis: Hypothesis, point: Vector3, scene: Scene, frame: Frame) -> tuple[float, Vector3]:
    """How much likelier a frame makes the state that brings the leaf under a click than the closed one, and the click there."""
    front = leaf.world_from_front.inverse.apply(point[None])
    local = np.concatenate([hypothesis.pose(float(state)).inverse.apply(front) for state in hypothesis.states])
    half_w, half_h = leaf.half_m
    off = np.minimum(np.abs(local[:, 1]), np.abs(local[:, 1] - tuned(LeafParams).thickness_m))
    on = (off < tuned(Params).off_m) & (np.abs(local[:, 0]) < half_w) & (np.abs(local[:, 2]) < half_h)
    on[0] = False
    if not on.any():
        return 0.0, point
    log = evidence(lay_out(leaf, hypothesis), scene, frame)
    best = int(np.argmax(np.where(on, log, -np.inf)))
    closed = leaf.world_from_front.apply(np.array([[local[best, 0], 0.0, local[best, 2]]]))[0]
    return float(log[best] - max(log[0], 0.0)), closed
