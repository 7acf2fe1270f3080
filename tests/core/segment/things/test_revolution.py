"""A bottle before a wall with a dark patch of its colours: axis, width and height, from clicks on its body and its neck."""

import dataclasses
from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.camera import pixel_centres, pixel_rays
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture, Depth
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.stage import open_session
from r2c2r_core.segment.things.pixel_cut import ColourModel
from r2c2r_core.segment.things.profile import Colours, best_profile, profile_evidence
from r2c2r_core.segment.things.revolution import Sight, find_round
from r2c2r_core.segment.things.strips import Grid, Strips
from r2c2r_core.segment.things.thing import sized_as
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import BOTTLE, BOTTLE_PROFILE, CAP_M, WORKTOP_M, bottle, click_on, prompt

ON_BODY = (BOTTLE[0], BOTTLE[1] - BOTTLE_PROFILE[0][0], 1.0)
ON_NECK = (BOTTLE[0], BOTTLE[1] - BOTTLE_PROFILE[-1][0], WORKTOP_M + 0.195)
FRAME = 70


@dataclass(frozen=True)
class WithoutNeck:
    """The same images, with depth holes where the bottle is thin, and in one frame the depth of the wall behind."""

    capture: Capture
    masks: dict[int, np.ndarray]

    def rgb(self, frame_index: int) -> np.ndarray:
        return self.capture.images.rgb(frame_index)

    def depth(self, frame_index: int) -> Depth:
        frame, depth = self.capture.frame(frame_index), self.capture.images.depth(frame_index)
        camera, pose = frame.depth_camera, frame.world_from_camera
        rays = pixel_rays(pixel_centres(camera), camera) @ pose.rotation.T
        height = (pose.translation + rays * depth.metres[..., None])[..., 2]
        near = cv2.dilate(self.masks[frame_index].astype(np.uint8), np.ones((5, 5), np.uint8))[::2, ::2] > 0
        above = height - WORKTOP_M
        thin = near & (above > BOTTLE_PROFILE[1][1] + 0.01) & (above < BOTTLE_PROFILE[-1][1] - 0.005)
        wall = -pose.translation[1] / rays[..., 1] if frame_index == FRAME else 0.0
        metres = np.where(thin, wall, depth.metres).astype(np.float32)
        return Depth(metres, metres > 0)


@pytest.fixture(scope="module")
def scan() -> tuple[Capture, Truth]:
    capture, truth = bottle()
    return dataclasses.replace(capture, images=WithoutNeck(capture, truth["bottle"])), truth


@pytest.fixture(scope="module")
def opened(scan: tuple[Capture, Truth], tmp_path_factory: pytest.TempPathFactory) -> GeometricSession:
    session = open_session(scan[0], tmp_path_factory.mktemp("bottle"))
    assert isinstance(session, GeometricSession)
    return session


@pytest.mark.parametrize("point", [ON_BODY, pytest.param(ON_NECK, marks=pytest.mark.slow)], ids=["body", "neck"])
def test_a_bottle_is_measured_to_its_cap_from_any_click(
    opened: GeometricSession, scan: tuple[Capture, Truth], point: tuple[float, float, float]
) -> None:
    click = click_on(scan[0], point, FRAME)
    hit = opened.scene.pick(click.frame, click.x, click.y)
    assert hit is not None
    assert (hit[1] > -0.05) == (point is ON_NECK)  # on the wall behind it
    found = opened.find(prompt("bottle", "bottle", click))
    box = found.box()
    assert box is not None
    true = np.array([2 * BOTTLE_PROFILE[0][0]] * 2 + [CAP_M])
    np.testing.assert_allclose(box.dimensions_m, true, rtol=0.04)
    np.testing.assert_allclose(box.world_from_object.translation[:2], BOTTLE, atol=0.004)  # half a pixel is 1.5 mm
    overlaps = [mask_iou(found.see(scan[0].frame(k)).mask, mask) for k, mask in scan[1]["bottle"].items()]
    assert min(overlaps) > 0.9


@pytest.mark.parametrize(("beside_m", "taken"), [(0.0, False), (0.06, True)])
def test_a_round_body_with_a_negative_click_is_rejected(
    opened: GeometricSession, scan: tuple[Capture, Truth], beside_m: float, taken: bool
) -> None:
    def sight(x: float, y: float, z: float) -> Sight:
        click = click_on(scan[0], (x, y, z), FRAME)
        return Sight(*opened.scene.ray(click.frame, click.x, click.y))

    x, y, z = ON_BODY
    config, walls = sized_as(category_of("bottle")), tuple(plane for plane in opened.planes if plane.area_m2 > 0.4)
    found = find_round(opened.scene, [sight(*ON_BODY)], [sight(x + beside_m, y, z - 0.05)], np.array(ON_BODY), config, walls)
    assert (found is not None) == taken


def test_a_neck_is_detected_by_its_consistent_colour_in_all_views() -> None:
    """Neither depth nor colour models give evidence here."""
    views, levels, cells, radius = 12, 20, 24, 8
    rng = np.random.default_rng(0)
    lab = rng.integers(40, 220, (views, levels, 2 * cells, 3), dtype=np.uint8)  # a background that differs in every view
    neck = (slice(None), slice(0, 15), slice(cells - radius, cells + radius))
    lab[neck] = 90 + rng.integers(0, 6, lab[neck].shape)
    nothing = np.zeros(lab.shape[:3])
    unknown = ColourModel(np.zeros((16, 32, 32), np.float32))
    strips = Strips(lab, nothing, nothing > 0, nothing > 0)
    odds, _, _ = profile_evidence(strips, Colours(unknown, unknown, unknown))
    assert (odds[:15, :radius] > 0.5).all()
    assert (odds[:, radius:] < 0).all()
    assert (odds[15:] < 0).all()


def test_the_profile_stops_at_edges_despite_similar_colours_beyond() -> None:
    """A dark wall beside the body has the same colours; the true border is an edge in all views."""
    levels, cells, radius, top = 40, 24, 10, 30
    odds = np.full((levels, cells), -2.0)
    odds[:top, :radius] = 2.0
    odds[:15, radius:18] = 0.8  # similar surface beside its base
    across, along = np.full((levels, cells), 1.0), np.full((levels, cells), 1.0)
    across[:top, radius] = 15.0
    along[top, :radius] = 15.0
    profile = best_profile(odds, across, along)
    np.testing.assert_array_equal(profile.cells, np.where(np.arange(levels) < top, radius, 0))


def test_the_profile_ends_at_its_first_empty_level() -> None:
    levels, cells = 30, 12
    odds = np.full((levels, cells), -2.0)
    odds[:10, :6] = 2.0
    odds[20:29, :6] = 2.0  # something in the air: a handle of the cabinet above
    across, along = np.ones((levels, cells)), np.ones((levels, cells))
    across[:, 6] = along[10] = along[20] = along[29] = 15.0
    profile = best_profile(odds, across, along)
    assert (profile.cells[:10] == 6).all()
    assert (profile.cells[10:] == 0).all()


def test_a_profile_grows_and_shrinks_by_a_metric_offset() -> None:
    grid = Grid(0.002, 0.004, 20, 30)
    cells = np.where(np.arange(30) < 20, 10, 0)
    assert grid.within(cells, 0.004).sum(axis=1).max() == 24
    assert grid.within(cells, -0.004).sum(axis=1).max() == 16
    assert np.flatnonzero(grid.within(cells, 0.004).any(axis=1)).max() == 20
