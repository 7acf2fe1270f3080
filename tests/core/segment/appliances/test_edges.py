"""Selection of a box's edges for a photograph, and weights of edge candidates."""

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.segment.appliances.edges import LEFT, EdgeView, associate, displacements, edge_parts, look_across, shares
from tests.core.segment.appliances.drawn import CAMERA, EYES, TRUE, photo

HERE = Rigid3(np.eye(3), np.zeros(3))
BACK_LEFT, BACK_RIGHT = {6, 7, 8}, {9, 10, 11}  # three parts per edge


def candidates(places_px: list[float], contrasts: list[float]) -> EdgeView:
    """One part of an edge, at 2 mm per pixel."""
    one = np.zeros((1, 2, 2))
    peaks, heights = np.array([places_px]), np.array([contrasts])
    return EdgeView(CAMERA, HERE, np.array([0]), one, np.array([[1.0, 0.0]]), np.array([0.002]), peaks, heights)


def test_a_clear_distant_line_does_not_outweigh_a_nearby_edge() -> None:
    """White keys beside the dark edge of a door: above a threshold, more contrast does not make a line a likelier edge."""
    found = associate(np.zeros(1), candidates([0.5, 10.0], [12.0, 60.0]), 0.005)
    assert found.target_px[0] == pytest.approx(0.5, abs=0.4)


def test_a_candidate_without_colour_change_has_zero_weight() -> None:
    found = associate(np.zeros(1), candidates([3.0], [0.0]), 0.005)
    assert found.weight[0] == 0.0
    assert found.gain[0] == 0.0


def test_candidate_gain_falls_with_distance_and_grows_with_spread() -> None:
    near, far = (associate(np.zeros(1), candidates([at], [20.0]), 0.005).gain[0] for at in (1.0, 8.0))
    assert near > far
    assert associate(np.zeros(1), candidates([8.0], [20.0]), 0.02).gain[0] > far


def test_only_edges_of_visible_faces_are_selected() -> None:
    left, right = (look_across(TRUE, [photo(eye)], HERE, 0.02)[0] for eye in (EYES[0], EYES[-1]))
    assert BACK_LEFT & set(left.parts.tolist())
    assert not BACK_RIGHT & set(left.parts.tolist())
    assert BACK_RIGHT & set(right.parts.tolist())
    assert not BACK_LEFT & set(right.parts.tolist())


def test_views_from_behind_and_occluded_views_give_no_edges() -> None:
    assert look_across(TRUE, [photo((0.3, 1.6, 0.4))], HERE, 0.02) == []
    assert look_across(TRUE, [photo(EYES[0], hidden=True)], HERE, 0.02) == []


def test_edge_displacement_equals_the_displacement_of_the_box() -> None:
    view = look_across(TRUE, [photo(EYES[3])], HERE, 0.02)[0]
    moved = TRUE.copy()
    moved[LEFT] -= 0.01
    on_left = view.parts < 3
    off_m = np.abs(displacements(edge_parts(moved), view)) * view.metres_per_px
    np.testing.assert_allclose(off_m[on_left], 0.01, rtol=0.1)  # seen nearly squarely
    np.testing.assert_allclose(displacements(edge_parts(TRUE), view), 0.0, atol=1e-9)


def test_the_total_weight_of_many_views_of_an_edge_is_capped() -> None:
    views = look_across(TRUE, [photo(eye) for eye in EYES], HERE, 0.02)
    total = np.zeros(24)
    for view, counted in zip(views, shares(views, 4.0), strict=True):
        np.add.at(total, view.parts, counted)
    assert total.max() == pytest.approx(4.0)
    assert shares([], 4.0) == []
