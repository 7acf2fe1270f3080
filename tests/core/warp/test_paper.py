"""The paper's corners and affine map, as printed: exact cases, and their residuals."""

import numpy as np
import pytest

from r2c2r_core.warp.paper import fit_paper_map, paper_corners

CORNERS = np.array([[0.3, -0.29, 0.35], [-0.3, -0.29, 0.35], [-0.3, -0.29, -0.35], [0.3, -0.29, -0.35]])


def box(handle: bool = False) -> np.ndarray:
    back = CORNERS * [1, -1, 1]
    tip = [[0.295, -0.33, 0.345]] if handle else np.zeros((0, 3))
    return np.concatenate([CORNERS, back, np.asarray(tip)])


def test_a_parallelogram_maps_exactly_to_a_rectangle_keeping_depth() -> None:
    """Six unknowns suffice for a parallelogram."""
    sheared = CORNERS + np.outer([0.02, 0.02, -0.02, -0.02], [1.0, 0.0, 0.0])
    fitted = fit_paper_map(sheared, CORNERS)
    assert fitted is not None
    assert fitted.residual_m < 1e-12
    np.testing.assert_allclose(fitted.apply(sheared), CORNERS, atol=1e-12)
    behind = sheared + np.array([0.0, 0.4, 0.0])
    np.testing.assert_allclose(fitted.apply(behind)[:, 1], CORNERS[:, 1] + 0.4, atol=1e-12)


def test_corners_that_form_no_parallelogram_leave_a_residual() -> None:
    """2 cm of noise on the corners leaves a residual of about a centimetre: eight equations, six unknowns."""
    rng = np.random.default_rng(0)
    noise = [CORNERS + rng.normal(0, 0.02, (4, 3)) * [1, 0, 1] for _ in range(300)]
    missed = [fit_paper_map(source, CORNERS).residual_m for source in noise]  # type: ignore[union-attr]
    assert 0.006 < float(np.mean(missed)) < 0.018


@pytest.mark.parametrize("handle", [False, True])
def test_paper_corners_are_quadrant_extremes_including_handle_tips(handle: bool) -> None:
    found = paper_corners(box(handle))
    assert found is not None
    np.testing.assert_allclose(found[1:], CORNERS[1:])
    np.testing.assert_allclose(found[0], box(handle)[-1] if handle else CORNERS[0])


def test_a_mesh_without_a_vertex_in_a_quadrant_has_no_corners() -> None:
    assert paper_corners(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])) is None
