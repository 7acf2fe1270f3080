"""The drawer that stands open at a clicked point: what lies in it moves with it."""

from collections.abc import Iterator

from r2c2r_core.arrays import Vector3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.fronts.front import NOWHERE, Front, find_front
from r2c2r_core.segment.motion.carried import in_drawer, is_open
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.motion.likelihood import closed_counts
from r2c2r_core.segment.motion.track import Params as TrackParams
from r2c2r_core.segment.motion.track import find_motion
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import tuned

_DRAWER = category_of("drawer")


def drawer_at(prepared: PreparedCapture, point: Vector3, frame_index: int) -> Carrier | None:
    """Drawer that stands open in a frame with a point (world) behind its front; None where there is none."""
    frame = prepared.scene.frame(frame_index)
    for front in _fronts_near(prepared, point):
        if not _may_be_open(Leaf.of(front), frame, prepared.scene):
            continue
        leaf, motion = find_motion(Leaf.of(front), prepared.scene)
        if motion is None or motion.movement(leaf.outward) != "out" or not is_open(motion, frame_index):
            continue
        if motion.state_in(frame_index) + leaf.world_from_front.inverse.apply(point)[1] > 0:
            return Carrier(front=front, motion=motion)
    return None


def _may_be_open(leaf: Leaf, frame: Frame, scene: Scene) -> bool:
    """Whether a frame shows little of a leaf's closed face where that would be in view."""
    agrees, through, hidden, _ = closed_counts(leaf, [frame], scene)[0]
    return bool(agrees < tuned(TrackParams).vacated_share * (agrees + through + hidden))


def _fronts_near(prepared: PreparedCapture, point: Vector3) -> Iterator[Rectangle3]:
    """Closed fronts of the size of drawers' that may be of a drawer with a point in it."""
    for region in prepared.planes:
        run = prepared.run_of(region) if in_drawer(region.bounds, point[None])[0] else None
        if run is None:
            continue
        for cell in run.cells:
            panel = Front(run, cell, None, 0.0).rectangle
            fits = _DRAWER.width.allows(panel.width_m) and _DRAWER.height.allows(panel.height_m)
            if not (fits and in_drawer(panel, point[None])[0]):
                continue
            front = find_front(run, panel.centre[None], NOWHERE, pair=False, kind=_DRAWER)
            if front is not None:
                yield front.rectangle
