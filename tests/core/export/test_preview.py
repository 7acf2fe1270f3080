from dataclasses import replace

import cv2
import numpy as np

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.preview import framing, preview_png, scene_soup
from r2c2r_core.geometry.camera import project
from tests.core.export.kitchen import cabinet, kitchen


def picture(seen_from: np.ndarray | None = None) -> np.ndarray:
    encoded = preview_png(plan_bundle(kitchen()), seen_from, 480)
    return cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)[..., ::-1].astype(float)


def test_the_preview_shows_closed_and_open_states_side_by_side() -> None:
    image = picture()
    assert image.shape == (192, 480, 3)
    closed, opened = image[:, :240], image[:, 240:]
    assert np.abs(closed - opened).mean() > 3.0  # grey levels: doors swing, shadows move
    assert closed.std() > 15.0  # not an empty picture


def test_the_preview_shows_the_texture_colours() -> None:
    closed = picture()[:, :240]
    red, green, blue = closed[..., 0], closed[..., 1], closed[..., 2]
    assert ((red > blue + 40) & (red > green + 15)).mean() > 0.04  # wooden fronts
    assert ((green > red + 8) & (green > blue)).mean() > 0.04  # painted doors


def test_a_wide_kitchen_stacks_the_preview_images_vertically() -> None:
    objects = tuple(cabinet(f"c_{k}", x=0.6 * k) for k in range(9))
    plan = plan_bundle(replace(kitchen(), objects=objects))
    image = cv2.imdecode(np.frombuffer(preview_png(plan, None, 480), np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (2 * 154, 360, 3)


def test_the_preview_camera_frames_every_corner() -> None:
    points = scene_soup(plan_bundle(kitchen()), 0.75).corners
    for direction in ([0.3, -1.0, 0.5], [-1.0, -0.2, 0.1], [0.0, -1.0, 1.0]):
        camera, camera_from_world = framing(points, np.array(direction), (400, 300))
        uv = project(camera_from_world.apply(points), camera)
        assert (uv > 0).all()
        assert (uv < [400, 300]).all()
        spread = np.ptp(uv, axis=0) / [400, 300]
        assert spread.max() > 0.7  # and it fills the picture


def test_the_preview_faces_the_fronts_without_a_camera_position() -> None:
    np.testing.assert_allclose(picture(None).mean(), picture(np.array([0.1, -2.0, 1.2])).mean(), atol=25)
