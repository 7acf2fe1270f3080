"""Image bytes: sizes and depth values, shared by the readers."""

import io
import re
import warnings
from collections.abc import Iterable

import cv2
import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.protocol import UnreadableFrame

_MAX_PIXELS = 64_000_000


def image_size(content: bytes, name: str) -> tuple[int, int]:
    """(width, height) from an image's header, without decoding it; raises UnreadableFrame."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit below is ours
            with Image.open(io.BytesIO(content)) as image:
                width, height = image.size
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as problem:
        raise UnreadableFrame(f"{name}: not an image ({len(content)} bytes)") from problem
    if width * height > _MAX_PIXELS:
        raise UnreadableFrame(f"{name}: {width}x{height} pixels, at most {_MAX_PIXELS // 10**6} megapixels are expected")
    return width, height


def decode_depth_png(content: bytes, name: str, units_per_metre: float, size: tuple[int, int]) -> np.ndarray:
    """Depth in metres of a 16-bit PNG; 0 and 65535 mean unknown. Raises UnreadableFrame."""
    stored = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    if stored is None or stored.ndim != 2 or stored.dtype != np.uint16:
        raise UnreadableFrame(f"{name}: not a readable 16-bit depth PNG")
    if (stored.shape[1], stored.shape[0]) != size:
        raise UnreadableFrame(f"{name}: {stored.shape[1]}x{stored.shape[0]} pixels, {size[0]}x{size[1]} expected")
    metres = stored.astype(np.float32) / np.float32(units_per_metre)
    metres[stored == 65535] = 0
    return metres


def numbered(names: Iterable[str], pattern: str) -> dict[int, str]:
    """File names by the number that `pattern`'s first group finds in them."""
    found: dict[int, str] = {}
    for name in sorted(names):
        match = re.fullmatch(pattern, name)
        if match:
            found.setdefault(int(match.group(1)), name)
    return found


def first_size(contents: Iterable[tuple[str, bytes]], what: str, source: object) -> tuple[int, int]:
    """Size of the first readable image; raises CaptureError when none of them is."""
    problem: UnreadableFrame | None = None
    for name, content in contents:
        try:
            return image_size(content, name)
        except UnreadableFrame as failure:
            problem = problem or failure
    raise CaptureError(
        f"{source}: no readable {what}: {problem or 'there is none'}", hint="export the recording again"
    ) from problem
