"""Completed free-standing objects compared with rendered truth."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.generate.carved import Carving, solid_field
from r2c2r_core.generate.consistency import self_consistency
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.hulls import carved_family
from r2c2r_core.generate.level_set import Grid
from r2c2r_core.generate.seen import Seen
from r2c2r_core.generate.variation import draw_variation, whole_pool
from r2c2r_core.generate.votes import Votes, collect_votes, grid_votes
from r2c2r_core.geometry.camera import unproject
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, volume
from r2c2r_core.geometry.transforms import Rigid3
from tests.core.generate.scenes import best_thing, carton_scene


def carve(scene, seed=0):
    evidence = gather_evidence(*scene, 10)
    return evidence, best_thing(evidence, draw_variation(evidence, np.random.default_rng(seed)))


def test_a_bottle_seen_only_from_the_front_is_completed_round(bottle_scene):
    """Diameter 8 cm, height 28 cm; the track's box holds the visible 5.5 cm of depth only."""
    for seed in range(2):
        _, shape = carve(bottle_scene, seed)
        assert shape.parameters["revolved"] == 1.0
        assert np.ptp(shape.vertices_local, axis=0) == pytest.approx([0.08, 0.08, 0.28], rel=0.03)


def test_a_chair_has_its_extents_and_stands_on_the_floor(chair_scene):
    evidence = gather_evidence(*chair_scene, 10)
    shape = best_thing(evidence)
    world = shape.vertices_world
    assert np.ptp(world, axis=0) == pytest.approx([0.42, 0.42, 0.9], rel=0.05)
    assert world[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    fit = self_consistency(world, shape.faces, shape.maskable, evidence.pool)
    assert fit["mask_iou"] > 0.85
    assert fit["depth_residual_m"] < 0.012


def test_free_space_between_chair_legs_is_carved_out(chair_scene):
    """The free space that two frames saw is carved out of the prior box."""
    _, shape = carve(chair_scene)
    assert volume(shape.vertices_local, shape.faces) < 0.35 * 0.42 * 0.42 * 0.9


def test_carved_meshes_are_closed_manifold_and_outward(bottle_scene, chair_scene):
    for scene in (bottle_scene, chair_scene):
        _, shape = carve(scene, 2)
        assert is_watertight(shape.vertices_local, shape.faces)
        assert is_manifold(shape.vertices_local, shape.faces)
        assert volume(shape.vertices_local, shape.faces) > 0
        assert len(shape.faces) <= 20_000


def test_a_thing_without_a_box_is_carved_from_its_points_alone(bottle_scene):
    capture, track = bottle_scene
    _, shape = carve((capture, replace(track, box=None)))
    assert np.ptp(shape.vertices_local, axis=0)[2] == pytest.approx(0.28, abs=0.03)
    assert is_watertight(shape.vertices_local, shape.faces)


@pytest.mark.parametrize("elevation_deg", [25, 40])
def test_a_carton_seen_from_above_is_not_extended_backwards(elevation_deg):
    """A carton 12 cm deep, filmed from the front only, in a box 26 cm deep: a deeper one would show more of its top."""
    size = np.array([0.2, 0.12, 0.18])
    scene = carton_scene(size, arc_deg=40, elevation_deg=elevation_deg, yaw_rad=0.0, wall_gap_m=0.25)
    evidence = gather_evidence(*scene, 10)
    everything = whole_pool(evidence)
    family = {guess.assumes: guess for guess in carved_family(evidence, everything, is_round=False)}
    shape = family["carved from free space"].shape(everything)
    assert np.ptp(shape.vertices_local, axis=0) == pytest.approx(size, abs=0.025)


def test_block_votes_equal_per_voxel_votes(chair_scene):
    """Votes computed by blocks of a grid agree with those of every voxel wherever they matter."""
    evidence = gather_evidence(*chair_scene, 10)
    variation = whole_pool(evidence)
    shape, voxel_m, truncation = (30, 30, 50), 0.02, 0.03
    axes = [low + (np.arange(n) + 0.5) * voxel_m for low, n in zip((-0.3, -0.1, 0.0), shape, strict=True)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    every = collect_votes(centres, variation, truncation)
    blocks = grid_votes(centres, shape, voxel_m, variation, truncation, Rigid3())
    assert np.isnan(blocks.distance_m).sum() >= np.isnan(every.distance_m).sum()
    free = np.isneginf(every.free_m)
    assert (np.isneginf(blocks.free_m) == free).mean() > 0.999
    np.testing.assert_allclose(
        np.minimum(blocks.free_m, truncation)[~free], np.minimum(every.free_m, truncation)[~free], atol=1e-6
    )


def test_votes_of_more_than_255_frames_are_counted(bottle_scene):
    evidence = gather_evidence(*bottle_scene, 6)
    view = evidence.pool[0]
    row, column = np.argwhere(view.mask & True)[np.count_nonzero(view.mask) // 2]
    scale = view.depth_camera.width / view.rgb_camera.width
    depth_px = int((row + 0.5) * scale), int((column + 0.5) * scale)
    uv = np.array([[column + 0.5, row + 0.5]])
    point = view.world_from_camera.apply(unproject(uv, view.depth_m[depth_px][None].astype(float), view.rgb_camera))
    many = replace(whole_pool(evidence), views=(view,) * 300, carve_votes=2)
    assert collect_votes(point, replace(many, views=(view,)), 0.03).surfaces[0] == 1
    assert collect_votes(point, many, 0.03).surfaces[0] == 300


def test_a_thin_shell_has_an_unseen_error_and_a_carved_solid_has_none():
    """Only front and top of a body 0.2 m deep and high are observed: a shell 4 cm thick leaves out half of it."""
    evidence = gather_evidence(*carton_scene(np.array([0.3, 0.2, 0.2]), arc_deg=30.0, elevation_deg=20.0, yaw_rad=0.0), 6)
    everything = whole_pool(evidence)
    family = {h.assumes: h for h in carved_family(evidence, everything, is_round=False)}
    assert family["carved from free space"].shape(everything).unseen_error_m is None
    shell = family["as thin as a board where its back was not observed"].shape(everything)
    assert 0.06 < shell.unseen_error_m < 0.2


@pytest.mark.parametrize("in_drawer", [True, False])
def test_a_thing_in_a_drawer_reaches_down_under_its_observed_top(in_drawer: bool) -> None:
    """The drawer's front hides all of it but the top, in every frame."""
    grid = Grid(np.zeros(3), (20, 20, 20), 0.01)
    x, y, z = grid.centres().T
    over = (np.abs(x - 0.1) < 0.06) & (np.abs(y - 0.1) < 0.06)
    top = over & (np.abs(z - 0.15) < 0.02)
    votes = Votes(
        distance_m=np.where(top, z - 0.15, np.nan),
        free_m=np.where(over & (z > 0.17), 0.03, -np.inf),
        surfaces=np.where(top, 5, 0),
        outside_m=np.full(len(x), 0.03),
    )
    seen = Seen(Rigid3(), np.zeros((0, 3)), np.array([0.04, 0.04, 0.02]), np.array([0.16, 0.16, 0.15]), 0.02)
    beyond = np.maximum(seen.low - grid.centres(), grid.centres() - seen.high).max(axis=1)
    field, _ = solid_field(Carving(seen, grid, votes, 0.03, beyond, 0.0, in_drawer), None, mirror=False)
    middle = field[10, 10]
    assert (middle[5] < 0, middle[18] < 0) == (in_drawer, False)
    assert field[2, 2, 5] > 0
