"""Masks against the true ones, frame by frame at RGB resolution."""

from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import BundleError
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.report import Metric

MIN_TRUTH_PX = 400


def mask_errors(truth: Path, found: Path) -> tuple[Metric, ...]:
    """Mean IoU of the frames whose true mask has at least 400 px, and the share of those frames that have a mask at all.

    Both are folders of <frame:06d>.png with 0 or 255; a frame without a found mask counts as IoU 0.
    """
    overlaps, present = [], []
    for file in sorted(truth.glob("*.png")):
        true_mask = read_mask(file)
        if np.count_nonzero(true_mask) < MIN_TRUTH_PX:
            continue
        other = found / file.name
        present.append(other.exists())
        overlaps.append(mask_iou(true_mask, read_mask(other, like=true_mask)) if other.exists() else 0.0)
    note = f"{len(overlaps)} frames" if overlaps else f"no frame shows {MIN_TRUTH_PX} px of it"
    return (
        Metric(name="mask_iou", value=_mean(overlaps), unit="share", better="higher", tolerance=0.01, note=note),
        Metric(
            name="mask_frames",
            value=_mean([float(p) for p in present]),
            unit="share",
            better="higher",
            tolerance=0.02,
            note=note,
        ),
    )


def mask_not_given(reason: str) -> tuple[Metric, ...]:
    """The same metrics, not measured."""
    return (
        Metric(name="mask_iou", value=None, unit="share", better="higher", tolerance=0.01, note=reason),
        Metric(name="mask_frames", value=None, unit="share", better="higher", tolerance=0.02, note=reason),
    )


def read_mask(file: Path, *, like: Mask | None = None) -> Mask:
    """A mask image; raises BundleError when it cannot be read or differs in size from `like`."""
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise BundleError(f"{file}: not a readable image", hint="write the masks again with r2c2r run --masks")
    mask = np.asarray(image) > 127
    if like is not None and mask.shape != like.shape:
        raise BundleError(
            f"{file}: {mask.shape[1]}x{mask.shape[0]} pixels, the truth has {like.shape[1]}x{like.shape[0]}",
            hint="masks are compared at the resolution of the colour frames",
        )
    return mask


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None
