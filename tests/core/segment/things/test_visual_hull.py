"""Visual hull and silhouettes of a small thing, and its support, in a kitchen of boxes with a known carton."""

import dataclasses

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things import visual_hull
from r2c2r_core.segment.things.silhouettes import small_mask, usual_shift
from r2c2r_core.segment.things.support import support_offset
from r2c2r_core.segment.things.thing import Thing, ThingConfig, find_thing, sized_as, support_height, thing_mask
from r2c2r_core.segment.things.visual_hull import find_small, glimpse_small
from tests.core.segment.conftest import Truth

LOW, HIGH = np.array([1.0, -0.36, 0.90]), np.array([1.12, -0.26, 1.10])  # the carton
ON_IT = np.array([[1.06, -0.36, 1.0]])
NO_POINTS = np.zeros((0, 3))
CARTON = ThingConfig(radius_m=0.12)
Boxes = tuple[Capture, Truth]


@pytest.fixture(scope="module")
def scene(session: GeometricSession) -> Scene:
    return session.scene


@pytest.fixture(scope="module")
def hull(scene: Scene) -> Thing:
    found = find_small(scene, ON_IT, NO_POINTS, CARTON, ())
    assert found is not None
    return found


def test_the_hull_matches_the_carton_and_stands_on_the_worktop(hull: Thing) -> None:
    low, high = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
    np.testing.assert_allclose(low[[0, 2]], LOW[[0, 2]], atol=0.012)
    np.testing.assert_allclose(high[[0, 2]], HIGH[[0, 2]], atol=0.012)
    assert low[1] == pytest.approx(LOW[1], abs=0.03)  # carving keeps 22 mm before coarse depth
    assert high[1] < LOW[1] + 1.5 * (HIGH[0] - LOW[0])  # no camera sees its back: no deeper than wide, plus the slack
    assert hull.support_z_m == pytest.approx(0.90, abs=0.005)


def test_hull_silhouettes_match_the_carton_masks(hull: Thing, scene: Scene, boxes: Boxes) -> None:
    truth = boxes[1]["carton"]
    overlaps = []
    for frame in scene.frames:
        mask, share = small_mask(hull, scene, frame)
        assert 0.0 <= share <= 1.0
        if truth[frame.index].sum() > 300:
            overlaps.append(mask_iou(mask, truth[frame.index]))
    assert len(overlaps) > 5
    assert np.mean(overlaps) > 0.9


def test_the_glimpse_agrees_with_the_hull(hull: Thing, scene: Scene) -> None:
    glimpsed = glimpse_small(scene, ON_IT, NO_POINTS, CARTON, ())
    assert glimpsed is not None
    np.testing.assert_allclose(glimpsed.vertices.mean(axis=0)[[0, 2]], hull.vertices.mean(axis=0)[[0, 2]], atol=0.02)


def test_a_click_in_empty_space_gives_no_hull(scene: Scene) -> None:
    in_the_air = np.array([[1.06, -0.80, 1.5]])
    assert find_small(scene, in_the_air, NO_POINTS, CARTON, ()) is None


@pytest.mark.parametrize("lift_m", [-0.02, -0.01, 0.0, 0.01, 0.02])
def test_the_height_error_of_a_frame_pose_is_measured(scene: Scene, lift_m: float) -> None:
    frame = scene.frame(70)
    lifted = dataclasses.replace(frame, world_from_camera=Rigid3(np.eye(3), np.array([0, 0, lift_m])) @ frame.world_from_camera)
    offset = support_offset(scene, lifted, 0.90, np.array([1.06, -0.31, 1.0]))
    assert offset == pytest.approx(lift_m, abs=0.003)


def test_pose_errors_shift_outlines_off_the_colour_edges(hull: Thing, scene: Scene) -> None:
    views = [frame for frame in scene.frames if 40 <= frame.index <= 100]
    assert usual_shift(hull, scene, views) < 0.004

    def aside(frame: Frame) -> Frame:
        return dataclasses.replace(
            frame, world_from_camera=Rigid3(np.eye(3), np.array([0.012, 0, 0])) @ frame.world_from_camera
        )

    assert usual_shift(hull, scene, [aside(frame) for frame in views]) > 0.007


def test_a_thing_stands_on_the_level_surface_below_it_or_on_the_floor(scene: Scene) -> None:
    assert support_height(scene, ON_IT, CARTON) == pytest.approx(0.90, abs=0.005)
    assert support_height(scene, np.add(ON_IT, [0.0, 0.05, 0.08]), CARTON) == pytest.approx(0.90, abs=0.005)
    assert support_height(scene, ON_IT, dataclasses.replace(CARTON, on_floor=True)) == 0.0
    below_the_floor = np.array([[1.06, -0.36, -0.5]])
    assert support_height(scene, below_the_floor, CARTON) is None


def test_a_shelf_or_worktop_hangs_and_stands_on_nothing_below(scene: Scene) -> None:
    for name in ("shelf", "worktop", "hood"):
        assert support_height(scene, ON_IT, sized_as(category_of(name))) is None


def test_the_surface_and_mask_found_are_those_of_the_carton(scene: Scene, boxes: Boxes) -> None:
    thing = find_thing(scene, ON_IT, NO_POINTS, CARTON)
    assert thing is not None
    slack = 0.02  # the fused surface has voxels of 12 mm
    assert (thing.vertices > LOW - slack).all()
    assert (thing.vertices < HIGH + slack).all()
    mask, share = thing_mask(thing, scene, scene.frame(70), refine=False)
    assert mask_iou(mask, boxes[1]["carton"][70]) > 0.8
    assert share > 0.8


def test_clicks_far_from_any_surface_give_no_thing(scene: Scene) -> None:
    assert find_thing(scene, np.array([[0.9, -1.6, 1.9]]), NO_POINTS, CARTON) is None


def test_noisier_depth_carves_less(scene: Scene, hull: Thing) -> None:
    """The face of the carton is carved to within the depth noise; with noisier depth, more volume remains before it."""
    noise = DepthNoise(floor_m=0.02, per_m=0.02)
    noisy = dataclasses.replace(scene, capture=dataclasses.replace(scene.capture, depth_noise=noise))
    loose = glimpse_small(noisy, ON_IT, NO_POINTS, CARTON, ())
    fine = glimpse_small(scene, ON_IT, NO_POINTS, CARTON, ())
    assert loose is not None
    assert fine is not None
    assert len(loose.vertices) > 0
    assert np.ptp(loose.vertices, axis=0).prod() > 1.1 * np.ptp(fine.vertices, axis=0).prod()


def test_a_pose_error_is_tolerated_by_wide_but_not_by_narrow_things(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(visual_hull, "_pose_spread", lambda *given: 0.008)
    monkeypatch.setattr(visual_hull, "usual_shift", lambda *given: 0.0)
    wide, narrow = (find_small(scene, ON_IT, NO_POINTS, ThingConfig(radius_m=radius), ()) for radius in (0.12, 0.08))
    assert wide is not None
    assert narrow is not None
    assert wide.pose_error_m < 0.03  # carved
    assert narrow.pose_error_m > 0.03  # searched for frame by frame
