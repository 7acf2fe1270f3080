"""Chairs and tables are segmented completely, down to the floor, without the objects on a table."""

import numpy as np
import pytest

from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.stage import open_session
from r2c2r_core.segment.things.slab import arm_at
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import CHAIR, TABLE, WIDTH, click_on, dining, prompt

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


def test_what_hangs_is_not_drawn_down_to_the_floor(room: Scene) -> None:
    capture, _, session = room
    box = session.find(prompt("lamp", "box", click_on(capture, (0.42, 1.0, 0.97), 40))).box()
    assert box is not None
    assert box.support_z_m == pytest.approx(0.9, abs=0.03)
    assert box.dimensions_m[2] == pytest.approx(0.15, abs=0.04)


@pytest.mark.parametrize("category", ["cabinet", "drawer"])
def test_a_level_surface_is_no_front(room: Scene, category: str) -> None:
    capture, _, session = room
    with pytest.raises(ObjectNotSeen, match="front: the click is on a level surface, which is no front"):
        session.find(prompt("front", category, click_on(capture, (0.4, 0.1, 0.73), 120)))


def test_a_box_clicked_as_a_worktop_is_not_found(room: Scene) -> None:
    capture, _, session = room
    with pytest.raises(ObjectNotSeen, match="top: no separate surface under 1 click"):
        session.find(prompt("top", "worktop", click_on(capture, (0.42, 1.0, 0.97), 40)))


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Rigid3]:
    """The room in a world whose up is 2.5 degrees off: the table's ends differ by 5 cm."""
    slope = np.deg2rad(2.5)
    turn = np.array([[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]])
    world_from_scene = Rigid3(turn, np.zeros(3))
    capture, truth = dining(world_from_scene)
    opened = open_session(capture, tmp_path_factory.mktemp("tilted"))
    assert isinstance(opened, GeometricSession)
    return (capture, truth, opened), world_from_scene


def test_a_worktop_is_the_level_slab_without_what_stands_on_it(tilted: tuple[Scene, Rigid3]) -> None:
    (capture, truth, session), world_from_scene = tilted
    place = world_from_scene.apply(np.array([0.4, 0.1, 0.73]))
    top = prompt("top", "worktop", click_on(capture, tuple(place), 120))
    box = session.find(top).box()
    assert box is not None
    width, depth, height = box.dimensions_m
    np.testing.assert_allclose(sorted((width, depth)), (0.7, 1.2), atol=0.03)  # a voxel of 25 mm
    assert height == pytest.approx(0.04, abs=0.015)
    assert box.support_z_m == pytest.approx(0.69, abs=0.01)
    mask = np.stack([session.mask_at(top, f.index) for f in capture.frames])
    for name in ("carton", "chair"):
        own = np.stack([truth[name][f.index] for f in capture.frames])
        assert (mask & own).sum() < 0.08 * own.sum()
    upper = np.stack([truth["table"][f.index] & ~_below(capture, f.index, 0.55) for f in capture.frames])
    assert mask_iou(mask.reshape(-1, WIDTH), upper.reshape(-1, WIDTH)) > 0.85


def test_the_mask_of_a_table_follows_its_top_where_up_is_off(tilted: tuple[Scene, Rigid3]) -> None:
    (capture, truth, session), world_from_scene = tilted
    place = world_from_scene.apply(np.array([0.4, 0.1, 0.73]))
    table = prompt("table", "table", click_on(capture, tuple(place), 120))
    box = session.find(table).box()
    assert box is not None
    assert box.dimensions_m[2] == pytest.approx(0.73, abs=0.02)
    overlaps = [mask_iou(session.mask_at(table, f.index), truth["table"][f.index]) for f in capture.frames]
    assert np.mean(overlaps) > 0.85


def test_one_arm_of_an_l_is_the_rectangle_about_the_click() -> None:
    plan = np.zeros((80, 80), bool)
    plan[10:70, 10:34] = True
    plan[10:34, 10:70] = True  # the other arm
    floor = ~plan
    plan[40:62, 10:34] = floor[40:62, 10:34] = False  # a microwave that covers it from wall to front
    arm = arm_at(plan, floor, np.array([1.65, 0.5, 0.9]), np.zeros(3), 0.025, 0.0)
    true = np.zeros_like(plan)
    true[10:70, 10:34] = True
    assert mask_iou(arm, true) > 0.9


def _below(capture: Capture, frame_index: int, height_m: float) -> np.ndarray:
    """The pixels whose depth is below a height."""
    frame = capture.frame(frame_index)
    camera = frame.rgb_camera
    depth = np.kron(capture.images.depth(frame_index).metres, np.ones((2, 2)))
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], axis=-1)
    up = frame.world_from_camera.rotation[2]
    return np.asarray((rays @ up) * depth + frame.world_from_camera.translation[2] < height_m)
