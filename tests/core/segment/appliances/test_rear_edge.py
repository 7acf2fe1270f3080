"""Ends of a rendered appliance's faces, from the depth pixels beyond them."""

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.appliances.rear_edge import _change_point, rear_edge
from r2c2r_core.segment.scene import Scene, prepare_scene
from tests.core.generate.scenes import appliance_scene

BOX = np.array([0.0, -0.23, 0.23, 0.0, 0.34, -0.14, 0.14])
FRONT = Rigid3(np.eye(3), np.array([0.0, 0.0, 1.04]))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return prepare_scene(appliance_scene()[0], tmp_path_factory.mktemp("cache"))


def ends(scene: Scene, box: np.ndarray = BOX) -> np.ndarray:
    return rear_edge(box, category_of("microwave").depth, 0.60, scene.frames, scene, FRONT)


def test_the_rear_edge_is_where_the_wall_shows_past_the_sides(scene: Scene) -> None:
    found = ends(scene)
    assert len(found)
    assert found.mean(axis=1) == pytest.approx(0.34, abs=0.015)


def test_sides_without_depth_past_them_have_no_rear_edge(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    blind = {frame.index: np.zeros_like(scene.depth(frame.index)) for frame in scene.frames}
    monkeypatch.setattr(Scene, "depth", lambda _, frame: blind[frame])
    assert not len(ends(scene))


@pytest.mark.parametrize(("wall_m", "ends"), [(0.30, False), (0.36, True)])
def test_a_side_that_ends_at_the_wall_has_no_rear_edge(wall_m: float, ends: bool) -> None:
    """For a refrigerator against the wall, rays beyond its side hit the wall where the side ends."""
    y = np.arange(-0.2, 0.40, 0.001)
    noise = np.random.default_rng(0).normal(0, 0.002, len(y))
    found = _change_point(y, np.where(y < 0.30, 0.0, wall_m - y) + noise)
    assert (found == pytest.approx((0.295, 0.300), abs=0.011)) if ends else found is None
