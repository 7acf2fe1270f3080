"""Chairs and tables: their boxes overlap where a seat is under a top."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import ConvexPiece, SceneObject
from r2c2r_core.synthesize.parting import moved_apart
from tests.core.export.kitchen import bottle

Part = tuple[tuple[float, float, float], tuple[float, float, float]]  # centre and size
TABLE: tuple[Part, ...] = (
    ((0, 0, 0.72), (1.2, 0.8, 0.04)),
    *(((x, y, 0.35), (0.06, 0.06, 0.7)) for x in (-0.5, 0.5) for y in (-0.3, 0.3)),
)
CHAIR: tuple[Part, ...] = (((0, 0, 0.45), (0.4, 0.4, 0.04)), ((0, -0.19, 0.65), (0.4, 0.02, 0.4)))


def free(name: str, parts: tuple[Part, ...], at: tuple[float, float, float], mass_kg: float) -> SceneObject:
    pieces = tuple(ConvexPiece(name=f"p{k}", vertices_link=box_corners(np.array(s)) + c) for k, (c, s) in enumerate(parts))
    item = bottle(name)
    link = replace(item.links[0], object_from_link=Rigid3(), boxes=(), pieces=pieces)
    link = replace(link, inertial=replace(link.inertial, mass_kg=mass_kg))
    return replace(item, links=(link,), world_from_object=Rigid3(np.eye(3), np.array(at, dtype=float)))


def test_a_chair_under_a_table_stays_there() -> None:
    items = [free("table", TABLE, (0, 0, 0), 30.0), free("chair", CHAIR, (0, -0.3, 0), 5.0)]
    assert [item.world_from_object.translation.tolist() for item in moved_apart(items, frozenset())] == [
        [0, 0, 0],
        [0, -0.3, 0],
    ]


def test_a_chair_whose_back_is_in_the_top_is_moved_out_by_the_overlap() -> None:
    items = [free("table", TABLE, (0, 0, 0), 30.0), free("chair", CHAIR, (0, -0.17, 0), 5.0)]
    table, chair = moved_apart(items, frozenset())
    assert table is items[0]
    np.testing.assert_allclose(chair.world_from_object.translation, [0, -0.222, 0], atol=1e-3)  # 2 mm apart
    np.testing.assert_allclose(chair.final_from_placed.translation, [0, -0.052, 0], atol=1e-3)
    assert ["moved by 52 mm out of table" in warning for warning in chair.warnings][-1]


def test_what_a_person_placed_stays_and_the_other_is_moved() -> None:
    items = [free("table", TABLE, (0, 0, 0), 30.0), free("chair", CHAIR, (0, -0.17, 0), 5.0)]
    table, chair = moved_apart(items, frozenset(["chair"]))
    assert chair is items[1]
    np.testing.assert_allclose(table.world_from_object.translation, [0, 0.052, 0], atol=1e-3)
    assert moved_apart(items, frozenset(["chair", "table"])) == items


def test_a_mug_near_the_edge_that_has_sunk_into_the_top_stays_on_the_table() -> None:
    mug: tuple[Part, ...] = (((0, 0, 0.05), (0.08, 0.08, 0.1)),)
    items = [free("table", TABLE, (0, 0, 0), 30.0), free("mug", mug, (0.5, 0.3, 0.73), 0.3)]  # its top is at 0.74
    assert moved_apart(items, frozenset())[1].world_from_object.translation == pytest.approx([0.5, 0.3, 0.73])


def test_one_thing_inside_another_stays_where_it_was_measured() -> None:
    solid: tuple[Part, ...] = (((0, 0, 0.4), (0.8, 0.8, 0.8)),)
    items = [free("sofa", solid, (0, 0, 0), 30.0), free("chair", CHAIR, (0, 0, 0), 5.0)]
    assert moved_apart(items, frozenset())[1].world_from_object.translation == pytest.approx([0, 0, 0])
