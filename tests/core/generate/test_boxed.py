"""Fronts and appliances against rendered truth."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate import boxed
from r2c2r_core.generate.completion import Completion
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.rear_edge import _change_point, rear_edge
from r2c2r_core.generate.variation import draw_variation, whole_pool
from r2c2r_core.geometry.meshes import face_normals, is_manifold, is_watertight, volume
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.names import category_of
from tests.core.generate.scenes import appliance_shape, front_shape


def shape_of(make, scene, seed=0):
    evidence = gather_evidence(*scene, 10)
    return make(evidence, draw_variation(evidence, np.random.default_rng(seed)))


def protruding(shape, face_y):
    return shape.vertices_local[shape.vertices_local[:, 1] < face_y - 0.005]


def test_a_front_lies_exactly_on_its_plane_and_rectangle_and_reaches_the_wall(front_scene):
    shape = shape_of(front_shape, front_scene)
    body = shape.vertices_local[shape.vertices_local[:, 1] >= -1e-9]
    assert body.min(axis=0) == pytest.approx([-0.25, 0.0, -0.30], abs=1e-6)
    assert body.max(axis=0)[[0, 2]] == pytest.approx([0.25, 0.30], abs=1e-6)
    assert body[:, 1].max() == pytest.approx(0.60, abs=0.012)  # the wall less its gap, varied by 1 %


def test_the_front_face_is_flat(front_scene):
    shape = shape_of(front_shape, front_scene)
    normals = face_normals(shape.vertices_local, shape.faces)
    assert np.abs(np.abs(normals).max(axis=1) - 1).max() < 1e-6


def test_the_handle_stands_out_where_it_was_measured(front_scene):
    """Bounding box of the protruding part within 1.5 cm of the true bar."""
    for seed in range(4):
        handle = protruding(shape_of(front_shape, front_scene, seed), 0.0)
        assert handle.min(axis=0) == pytest.approx([-0.08, -0.035, 0.20], abs=0.015)
        assert handle.max(axis=0)[[0, 2]] == pytest.approx([0.08, 0.215], abs=0.015)


def test_an_appliance_corrects_its_box_where_cameras_look(appliance_scene):
    """Width and height within 2 % of 0.46 x 0.28 m, though the track's box is a centimetre too wide; depth seen from above."""
    for seed in range(4):
        shape = shape_of(appliance_shape, appliance_scene, seed)
        body = shape.vertices_local[shape.vertices_local[:, 1] > -0.1701]
        width, depth, height = np.ptp(body, axis=0)
        assert width == pytest.approx(0.46, rel=0.02)
        assert height == pytest.approx(0.28, rel=0.02)
        assert depth == pytest.approx(0.34, rel=0.02)


def test_an_appliance_keeps_its_handle(appliance_scene):
    handle = protruding(shape_of(appliance_shape, appliance_scene), -0.17)
    assert handle.min(axis=0) == pytest.approx([0.08, -0.21, -0.09], abs=0.015)
    assert handle.max(axis=0)[[0, 2]] == pytest.approx([0.095, 0.09], abs=0.015)


def test_boxes_are_closed_manifold_and_outward(front_scene, appliance_scene):
    for make, scene in ((front_shape, front_scene), (appliance_shape, appliance_scene)):
        shape = shape_of(make, scene)
        assert is_watertight(shape.vertices_local, shape.faces)
        assert is_manifold(shape.vertices_local, shape.faces)
        assert volume(shape.vertices_local, shape.faces) > 0


def test_a_front_without_a_wall_gets_its_categorys_depth(front_scene):
    capture, track = front_scene
    open_room = replace(capture, room=replace(capture.room, walls=()))
    depths = {round(float(np.ptp(shape_of(front_shape, (open_room, track), k).vertices_local[:, 1])), 4) for k in range(5)}
    assert all(0.58 * 0.95 <= depth - 0.035 <= 0.58 * 1.05 for depth in depths)
    assert len(depths) > 2  # nobody saw it, so it is varied


@pytest.mark.parametrize("seed", [0, 3])
def test_a_card_tells_the_depth_that_its_mesh_has(front_scene, seed):
    """c0 goes to the wall, the last two are as deep as others that are sold."""
    evidence = gather_evidence(*front_scene, 6)
    cards = [Completion().measured(evidence, f"c{k}", seed) for k in range(4)]
    for shape, _, told in cards:
        if "deep" in told:
            assert told.startswith(f"{shape.vertices_local[:, 1].max():.2f} m deep")
    sold = [shape.vertices_local[:, 1].max() for shape, _, told in cards if "sold" in told]
    assert sold
    assert all(min(abs(depth - listed) for listed in DEPTHS_SOLD_M) < 1e-6 for depth in sold)


@pytest.mark.parametrize(("usual_m", "told"), [(0.28, "points"), (0.345, "usually")])
def test_an_appliance_is_never_shallower_than_its_points_reach_and_says_why(appliance_scene, monkeypatch, usual_m, told):
    """Seen 34 cm deep: a kind that is usually less deep is no reason for that."""
    monkeypatch.setattr(boxed, "_side_seen", lambda box, views: False)
    shallow = replace(category_of("microwave"), depth=replace(category_of("microwave").depth, usual=usual_m))
    monkeypatch.setattr(boxed, "category_of", lambda text: shallow)
    evidence = gather_evidence(*appliance_scene, 10)
    everything = whole_pool(evidence)
    first = boxed.appliance_hypotheses(evidence, everything)[0]
    assert told in first.assumes
    for scale in (0.95, 1.0):
        body = first.shape(replace(everything, depth_scale=scale)).vertices_local
        assert body[:, 1].max() + 0.17 > 0.333


def test_the_segmenters_own_depth_is_told_as_that(appliance_scene):
    capture, track = appliance_scene
    deep = replace(track, box=replace(track.box, dimensions_m=np.array([0.47, 0.40, 0.285])))
    evidence = gather_evidence(capture, deep, 10)
    told = [h.assumes for h in boxed.appliance_hypotheses(evidence, whole_pool(evidence))]
    assert "sides show" in told[0]
    assert "its box was measured" in told[1]


def test_a_front_without_a_rectangle_says_what_to_do(front_scene):
    capture, track = front_scene
    with pytest.raises(GenerationFailed, match="add a click"):
        shape_of(front_shape, (capture, replace(track, front=None)))


@pytest.mark.parametrize("off_m", [-0.03, 0.0, 0.04])
def test_an_appliance_ends_where_the_wall_shows_past_its_sides(appliance_scene, off_m):
    """The segmenter's box is too deep or too shallow; the true one ends 34 cm behind the front."""
    capture, track = appliance_scene
    evidence = gather_evidence(capture, track, 10)
    low, high = np.array([-0.23, -0.17, -0.14]), np.array([0.23, 0.17 + off_m, 0.14])
    assert rear_edge(low, high, evidence.pool, track.box.world_from_object) == pytest.approx(0.17, abs=0.012)


def test_a_rear_edge_that_no_frame_shows_stays_where_it_was_thought(appliance_scene):
    capture, track = appliance_scene
    evidence = gather_evidence(capture, track, 10)
    low, high = np.array([-0.23, -0.17, -0.14]), np.array([0.23, 0.17, 0.14])
    blind = [replace(view, depth_m=np.zeros_like(view.depth_m)) for view in evidence.pool]
    assert rear_edge(low, high, blind, track.box.world_from_object) == high[1]


@pytest.mark.parametrize(("wall_m", "ends"), [(0.30, False), (0.36, True)])
def test_a_face_that_ends_at_the_wall_has_no_rear_edge_before_it(wall_m, ends):
    """A refrigerator stands against the wall: rays beyond its side meet the wall where that begins."""
    y = np.arange(-0.2, 0.40, 0.001)
    noise = np.random.default_rng(0).normal(0, 0.002, len(y))
    found = _change_point(y, np.where(y < 0.30, 0.0, wall_m - y) + noise, thought=0.30, reach_m=0.08)
    assert (found == pytest.approx((0.295, 0.300), abs=0.011)) if ends else found is None
