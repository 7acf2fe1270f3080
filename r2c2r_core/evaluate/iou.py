"""Per-frame IoU of masks against truth at RGB resolution."""

import struct
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.documents import read_bounded
from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.joints import mean
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.report import Metric

MIN_TRUTH_PX = 400
_PNG = b"\x89PNG\r\n\x1a\n"
_MOST_PIXELS = 64_000_000  # same limit as for a recording's images


def mask_errors(truth: Path, found: Path, opened: frozenset[int] = frozenset()) -> tuple[Metric, ...]:
    """Mean IoU of the frames whose true mask has at least 400 px, and the fraction of those frames that have a mask at all.

    Both are folders of <frame:06d>.png with 0 or 255; a frame without a found mask counts as IoU 0. The mean over the frames
    in which one of its fronts is open (`opened`) is reported too.
    """
    overlaps, present, ajar = [], [], []
    for file in sorted(truth.glob("*.png")):
        true_mask = read_mask(file)
        if np.count_nonzero(true_mask) < MIN_TRUTH_PX:
            continue
        other = found / file.name
        present.append(other.exists())
        overlaps.append(mask_iou(true_mask, read_mask(other, like=true_mask)) if other.exists() else 0.0)
        if file.stem.isdecimal() and int(file.stem) in opened:
            ajar.append(overlaps[-1])
    note = f"{len(overlaps)} frames" if overlaps else f"no frame shows {MIN_TRUTH_PX} px of it"
    return (
        Metric(name="mask_iou", value=mean(overlaps), unit="share", better="higher", tolerance=0.01, note=note),
        Metric(
            name="mask_frames",
            value=mean([float(p) for p in present]),
            unit="share",
            better="higher",
            tolerance=0.02,
            note=note,
        ),
        _open_iou(mean(ajar), f"{len(ajar)} frames" if ajar else "no frame shows it open"),
    )


def mask_not_given(reason: str) -> tuple[Metric, ...]:
    """The same metrics, not measured."""
    return (
        Metric(name="mask_iou", value=None, unit="share", better="higher", tolerance=0.01, note=reason),
        Metric(name="mask_frames", value=None, unit="share", better="higher", tolerance=0.02, note=reason),
        _open_iou(None, reason),
    )


def _open_iou(value: float | None, note: str) -> Metric:
    return Metric(name="mask_iou_open", value=value, unit="share", better="higher", tolerance=0.02, note=note)


def read_mask(file: Path, *, like: Mask | None = None) -> Mask:
    """A mask image; raises BundleError when it cannot be read or differs in size from `like`."""
    again = "write the masks again with r2c2r run --masks"
    content = read_bounded(file, BundleError, hint=again)
    if not content.startswith(_PNG) or len(content) < len(_PNG) + 16:  # OpenCV would try some twenty other formats
        raise BundleError(f"{file}: not a PNG image", hint=again)
    width, height = struct.unpack(">II", content[16:24])  # IHDR
    if width * height > _MOST_PIXELS or (like is not None and (height, width) != like.shape):
        expected = f"at most {_MOST_PIXELS} pixels" if like is None else f"{like.shape[1]}x{like.shape[0]}, as the truth has"
        raise BundleError(
            f"{file}: {width}x{height} pixels, expected {expected}",
            hint="masks are compared at the resolution of the colour frames",
        )
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise BundleError(f"{file}: not a readable image", hint=again)
    return np.asarray(image) > 127
