import numpy as np
import pytest

from r2c2r_core.segment.motion.limits import widest


def test_a_single_frame_beyond_the_others_is_not_the_largest_opening() -> None:
    held = np.concatenate([np.linspace(0.0, 1.0, 20), np.full(10, 1.0)])
    assert widest(held, np.append(held, 1.4), turns=True) == pytest.approx(1.0, abs=0.02)
