import numpy as np

from r2c2r_core.arrays import DepthMetres, Image
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.board import open_mask
from r2c2r_core.segment.motion.leaf import OpenLeaf
from tests.core.segment.motion.boards import CAMERA, LEAF, cast_rays, joint
from tests.core.segment.scenes import look_at

HELD_M = 0.3
HAND = (-0.07, -0.045, -0.07), (0.07, -0.02, 0.07)  # lowest and highest corner, in front of the face: on a handle


class OnePhoto:
    """The part of a scene that a mask needs: a bright front with a dark hand on it."""

    noise = DepthNoise(floor_m=0.004, per_m=0.003)

    def __init__(self, depth: DepthMetres, hand: np.ndarray) -> None:
        self._depth, self._hand = depth, hand

    def depth(self, frame_index: int) -> DepthMetres:
        return self._depth

    filled_depth = depth

    def rgb(self, frame_index: int) -> Image:
        return np.where(self._hand[..., None], np.uint8(40), np.uint8(180)).repeat(3, axis=2)


def test_a_hand_on_a_handle_is_excluded_from_the_mask_of_the_open_front() -> None:
    """The hand protrudes no more than a handle does: depth alone would keep it in the mask."""
    opened = OpenLeaf(leaf=LEAF.at(joint("out").pose(HELD_M)), movement="out", out_m=HELD_M)
    place = opened.leaf.world_from_front
    pose = look_at(place.apply(np.array([0.3, -1.5, 0.4])), place.translation)
    front = (place, (-0.25, 0.0, -0.3), (0.25, 0.018, 0.3))
    alone, both = (cast_rays(solids, pose) for solids in ([front], [front, (place, *HAND)]))
    hand = both != alone
    frame = Frame(index=0, timestamp_s=0.0, rgb_camera=CAMERA, depth_camera=CAMERA, world_from_camera=pose, sharpness=1.0)
    mask, _ = open_mask(opened, OnePhoto(both.astype(np.float32), hand), frame)
    assert mask[hand].mean() < 0.2
    assert mask[(alone > 0) & ~hand].mean() > 0.95
