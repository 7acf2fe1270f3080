"""Seat and legs of a chair, both legs shown by depth and occluded ones."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from r2c2r_core.generate.bars import find_bars
from r2c2r_core.generate.carved import carve
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.hulls import ON_LEGS, carved_family
from r2c2r_core.generate.legs import find_support
from r2c2r_core.generate.standing import stands
from r2c2r_core.generate.things import thing_hypotheses
from r2c2r_core.generate.variation import whole_pool
from r2c2r_core.geometry.meshes import box_mesh, is_manifold, is_watertight, unite, volume
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from tests.core.generate import scenes

LEGS = {(x, y) for x in (-0.1875, 0.1875) for y in (-0.1875, 0.1875)}  # centres, in the frame of the chair's box


@pytest.fixture(scope="module")
def everything(chair_scene):
    return whole_pool(gather_evidence(*chair_scene, 10))


@pytest.fixture(scope="module")
def carving(chair_scene, everything):
    return carve(gather_evidence(*chair_scene, 10), everything)


def nearest_leg(post):
    return min(LEGS, key=lambda leg: np.hypot(*(post.top[:2] - leg)))


def test_seat_and_legs_seen_in_depth_are_located(carving, everything):
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


@pytest.fixture(scope="module")
def half_seen(carving, everything):
    """The views without the depth of the two legs on the right."""
    local_from_world = carving.seen.world_from_local.inverse

    def on_the_right(points):
        return (points[:, 0] > 0.05) & (points[:, 2] < -0.03)

    hidden = (replace(view, depth_m=without(view, local_from_world, on_the_right)) for view in everything.views)
    return replace(everything, views=tuple(hidden))


def test_unseen_legs_are_mirrored_from_seen_ones(carving, half_seen):
    support = find_support(carving, half_seen.views)
    assert {nearest_leg(post) for post in support.posts if not post.is_seen} == {leg for leg in LEGS if leg[0] > 0}
    for post in support.posts:
        assert post.top[:2] == pytest.approx(nearest_leg(post), abs=0.01)


def test_bars_found_in_depth_are_legs_with_free_space_between(carving, everything):
    found = find_bars(carving, everything.views)
    grid, half = carving.grid, 0.0225

    def distance(point):
        at = ((np.array(point) - grid.low) / grid.voxel_m).astype(int)
        return found.field[tuple(at)]

    assert found.field.shape == grid.shape
    for height in (-0.35, -0.2, -0.1):
        assert distance((0.0, 0.0, height)) > 0.01
        for x, y in LEGS:  # a leg's outer sides are seen, not its centre
            sides = [(x + dx, y + dy, height) for dx, dy in ((half, 0), (-half, 0), (0, half), (0, -half))]
            assert min(distance(side) for side in sides) < 0


def test_legs_missing_from_all_masks_are_found_in_depth(carving, everything):
    """With dark legs before a dark floor, colour segmentation cuts the legs off at the seat; depth does not."""
    local_from_world = carving.seen.world_from_local.inverse

    def on_legs(points):
        return points[:, 2] < -0.05

    def legless(view):
        size = view.mask.shape[1::-1]
        kept = without(view, local_from_world, on_legs) > 0
        return replace(
            view, mask=view.mask & cv2.resize(kept.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
        )

    found = find_bars(carving, [legless(view) for view in everything.views])
    grid = carving.grid
    solid = grid.centres()[found.field.ravel() < 0]
    for height in (-0.35, -0.2, -0.1):
        at_height = solid[np.abs(solid[:, 2] - height) < grid.voxel_m]
        away = [np.hypot(*(at_height[:, :2] - leg).T) for leg in LEGS]
        assert max(distances.min() for distances in away) < 0.03  # each within its own half width and a bar's
        assert np.min(away, axis=0).max() < 0.06  # and nothing between them


def test_a_table_with_legless_masks_gets_its_legs_from_depth():
    """The legs are thick and square, some seen over a corner; without them, the table top would float."""
    evidence = gather_evidence(*scenes.table_scene(), 10)
    views = tuple(legless(view, 0.67) for view in evidence.pool)
    evidence, everything = replace(evidence, pool=views), replace(whole_pool(evidence), views=views)
    found = find_support(carve(evidence, everything), views)
    assert sum(post.is_seen for post in found.posts) >= 2
    assert found.posts[0].width_m == pytest.approx(0.09, abs=0.015)
    likeliest, *others = thing_hypotheses(evidence, everything)
    assert likeliest.assumes == ON_LEGS
    assert not any("board" in other.assumes for other in others)  # which would hang in the air
    world = likeliest.shape(everything).vertices_world
    assert np.ptp(world, axis=0) == pytest.approx([1.2, 0.7, 0.74], abs=0.03)
    assert world[:, 2].min() == pytest.approx(0.0, abs=5e-3)


def test_unseen_legs_are_not_placed_in_observed_free_space(carving, everything):
    """Both right corners are observed to be free; the space further in is unobserved."""
    free = np.where(carving.grid.centres()[:, 0] > 0.15, np.float32(0.05), np.float32(-np.inf))
    local_from_world = carving.seen.world_from_local.inverse
    blind = [
        replace(view, depth_m=without(view, local_from_world, lambda points: points[:, 2] < -0.03)) for view in everything.views
    ]
    found = find_support(carving._replace(votes=carving.votes._replace(free_m=free)), blind)
    assert not any(post.is_seen for post in found.posts)
    x = sorted(post.top[0] for post in found.posts)
    assert max(x[:2]) < -0.17
    assert 0.05 < min(x[2:]) <= max(x[2:]) < 0.16


def test_empty_corners_without_any_seen_leg_give_no_support(carving, everything):
    """No view shows any post, and free space was seen through all four corners."""
    empty = carving._replace(votes=carving.votes._replace(free_m=np.full_like(carving.votes.free_m, 0.05)))
    blind = [replace(view, depth_m=np.zeros_like(view.depth_m)) for view in everything.views]
    assert find_support(empty, blind) is None


@pytest.mark.parametrize("scene", [scenes.storage_bench_scene, scenes.desk_scene])
def test_closed_furniture_gets_no_legs(scene):
    """Near a corner, a closed side seen obliquely is as slender as a post; between the corners it is not."""
    evidence = gather_evidence(*scene(), 10)
    everything = whole_pool(evidence)
    assert category_of(evidence.track.category).on_legs
    assert find_support(carve(evidence, everything), everything.views) is None


def test_a_closed_bench_is_carved_solid_without_unseen_error():
    evidence = gather_evidence(*scenes.storage_bench_scene(), 10)
    everything = whole_pool(evidence)
    family = {guess.assumes: guess for guess in carved_family(evidence, everything, is_round=False)}
    assert not any("legs" in assumes for assumes in family)
    shape = family["carved from free space"].shape(everything)
    assert not shape.unseen_error_m
    true_m3 = 0.8 * 0.4 * 0.45 + 0.8 * 0.04 * 0.4
    assert volume(shape.vertices_local, shape.faces) == pytest.approx(true_m3, rel=0.1)


def test_a_chair_on_legs_is_one_watertight_solid(chair_scene, everything):
    evidence = gather_evidence(*chair_scene, 10)
    first = carved_family(evidence, everything, is_round=False)[0]
    assert "legs" in first.assumes
    shape = first.shape(everything)
    assert is_watertight(shape.vertices_local, shape.faces)
    assert is_manifold(shape.vertices_local, shape.faces)
    assert (shape.parameters["legs"], shape.parameters["legs_inferred"], shape.warnings) == (4.0, 0.0, ())
    assert len(shape.faces) <= 20_000


def test_the_number_of_inferred_legs_is_reported(chair_scene, half_seen):
    evidence = gather_evidence(*chair_scene, 10)
    shape = carved_family(evidence, half_seen, is_round=False)[0].shape(half_seen)
    assert (shape.parameters["legs"], shape.parameters["legs_inferred"]) == (4.0, 2.0)
    assert shape.warnings == ("2 of its 4 legs were not seen: inferred",)


@pytest.mark.parametrize(
    "name", ["chair", "kitchen_table", "dining-table", "bar stools", "barstool", "armchair", "benches", "Desks", "chair_2"]
)
def test_names_of_furniture_on_legs_are_recognised(name):
    assert category_of(name).on_legs


@pytest.mark.parametrize(
    "name", ["bottle", "tablet", "cabinet", "table_lamp", "desk-lamp", "table cloth", "chair_cushion", "vegetable", ""]
)
def test_other_names_are_not_furniture_on_legs(name):
    assert not category_of(name).on_legs


def test_a_slab_on_one_corner_leg_is_unstable():
    slab = box_mesh(np.array([0.0, 0.0, 0.4]), np.array([0.4, 0.4, 0.45]))
    legs = [box_mesh(np.array([x, x, 0.0]), np.array([x + 0.05, x + 0.05, 0.41])) for x in (0.0, 0.35)]
    assert not stands(*unite([slab, legs[0]]))
    assert stands(*unite([slab, *legs]))


def legless(view, below_m):
    """The view with its mask cut off at a height (world)."""
    kept = without(view, Rigid3(), lambda points: points[:, 2] < below_m) > 0
    at_mask = cv2.resize(kept.astype(np.uint8), view.mask.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return replace(view, mask=view.mask & at_mask.astype(bool))


def without(view, local_from_world, chosen):
    """The view's depth without the pixels whose point is chosen (local frame)."""
    from r2c2r_core.geometry.camera import depth_points

    points = (local_from_world @ view.world_from_camera).apply(depth_points(view.depth_m, view.depth_camera).reshape(-1, 3))
    return np.where(chosen(points).reshape(view.depth_m.shape), 0.0, view.depth_m).astype(np.float32)
