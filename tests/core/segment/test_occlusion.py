import numpy as np
import pytest
from skimage.segmentation import watershed

from r2c2r_core.segment.occlusion import flood


@pytest.mark.parametrize("masked", [False, True])
def test_flooding_only_unlabelled_pixels_equals_the_full_watershed(masked: bool) -> None:
    rng = np.random.default_rng(2)
    ridges = rng.random((60, 80)).astype(np.float32)
    markers = np.zeros((60, 80), np.int32)
    markers[:, :30], markers[20:40, 50:] = 1, 2
    markers[rng.random(markers.shape) < 0.2] = 0
    within = np.ones((60, 80), bool)
    within[5:12, 10:70] = not masked
    wanted = watershed(ridges, markers, mask=within)
    assert np.array_equal(np.where(within, flood(ridges, markers, within if masked else None), 0), wanted)
