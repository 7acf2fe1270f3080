"""Chairs and tables are segmented completely, down to the floor, without the objects on a table."""

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.stage import open_session
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import CHAIR, TABLE, click_on, dining, prompt

Scene = tuple[Capture, Truth, GeometricSession]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    capture, truth = dining()
    opened = open_session(capture, tmp_path_factory.mktemp("dining"))
    assert isinstance(opened, GeometricSession)
    return capture, truth, opened


@pytest.mark.parametrize(
    ("name", "where", "corners"),
    [("table", (0.4, 0.1, 0.73), TABLE), ("chair", (0.26, -0.65, 0.45), CHAIR)],
)
def test_chairs_and_tables_are_segmented_down_to_all_their_legs(
    room: Scene, name: str, where: tuple[float, float, float], corners: tuple[tuple[float, ...], tuple[float, ...]]
) -> None:
    capture, truth, session = room
    clicked = prompt(name, name, click_on(capture, where, 120))
    found = session.find(clicked)
    box = found.box()
    assert box is not None
    low, high = np.array(corners)
    extents = sorted(box.dimensions_m[:2])
    np.testing.assert_allclose(extents, sorted((high - low)[:2]), atol=0.025)  # a voxel
    assert box.support_z_m == pytest.approx(0.0, abs=0.01)
    assert box.dimensions_m[2] == pytest.approx(high[2], abs=0.02)
    mask = np.stack([session.mask_at(clicked, f.index) for f in capture.frames])
    overlap = [mask_iou(own, truth[name][f.index]) for own, f in zip(mask, capture.frames, strict=True)]
    assert np.mean(overlap) > 0.88
    legs = np.stack([truth[name][f.index] & _below(capture, f.index, 0.35) for f in capture.frames])
    assert (mask & legs).sum() > 0.7 * legs.sum()


def test_a_table_mask_excludes_the_objects_on_it(room: Scene) -> None:
    capture, truth, session = room
    table = prompt("table", "table", click_on(capture, (0.4, 0.1, 0.73), 120))
    masks = np.stack([session.mask_at(table, f.index) for f in capture.frames])
    carton = np.stack([truth["carton"][f.index] for f in capture.frames])
    chair = np.stack([truth["chair"][f.index] for f in capture.frames])
    assert (masks & carton).sum() < 0.15 * carton.sum()
    assert (masks & chair).sum() < 0.15 * chair.sum()


def _below(capture: Capture, frame_index: int, height_m: float) -> np.ndarray:
    """The pixels whose depth is below a height."""
    frame = capture.frame(frame_index)
    camera = frame.rgb_camera
    depth = np.kron(capture.images.depth(frame_index).metres, np.ones((2, 2)))
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], axis=-1)
    up = frame.world_from_camera.rotation[2]
    return np.asarray((rays @ up) * depth + frame.world_from_camera.translation[2] < height_m)
