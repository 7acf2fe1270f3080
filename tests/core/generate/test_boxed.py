"""Completed fronts and appliances compared with rendered truth."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.generate.boxed import front_hypotheses
from r2c2r_core.generate.completion import Completion
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.variation import draw_variation
from r2c2r_core.geometry.meshes import face_normals, is_manifold, is_watertight, volume
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.depth import sigma_m
from tests.core.generate.scenes import box_shape


def shape_of(scene, seed=0):
    evidence = gather_evidence(*scene, 10)
    return box_shape(evidence, draw_variation(evidence, np.random.default_rng(seed)))


def protruding(shape, face_y):
    return shape.vertices_local[shape.vertices_local[:, 1] < face_y - 0.005]


def test_a_front_box_matches_its_rectangle_and_reaches_the_wall(front_scene):
    shape = shape_of(front_scene)
    body = shape.vertices_local[shape.vertices_local[:, 1] >= -1e-9]
    assert body.min(axis=0) == pytest.approx([-0.25, 0.0, -0.30], abs=1e-6)
    assert body.max(axis=0)[[0, 2]] == pytest.approx([0.25, 0.30], abs=1e-6)
    assert body[:, 1].max() == pytest.approx(0.60, abs=0.012)  # the wall minus its gap, varied by 1 %


def test_faces_of_a_front_box_are_axis_aligned(front_scene):
    shape = shape_of(front_scene)
    normals = face_normals(shape.vertices_local, shape.faces)
    assert np.abs(np.abs(normals).max(axis=1) - 1).max() < 1e-6


def test_the_handle_protrudes_at_its_measured_position(front_scene):
    """Bounding box of the protruding part within 1.5 cm of the true bar."""
    for seed in range(4):
        handle = protruding(shape_of(front_scene, seed), 0.0)
        assert handle.min(axis=0) == pytest.approx([-0.08, -0.035, 0.20], abs=0.015)
        assert handle.max(axis=0)[[0, 2]] == pytest.approx([0.08, 0.215], abs=0.015)


def test_the_handle_of_an_appliance_is_at_its_measured_position(appliance_scene):
    handle = protruding(shape_of(appliance_scene), 0.0)
    assert handle.min(axis=0) == pytest.approx([0.08, -0.04, -0.09], abs=0.015)
    assert handle.max(axis=0)[[0, 2]] == pytest.approx([0.095, 0.09], abs=0.015)


def test_boxes_are_closed_manifold_and_outward(front_scene, appliance_scene):
    for scene in (front_scene, appliance_scene):
        shape = shape_of(scene)
        assert is_watertight(shape.vertices_local, shape.faces)
        assert is_manifold(shape.vertices_local, shape.faces)
        assert volume(shape.vertices_local, shape.faces) > 0


def test_a_front_without_a_wall_gets_the_usual_depth_of_its_category(front_scene):
    capture, track = front_scene
    open_room = replace(capture, room=replace(capture.room, walls=()))
    depths = {round(float(np.ptp(shape_of((open_room, track), k).vertices_local[:, 1])), 4) for k in range(5)}
    assert all(0.58 * 0.95 <= depth - 0.035 <= 0.58 * 1.05 for depth in depths)
    assert len(depths) > 2  # not observed, so it is varied


@pytest.mark.parametrize("seed", [0, 3])
def test_the_reported_depth_of_a_candidate_is_that_of_its_mesh(front_scene, seed):
    """c0 reaches the wall; the last two have catalogue depths."""
    evidence = gather_evidence(*front_scene, 6)
    cards = [Completion().measured(evidence, f"c{k}", seed) for k in range(4)]
    for shape, _, told in cards:
        if "deep" in told:
            assert told.startswith(f"{shape.vertices_local[:, 1].max():.2f} m deep")
    sold = [shape.vertices_local[:, 1].max() for shape, _, told in cards if "sold" in told]
    assert sold
    assert all(min(abs(depth - listed) for listed in DEPTHS_SOLD_M) < 1e-6 for depth in sold)


def test_a_candidate_reports_the_precision_of_the_source_of_its_depth(front_scene):
    evidence = gather_evidence(*front_scene, 6)
    cards = [Completion().measured(evidence, f"c{k}", 0) for k in range(4)]
    sigmas = {told.split(", ")[1]: shape.parameters["behind_sigma_m"] for shape, _, told in cards if "deep" in told}
    assert sigmas["to the wall behind it"] == sigma_m("wall") < sigma_m("worktop") < sigmas["the next size sold"]


def test_an_appliance_has_the_measured_box(appliance_scene):
    for seed in range(2):
        shape = shape_of(appliance_scene, seed)
        body = shape.vertices_local[shape.vertices_local[:, 1] > -0.0001]
        assert np.ptp(body, axis=0) == pytest.approx([0.46, 0.34, 0.28])


def test_a_measured_box_is_a_hypothesis_only_if_its_depth_was_observed(appliance_scene):
    capture, track = appliance_scene
    for seen in (True, False):
        box = replace(track.box, dimensions_m=np.array([0.46, 0.28, 0.28]), depth_seen=seen)
        evidence = gather_evidence(capture, replace(track, box=box), 10)
        told = [hypothesis.assumes for hypothesis in front_hypotheses(evidence, track.front)]
        assert any("its box was measured" in each for each in told) == seen
