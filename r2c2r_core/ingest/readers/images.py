"""Image bytes: sizes and depth values, shared by the readers."""

import io
import re
import warnings
from collections.abc import Iterable

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers import npy
from r2c2r_core.ingest.readers.protocol import Colour, RawDepth, RawFrame, UnreadableFrame

MAX_PIXELS = 64_000_000
MOST_FRAMES = 10_000_000  # 46 hours at 60 Hz; frames are numbered from 0
_FORMATS = ("JPEG", "PNG")  # what phones and data sets write


def image_size(content: bytes, name: str) -> tuple[int, int]:
    """(width, height) from the header of a JPEG or PNG, without decoding it; raises UnreadableFrame.

    Checked before any decoder sees the content: Pillow and OpenCV know some fifty formats, and Pillow runs Ghostscript for one.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit below is ours
            with Image.open(io.BytesIO(content), formats=_FORMATS) as image:
                width, height = image.size
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as problem:
        raise UnreadableFrame(f"{name}: neither a JPEG nor a PNG image ({len(content)} bytes)") from problem
    if width * height > MAX_PIXELS:
        raise UnreadableFrame(f"{name}: {width}x{height} pixels, at most {MAX_PIXELS // 10**6} megapixels are expected")
    return width, height


def colour_file(files: Files, frame: RawFrame) -> bytes:
    """The frame's own image file."""
    return files.read(frame.rgb_name)


def depth_file(
    files: Files,
    units_per_metre: float,
    frame: RawFrame,
    *,
    confidence_levels: tuple[int, int] = (1, 2),
) -> RawDepth:
    """Depth of a 16-bit PNG or .npy, and confidence 0..2 of an 8-bit PNG where the frame has it. Raises UnreadableFrame.

    `confidence_levels` are the file's minimum values for medium and high confidence.
    """
    size = (frame.depth_camera.width, frame.depth_camera.height)
    stored = _decode_depth(files.read(frame.depth_name), frame.depth_name, size)
    metres = stored.astype(np.float32) / np.float32(units_per_metre)
    metres[stored == 65535] = 0
    if frame.confidence_name is None:
        return RawDepth(metres, None)
    marks = decode_png(files.read(frame.confidence_name), frame.confidence_name, np.dtype(np.uint8), size)
    medium, high = confidence_levels
    return RawDepth(metres, (marks >= medium).astype(np.uint8) + (marks >= high))


def _decode_depth(content: bytes, name: str, size: tuple[int, int]) -> np.ndarray:
    if not name.endswith(npy.SUFFIX):
        return decode_png(content, name, np.dtype(np.uint16), size)
    stored = npy.read_array(content, name, MAX_PIXELS)
    if stored.shape != size[::-1]:
        raise UnreadableFrame(f"{name}: {stored.shape[1]}x{stored.shape[0]} numbers, {size[0]}x{size[1]} expected")
    return stored


def decode_png(content: bytes, name: str, dtype: np.dtype, size: tuple[int, int]) -> np.ndarray:
    """The (h, w) values of a PNG with one channel of that type; `size` is (width, height). Raises UnreadableFrame."""
    found = image_size(content, name)
    if found != size:
        raise UnreadableFrame(f"{name}: {found[0]}x{found[1]} pixels, {size[0]}x{size[1]} expected")
    stored = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    if stored is None:
        raise UnreadableFrame(f"{name}: damaged image ({len(content)} bytes)")
    if stored.ndim != 2 or stored.dtype != dtype:
        channels = 1 if stored.ndim == 2 else stored.shape[2]
        raise UnreadableFrame(f"{name}: {channels} x {stored.dtype.name} a pixel, one {dtype.name} expected")
    return np.asarray(stored)


def colour_pixels(colour: Colour, name: str) -> Image:
    """RGB pixels (h, w, 3), as stored: EXIF rotation is ignored. Raises UnreadableFrame."""
    if not isinstance(colour, bytes):
        return colour
    image_size(colour, name)
    bgr = cv2.imdecode(np.frombuffer(colour, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None:
        raise UnreadableFrame(f"{name}: damaged image ({len(colour)} bytes)")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def numbered(names: Iterable[str], pattern: str, *, below: int = MOST_FRAMES) -> dict[int, str]:
    """File names by the number in `pattern`'s first group; numbers not `below` the limit are skipped."""
    longest = len(str(below))
    found: dict[int, str] = {}
    for name in sorted(names):
        match = re.fullmatch(pattern, name)
        digits = match.group(1).lstrip("0") or "0" if match else ""
        if 0 < len(digits) <= longest and int(digits) < below:
            found.setdefault(int(digits), name)
    return found


def first_size(files: Files, names: Iterable[str], what: str) -> tuple[int, int]:
    """(width, height) of the first readable image or .npy array; raises CaptureError when none of them is."""
    problem: UnreadableFrame | None = None
    for name in names:
        try:
            return _size_of(files.read(name), name)
        except UnreadableFrame as failure:
            problem = problem or failure
    raise CaptureError(
        f"{files.source}: no readable {what}: {problem or 'there is none'}", hint="export the recording again"
    ) from problem


def _size_of(content: bytes, name: str) -> tuple[int, int]:
    if not name.endswith(npy.SUFFIX):
        return image_size(content, name)
    height, width = npy.read_array(content, name, MAX_PIXELS).shape
    return width, height
