"""Fine registration: factors that constrain a pose where the surface does not."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import observe
from r2c2r_core.align.refine import loosest_motion, refine
from r2c2r_core.align.residuals import Anchors
from r2c2r_core.align.shape import prepare_shape
from r2c2r_core.align.sweep import sweep_loosest
from r2c2r_core.geometry.transforms import Similarity3

NOTHING = Anchors(up_mesh=None, up_weight=0.0, front=None, support_z_m=None)
UPRIGHT = Similarity3(1.0, np.eye(3), np.zeros(3))  # the bottle's mesh frame is its true world pose


@pytest.fixture(scope="module")
def bottle(bench: Any) -> Any:
    """A bottle with blotches: its candidate shape, and the observation of it."""
    thing, capture, track = bench.bottle(label=True)
    shape = prepare_shape(thing, point_count=6000, face_limit=6000, rng=np.random.default_rng(0))
    return shape, observe(capture, track, view_count=6, size_px=128, point_count=800)


def turned(angle_deg: float) -> Similarity3:
    """The bottle's pose with a yaw error."""
    return Similarity3(1.0, Rotation.from_euler("z", angle_deg, degrees=True).as_matrix(), np.zeros(3))


def yaw_deg(pose: Similarity3) -> float:
    return float(np.degrees(np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])))


def keypoints(shape: Any, observation: Any, *, wrong: int) -> list[Lifted]:
    """Points of the bottle seen in every view, some of them mismatched."""
    rng = np.random.default_rng(1)
    found = []
    for view in observation.views:
        eye = view.world_from_camera.translation
        facing = np.flatnonzero(((eye - shape.points) * shape.normals).sum(axis=1) > 0.05)
        spots = shape.points[rng.choice(facing, 25, replace=False)]
        mesh = spots.copy()
        mesh[:wrong] = mesh[:wrong][::-1]
        rays = (spots - eye) / np.linalg.norm(spots - eye, axis=1, keepdims=True)
        found.append(Lifted(view.frame_index, mesh, spots, np.full(25, 0.006), rays, np.full(25, 0.001)))
    return found


def test_a_round_surface_leaves_yaw_unconstrained_until_keypoints_fix_it(bottle: Any) -> None:
    shape, observation = bottle
    motion, spread_m = loosest_motion(UPRIGHT, shape, observation, NOTHING, [])
    turn = motion[:3] / np.linalg.norm(motion[:3])
    assert abs(turn[2]) > 0.98
    _, held_m = loosest_motion(UPRIGHT, shape, observation, NOTHING, keypoints(shape, observation, wrong=0))
    assert held_m < 0.3 * spread_m


def test_keypoints_correct_the_yaw_of_a_bottle(bottle: Any) -> None:
    shape, observation = bottle
    settings = {"free_scale": True, "iterations": 10, "loose": 0.06}
    alone = refine(turned(6.0), shape, observation, NOTHING, [], **settings)
    assert abs(yaw_deg(alone)) > 3.0
    held = refine(turned(6.0), shape, observation, NOTHING, keypoints(shape, observation, wrong=8), **settings)
    assert abs(yaw_deg(held)) < 1.0


@pytest.mark.parametrize("angle_deg", [-7.0, 5.0])
def test_colours_determine_the_yaw_of_a_labelled_bottle(bottle: Any, angle_deg: float) -> None:
    shape, observation = bottle
    found = sweep_loosest(turned(angle_deg), shape, observation, NOTHING, [])
    assert abs(yaw_deg(found)) < 2.0  # 1.2 mm at a radius of 35 mm, in views of 3 mm per pixel


def test_a_well_constrained_pose_is_not_swept(bench: Any) -> None:
    thing, capture, track = bench.free_box(textured=True)
    shape = prepare_shape(thing, point_count=4000, face_limit=6000, rng=np.random.default_rng(0))
    observation = observe(capture, track, view_count=6, size_px=128, point_count=800)
    assert sweep_loosest(UPRIGHT, shape, observation, NOTHING, []) is UPRIGHT
