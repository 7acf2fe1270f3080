"""Depth estimate of a small carton, by the angle that the cameras cover."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.generate.cartons import carton_family
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.seen import observe_thing
from r2c2r_core.generate.variation import draw_variation, whole_pool
from r2c2r_core.geometry.meshes import is_manifold, is_watertight
from tests.core.generate.scenes import best_thing, carton_scene

SIZE = np.array([0.19, 0.075, 0.29])


def shape_of(scene):
    evidence = gather_evidence(*scene, 12)
    return best_thing(evidence)


@pytest.mark.parametrize(
    ("arc_deg", "elevation_deg"),
    [
        (0.0, 35.0),
        pytest.param(35.0, 10.0, marks=pytest.mark.slow),
        pytest.param(60.0, 30.0, marks=pytest.mark.slow),
        (120.0, 15.0),
    ],
)
def test_the_depth_of_a_carton_is_estimated_from_its_outlines(arc_deg, elevation_deg):
    """The box from segmentation is three times too deep."""
    shape = shape_of(carton_scene(SIZE, arc_deg=arc_deg, elevation_deg=elevation_deg, yaw_rad=0.3))
    assert shape.parameters["boxed"] == 1.0
    assert shape.parameters["depth_sigma_m"] < 0.006
    assert np.ptp(shape.vertices_local, axis=0) == pytest.approx(SIZE, abs=0.006)
    turn = np.arctan2(*shape.world_from_local.rotation[[1, 0], 0])
    assert turn == pytest.approx(0.3, abs=np.radians(1.5))


def test_a_carton_seen_only_from_the_front_has_an_uncertain_depth():
    """All cameras are on one axis through the middle of the carton: any depth would look the same."""
    shape = shape_of(carton_scene(SIZE, arc_deg=0.0, elevation_deg=0.0, yaw_rad=0.0))
    assert shape.parameters["depth_sigma_m"] > 0.1 * np.ptp(shape.vertices_local[:, 1])
    assert np.ptp(shape.vertices_local, axis=0)[[0, 2]] == pytest.approx(SIZE[[0, 2]], abs=0.008)


def test_an_uncertain_depth_does_not_extend_through_the_wall():
    scene = carton_scene(SIZE, arc_deg=0.0, elevation_deg=0.0, yaw_rad=0.0, wall_gap_m=0.0)
    assert shape_of(scene).vertices_world[:, 1].max() < SIZE[1] + 0.01


def test_candidate_depths_vary_with_the_depth_uncertainty():
    evidence = gather_evidence(*carton_scene(SIZE, arc_deg=35.0, elevation_deg=10.0, yaw_rad=0.3), 12)
    shapes = [best_thing(evidence, draw_variation(evidence, np.random.default_rng(k))) for k in range(3)]
    depths = [np.ptp(shape.vertices_local[:, 1]) for shape in shapes]
    assert np.std(depths) > 0.2 * shapes[0].parameters["depth_sigma_m"]
    assert all(is_watertight(s.vertices_local, s.faces) and is_manifold(s.vertices_local, s.faces) for s in shapes)


def test_candidates_of_uncertain_depth_stay_plausible_and_before_the_wall():
    scene = carton_scene(SIZE, arc_deg=0.0, elevation_deg=0.0, yaw_rad=0.0)
    evidence = gather_evidence(*scene, 12)
    for draw in (-1.5, 1.5):
        shape = best_thing(evidence, replace(whole_pool(evidence), depth_draw=draw))
        assert shape.parameters["boxed"] == 1.0
        assert np.ptp(shape.vertices_local[:, 1]) < SIZE[0]
        assert shape.vertices_world[:, 1].max() < SIZE[1] + 0.05 + 0.01  # the wall is 5 cm behind, estimated within 1 cm


def test_a_depth_limited_only_by_the_wall_is_uncertain():
    shape = shape_of(carton_scene(SIZE, arc_deg=0.0, elevation_deg=0.0, yaw_rad=0.0, wall_gap_m=0.01))
    assert shape.parameters["depth_sigma_m"] > 0.1 * np.ptp(shape.vertices_local[:, 1])


def test_shallower_and_deeper_hypotheses_bracket_the_likeliest_depth():
    evidence = gather_evidence(*carton_scene(SIZE, arc_deg=35.0, elevation_deg=0.0, yaw_rad=0.0), 8)
    everything = whole_pool(evidence)
    family = {h.assumes: h.shape for h in carton_family(evidence, observe_thing(evidence, everything))}
    likeliest = np.ptp(family["a box"](everything).vertices_local[:, 1])
    for draw in (-1.5, -0.5, 1.5):
        drawn = {
            name: np.ptp(shape(replace(everything, depth_draw=draw)).vertices_local[:, 1]) for name, shape in family.items()
        }
        assert drawn["a box, shallower than likely"] < min(likeliest, drawn["a box"]) + 1e-9
        assert drawn["a box, deeper than likely"] > max(likeliest, drawn["a box"]) - 1e-9
        assert drawn["a box, shallower than likely"] < likeliest < drawn["a box, deeper than likely"]
