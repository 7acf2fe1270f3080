"""Which lines of a rectangle belong to what stands there."""

import numpy as np

from r2c2r_core.segment.appliances.trimming import _solid_span


def span(through, known=100):
    through = np.array(through, float)
    return _solid_span(np.full(len(through), float(known)), through)


def test_a_wall_beyond_a_gap_is_cut_off_with_the_gap():
    assert span([0, 10, 70, 96, 97, 54, 0, 0, 0, 0, 0, 0, 25]) == (6, 12)


def test_glass_within_its_frame_is_no_gap():
    """The sensor sees through the window, but not through the bars above and below it."""
    assert span([0, 0, 70, 75, 80, 80, 75, 70, 0, 0]) == (0, 9)


def test_a_front_without_gaps_and_one_hardly_measured_stay_whole():
    assert span([0, 5, 60, 5, 0]) == (0, 4)
    assert span([9, 9, 9, 9], known=10) == (0, 3)
