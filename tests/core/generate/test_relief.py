import numpy as np
import pytest

from r2c2r_core.generate.relief import find_steps, handle_parts, measure_heights
from r2c2r_core.model.track import FrontHandle


def views_of(depth_of, rng, noise_m, count=8):
    """Points of a 0.5 x 0.7 m front whose face is at y = depth_of(x, z), with a millimetre offset per view."""
    found = []
    for _ in range(count):
        x, z = rng.uniform(-0.25, 0.25, 6000), rng.uniform(-0.35, 0.35, 6000)
        found.append(np.column_stack([x, depth_of(x, z) + rng.normal(0, noise_m, 6000) + rng.normal(0, 0.004), z]))
    return found


def test_a_recessed_field_of_a_framed_front_is_measured():
    """An 8 mm deep field 0.34 x 0.54 m, seen with 2 mm noise."""
    field = lambda x, z: np.where((np.abs(x) < 0.17) & (np.abs(z) < 0.27), 0.008, 0.0)  # noqa: E731
    heights = measure_heights(views_of(field, np.random.default_rng(0), 0.002), 0.5, 0.7, 0.01)
    raised, sunk = find_steps(heights, None)
    assert raised == []
    assert len(sunk) == 1
    assert sunk[0].high == pytest.approx([0.17, 0.008, 0.27], abs=0.012)
    assert sunk[0].high[1] == pytest.approx(0.008, abs=0.002)


def test_noise_alone_gives_no_relief():
    flat = lambda x, z: np.zeros_like(x)  # noqa: E731
    for seed in range(5):
        heights = measure_heights(views_of(flat, np.random.default_rng(seed), 0.006), 0.5, 0.7, 0.01)
        assert find_steps(heights, None) == ([], [])


def test_a_measured_handle_is_excluded_from_the_relief():
    bar = lambda x, z: np.where((np.abs(x) < 0.08) & (np.abs(z - 0.2) < 0.012), -0.03, 0.0)  # noqa: E731
    heights = measure_heights(views_of(bar, np.random.default_rng(0), 0.002), 0.5, 0.7, 0.008)
    handle = FrontHandle(left_m=-0.08, right_m=0.08, bottom_m=0.19, top_m=0.21, protrusion_m=0.03, confidence=1.0)
    assert find_steps(heights, handle) == ([], [])


@pytest.mark.parametrize("as_bar", [True, False])
def test_handle_pieces_fill_the_measured_box_and_reach_into_the_panel(as_bar):
    handle = FrontHandle(left_m=0.2, right_m=0.215, bottom_m=-0.1, top_m=0.1, protrusion_m=0.04, confidence=1.0)
    parts = handle_parts(handle, as_bar=as_bar)
    low, high = np.min([p.low for p in parts], axis=0), np.max([p.high for p in parts], axis=0)
    assert low == pytest.approx([0.2, -0.04, -0.1])
    assert high[[0, 2]] == pytest.approx([0.215, 0.1])
    assert high[1] > 0
    assert len(parts) == (3 if as_bar else 1)
