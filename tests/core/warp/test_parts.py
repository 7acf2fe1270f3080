"""Division of a mesh into fronts and a hollow carcass by the roles of the primitive's boards, whatever their names."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.meshes import box_mesh, is_watertight, volume
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.scene import Box, SceneObject
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.warp.parts import cavity, cut_apart, front_region
from r2c2r_core.warp.solids import with_plain_colours
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit

WALL_M, FRONT_M = 0.015, 0.018  # a cabinet's boards


def unit(category: str, size: tuple[float, float, float] = (0.6, 0.58, 0.7)) -> SceneObject:
    made = placed_unit(Unit("a", category, (0.0, 0.0, 0.5), size), np.random.default_rng(0))
    return build_scene(capture(), *([m] for m in made), Overrides(objects={}), SynthesizeConfig()).objects[0]


def renamed(item: SceneObject) -> SceneObject:
    """The same unit with renamed boards."""
    called = {"back": "rear", "left": "port", "front": "leaf", "top": "lid"}

    def other(box: Box) -> Box:
        return replace(box, name=called.get(box.name, f"piece_of_{box.name}"))

    return replace(item, links=tuple(replace(link, boxes=tuple(other(b) for b in link.boxes)) for link in item.links))


def cut(item: SceneObject) -> dict[str, TexturedMesh]:
    """A closed box of the unit's size, divided like the unit."""
    vertices, faces = box_mesh(-item.dimensions_m / 2, item.dimensions_m / 2)
    mesh = TexturedMesh(
        vertices=vertices, faces=faces, uv=np.full((len(vertices), 2), 0.5), texture=np.full((8, 8, 3), 90, np.uint8)
    )
    return cut_apart(item, *with_plain_colours(mesh, (220, 220, 220), (90, 90, 90)))


@pytest.mark.parametrize("category", ["cabinet", "drawer", "double_door_cabinet", "drawer_stack", "fridge_freezer"])
def test_renaming_boards_does_not_change_the_cut(category: str) -> None:
    item = unit(category)
    named, other = cut(item), cut(renamed(item))
    assert named.keys() == other.keys()
    for link, mesh in named.items():
        assert volume(other[link].vertices, other[link].faces) == pytest.approx(volume(mesh.vertices, mesh.faces), rel=1e-9)
        np.testing.assert_allclose(np.ptp(other[link].vertices, axis=0), np.ptp(mesh.vertices, axis=0), atol=1e-9)


def test_the_cavity_lies_between_the_boards() -> None:
    item = unit("cabinet")
    x, y, z = item.dimensions_m / 2
    low, high = cavity(item)
    np.testing.assert_allclose(high, [x - WALL_M, y - WALL_M, z - WALL_M], atol=1e-9)
    np.testing.assert_allclose(low[[0, 2]], [WALL_M - x, WALL_M - z], atol=1e-9)
    assert low[1] == pytest.approx(-y + FRONT_M, abs=1e-9)  # directly behind the door


@pytest.mark.parametrize("axis_sign", [(0, -1), (0, 1), (1, 1), (2, -1), (2, 1)])
def test_a_body_without_an_outer_board_has_no_cavity(axis_sign: tuple[int, int]) -> None:
    item = unit("cabinet")
    axis, sign = axis_sign
    base = item.links[0]
    kept = [
        box
        for box in base.boxes
        if int(np.argmin(box.size_m)) != axis or sign * box.link_from_box.translation[axis] < item.dimensions_m[axis] / 4
    ]
    assert len(kept) < len(base.boxes)
    low, high = cavity(replace(item, links=(replace(base, boxes=tuple(kept)), *item.links[1:])))
    assert (low > high).all()


def test_a_solid_slab_has_no_cavity() -> None:
    low, high = cavity(unit("counter", (1.2, 0.6, 0.04)))
    assert (low > high).any()


def test_door_and_hollow_body_do_not_overlap() -> None:
    item = unit("cabinet")
    base, door = (cut(item)[link.name] for link in item.links)
    assert door.vertices[:, 1].max() < base.vertices[:, 1].min() + 1e-9
    whole = float(np.prod(item.dimensions_m))
    assert is_watertight(door.vertices, door.faces)
    assert volume(door.vertices, door.faces) == pytest.approx(0.6 * 0.7 * FRONT_M, rel=1e-6)
    low, high = cavity(item)
    boards = whole - float(np.prod(high - low))
    assert 0 < volume(base.vertices, base.faces) < boards + 0.004  # and its shelf


def test_front_regions_reach_the_unit_edge_and_stop_at_the_seam() -> None:
    item = unit("double_door_cabinet")
    left, right = (front_region(item, link) for link in item.links[1:])
    assert left.low[0] < -1 < 1 < right.high[0]  # the mesh's own edge, wherever it ends
    assert right.low[0] - left.high[0] == pytest.approx(0.003, abs=1e-9)
    assert left.low[1] < -1  # the handle, however far it protrudes
    assert left.high[1] == pytest.approx(-item.dimensions_m[1] / 2 + FRONT_M, abs=1e-9)


def test_the_body_of_a_sliding_leaf_stays_clear_of_the_other_track() -> None:
    """The rear leaf is 26 mm behind the front one: a body filling the whole box would block the rear leaf's track."""
    front = Unit("front", "sliding_door", (0.0, 0.0, 0.5), (0.6, 0.58, 0.7))
    rear = Unit("rear", "sliding_door", (0.58, 0.013, 0.5), (0.56, 0.554, 0.7), handle=Handle(0.2, 0.0, out=0.035))
    made = zip(*(placed_unit(each, np.random.default_rng(0)) for each in (front, rear)), strict=True)
    items = {item.name: item for item in build_scene(capture(), *made, Overrides(objects={}), SynthesizeConfig()).objects}
    visuals = {name: cut(items[name]) for name in ("front", "rear")}
    track_back = -0.29 + 0.026 + FRONT_M
    assert visuals["front"]["front_base"].vertices[:, 1].min() > track_back
    body = visuals["front"]["front_base"].vertices[:, 0].max(), visuals["rear"]["rear_base"].vertices[:, 0].min()
    assert body[0] < body[1] + items["rear"].world_from_object.translation[0] - items["front"].world_from_object.translation[0]
    # the front leaf passes 8 mm before the rear one, handle and all
    assert front_region(items["rear"], items["rear"].links[1]).low[1] > -items["rear"].dimensions_m[1] / 2 - 0.008
    low, high = cavity(items["front"])
    assert (high - low > 0.4).all()
