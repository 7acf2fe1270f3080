import numpy as np

from r2c2r_core.geometry.masks import box_around


def test_the_box_of_a_mask_holds_it_with_a_margin_inside_the_image() -> None:
    mask = np.zeros((8, 10), bool)
    mask[2, 3] = mask[7, 4] = True
    assert box_around(mask) == (slice(2, 8), slice(3, 5))
    assert mask[box_around(mask, 3)].shape == (8, 8)  # three more on each side, but for the lower border
    assert mask[box_around(np.zeros_like(mask), 3)].size == 0
