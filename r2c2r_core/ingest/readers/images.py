"""Image files: sizes, pixels and numbering, shared by the readers."""

import io
import re
import warnings
from collections.abc import Callable, Iterable

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.protocol import Colour, RawFrame, UnreadableFrame

MAX_PIXELS = 64_000_000
MOST_FRAMES = 10_000_000  # 46 hours at 60 Hz; frames are numbered from 0
_COLOUR = ("JPEG", "PNG")  # what phones and data sets write, by Pillow's names


def image_size(content: bytes, name: str, formats: tuple[str, ...] = _COLOUR) -> tuple[int, int]:
    """(width, height) from the header of an image in those formats, without decoding it; raises UnreadableFrame.

    Checked before any decoder sees the content: Pillow and OpenCV know some fifty formats, and Pillow runs Ghostscript for one.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damaged tags; and the limit of size below is ours
            with Image.open(io.BytesIO(content), formats=formats) as image:
                width, height = image.size
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as problem:
        expected = "neither a JPEG nor a PNG image" if formats == _COLOUR else f"no {', '.join(formats)} of a kind that is read"
        raise UnreadableFrame(f"{name}: {expected} ({len(content)} bytes, begins with {content[:4]!r})") from problem
    if width * height > MAX_PIXELS:
        raise UnreadableFrame(f"{name}: {width}x{height} pixels, at most {MAX_PIXELS // 10**6} megapixels are expected")
    return width, height


def colour_file(files: Files, frame: RawFrame) -> bytes:
    """The frame's own image file."""
    return files.read(frame.rgb_name)


def decoded(content: bytes, name: str, formats: tuple[str, ...], how: int = cv2.IMREAD_UNCHANGED) -> np.ndarray:
    """The pixels of an image in those formats, as OpenCV reads them; raises UnreadableFrame."""
    image_size(content, name, formats)
    try:
        pixels = cv2.imdecode(np.frombuffer(content, np.uint8), how)
    except cv2.error:  # a kind of TIFF that it does not know
        pixels = None
    if pixels is None:
        raise UnreadableFrame(f"{name}: damaged image ({len(content)} bytes)")
    return np.asarray(pixels)


def colour_pixels(colour: Colour, name: str) -> Image:
    """RGB pixels (h, w, 3), as stored: EXIF rotation is ignored. Raises UnreadableFrame."""
    if not isinstance(colour, bytes):
        return colour
    bgr = decoded(colour, name, _COLOUR, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
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


def first_size(
    files: Files,
    names: Iterable[str],
    what: str = "colour image",
    *,
    size_of: Callable[[bytes, str], tuple[int, int]] = image_size,
    hint: str = "write colour as JPEG or PNG; if it is that, copy the recording again",
) -> tuple[int, int]:
    """(width, height) of the first readable image; raises CaptureError when none of them is."""
    problem: UnreadableFrame | None = None
    for name in names:
        try:
            return size_of(files.read(name), name)
        except UnreadableFrame as failure:
            problem = problem or failure
    raise CaptureError(f"{files.source}: no readable {what}: {problem or 'there is none'}", hint=hint) from problem
