"""Number of pixels shared by the masks of two sets."""

import numpy as np
import pytest

from app.jobs.mask_wire import mask_bits
from app.services.overlap import Bits, Overlaps, spread
from r2c2r_core.geometry.masks import mask_iou, pack_mask

SHAPE = (24, 32)


def random_mask(rng: np.random.Generator) -> np.ndarray:
    """A speckled rectangle, which may be empty or touch the border."""
    mask = np.zeros(SHAPE, bool)
    top, left = rng.integers(0, SHAPE[0]), rng.integers(0, SHAPE[1])
    part = mask[top : top + rng.integers(1, 16), left : left + rng.integers(1, 16)]
    part[:] = rng.random(part.shape) < 0.8
    return mask


def bits(mask: np.ndarray) -> Bits:
    return mask_bits(pack_mask(mask), SHAPE[1])


def test_the_iou_over_frames_is_that_of_all_pixels_together() -> None:
    rng = np.random.default_rng(0)
    for _ in range(100):
        first, second = ([random_mask(rng) for _ in range(3)] for _ in range(2))
        overlaps = Overlaps()
        for a, b in zip(first, second, strict=True):
            overlaps.add({"a": bits(a)}, {"b": bits(b)})
        wanted = mask_iou(np.concatenate(first), np.concatenate(second))
        found = overlaps.matched(0.0)
        assert (found[0].iou if found else 0.0) == pytest.approx(wanted, abs=1e-12)


def test_frames_with_only_one_mask_lower_the_iou() -> None:
    mask = np.zeros(SHAPE, bool)
    mask[:10, :10] = True
    overlaps = Overlaps()
    overlaps.add({"a": bits(mask)}, {"b": bits(mask)})
    overlaps.add({"a": bits(mask)}, {})
    (pair,) = overlaps.matched(0.0)
    assert (pair.iou, pair.frames) == (0.5, 1)


def test_each_object_matches_at_most_the_most_similar_one_in_any_order() -> None:
    masks = {name: np.zeros(SHAPE, bool) for name in ("left", "whole", "right")}
    masks["left"][:, :12] = masks["right"][:, 12:20] = masks["whole"][:, :20] = True
    drawn = {name: bits(mask) for name, mask in masks.items()}
    halves = {name: drawn[name] for name in ("right", "left")}
    for first, second in ((halves, {"whole": drawn["whole"]}), ({"whole": drawn["whole"]}, halves)):
        overlaps = Overlaps()
        overlaps.add(first, second)  # type: ignore[arg-type]  # names are keys
        (pair,) = overlaps.matched(0.1)
        assert {pair.first, pair.second} == {"left", "whole"}
        assert pair.iou == pytest.approx(12 / 20)
        assert overlaps.matched(0.61) == []


def test_frames_beyond_the_limit_are_subsampled_evenly() -> None:
    assert spread([5, 1, 3], 3) == [1, 3, 5]
    few = spread(range(1000), 5)
    assert (few[0], few[-1], len(few)) == (0, 999, 5)
    assert set(np.diff(few)) <= {249, 250}
