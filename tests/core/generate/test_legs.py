"""A chair's seat and legs, those that depth shows and those that something hid."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.generate.carved import carve
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.hulls import carved_family
from r2c2r_core.generate.legs import find_support, stands_on_legs
from r2c2r_core.generate.standing import stands
from r2c2r_core.generate.variation import whole_pool
from r2c2r_core.geometry.meshes import box_mesh, is_manifold, is_watertight, unite

LEGS = {(x, y) for x in (-0.1875, 0.1875) for y in (-0.1875, 0.1875)}  # middles, in the frame of the chair's box


@pytest.fixture(scope="module")
def everything(chair_scene):
    return whole_pool(gather_evidence(*chair_scene, 10))


@pytest.fixture(scope="module")
def carving(chair_scene, everything):
    return carve(gather_evidence(*chair_scene, 10), everything)


def nearest_leg(post):
    return min(LEGS, key=lambda leg: np.hypot(*(post.top[:2] - leg)))


def test_the_seat_and_the_legs_that_depth_shows_are_where_they_are(carving, everything):
    """Seat 0.42 m square with its top at 0.48 m; legs 4.5 cm thick."""
    support = find_support(carving, everything.views)
    assert support.slab.high[2] + 0.45 == pytest.approx(0.48, abs=0.01)
    assert support.slab.high[:2] - support.slab.low[:2] == pytest.approx([0.42, 0.42], abs=0.015)
    assert {nearest_leg(post) for post in support.posts} == LEGS
    for post in support.posts:
        assert post.is_seen
        assert post.top[:2] == pytest.approx(nearest_leg(post), abs=0.008)
        assert post.lean == pytest.approx([0.0, 0.0], abs=0.03)
        assert post.width_m == pytest.approx(0.045, abs=0.008)


def test_a_leg_that_nobody_saw_is_the_mirror_image_of_one_that_was_seen(carving, everything):
    local_from_world = carving.seen.world_from_local.inverse
    hidden = [replace(view, depth_m=without(view, local_from_world, lambda p: p[:, 0] > 0.05)) for view in everything.views]
    support = find_support(carving, hidden)
    assert {nearest_leg(post) for post in support.posts if not post.is_seen} == {leg for leg in LEGS if leg[0] > 0}
    for post in support.posts:
        assert post.top[:2] == pytest.approx(nearest_leg(post), abs=0.01)


def test_where_a_corner_is_seen_to_be_empty_there_are_no_four_legs(carving, everything):
    """No view shows any post, and free space was seen through all four corners."""
    empty = carving._replace(votes=carving.votes._replace(free_m=np.full_like(carving.votes.free_m, 0.05)))
    blind = [replace(view, depth_m=np.zeros_like(view.depth_m)) for view in everything.views]
    assert find_support(empty, blind) is None


def test_a_chair_on_legs_is_one_closed_solid_that_says_what_is_inferred(chair_scene, everything):
    evidence = gather_evidence(*chair_scene, 10)
    first = carved_family(evidence, everything, is_round=False)[0]
    assert "legs" in first.assumes
    shape = first.shape(everything)
    assert is_watertight(shape.vertices_local, shape.faces)
    assert is_manifold(shape.vertices_local, shape.faces)
    assert (shape.parameters["legs"], shape.parameters["legs_inferred"], shape.warnings) == (4.0, 0.0, ())
    assert len(shape.faces) <= 20_000


def test_names_say_what_stands_on_legs():
    assert all(stands_on_legs(name) for name in ("chair", "kitchen_table", "bar stools"))
    assert not any(stands_on_legs(name) for name in ("bottle", "tablet", "cabinet"))


def test_a_slab_on_one_leg_at_its_corner_falls_over():
    slab = box_mesh(np.array([0.0, 0.0, 0.4]), np.array([0.4, 0.4, 0.45]))
    legs = [box_mesh(np.array([x, x, 0.0]), np.array([x + 0.05, x + 0.05, 0.41])) for x in (0.0, 0.35)]
    assert not stands(*unite([slab, legs[0]]))
    assert stands(*unite([slab, *legs]))


def without(view, local_from_world, chosen):
    """The view's depth without the pixels whose point is chosen (local frame)."""
    from r2c2r_core.geometry.camera import depth_points

    points = (local_from_world @ view.world_from_camera).apply(depth_points(view.depth_m, view.depth_camera).reshape(-1, 3))
    return np.where(chosen(points).reshape(view.depth_m.shape), 0.0, view.depth_m).astype(np.float32)
