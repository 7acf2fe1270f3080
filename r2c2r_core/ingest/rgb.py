"""Colour images: validation, unchanged storage of JPEG, and a sharpness score."""

import io

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.ingest.readers.images import image_size
from r2c2r_core.ingest.readers.protocol import Colour, UnreadableFrame

_RATED_WIDTH = 320
_JPEG_QUALITY = 95
_UPRIGHT = 1  # EXIF orientation


def stored_jpeg(colour: Colour, name: str, size: tuple[int, int]) -> tuple[bytes, float]:
    """(JPEG bytes to store, sharpness). Raises UnreadableFrame when the image is damaged or of another size."""
    from PIL import Image as PilImage

    found = image_size(colour, name) if isinstance(colour, bytes) else (colour.shape[1], colour.shape[0])
    if found != size:
        raise UnreadableFrame(f"{name}: {found[0]}x{found[1]} pixels, {size[0]}x{size[1]} expected")
    if not isinstance(colour, bytes):
        return _encoded(colour)
    try:
        with PilImage.open(io.BytesIO(colour)) as image:
            untouched = (
                image.format == "JPEG" and image.mode in ("RGB", "L") and image.getexif().get(0x0112, _UPRIGHT) == _UPRIGHT
            )
            if untouched:
                image.draft("L", (_RATED_WIDTH, _RATED_WIDTH))  # a fraction of the decoding work, and still reads every byte
                return colour, _sharpness(np.asarray(image.convert("L")))
            return _encoded(np.asarray(image.convert("RGB")))
    except (OSError, ValueError, SyntaxError) as problem:
        raise UnreadableFrame(f"{name}: damaged image ({problem})") from problem


def _encoded(rgb: Image) -> tuple[bytes, float]:
    done, jpeg = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    assert done, "encoding an RGB array cannot fail"
    return jpeg.tobytes(), _sharpness(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY))


def _sharpness(grey: np.ndarray) -> float:
    """Variance of the Laplacian at 320 px width; only comparable within a recording."""
    height = round(grey.shape[0] * _RATED_WIDTH / grey.shape[1])
    small = cv2.resize(grey, (_RATED_WIDTH, height), interpolation=cv2.INTER_AREA)
    return float(cv2.Laplacian(small, cv2.CV_32F).var())
