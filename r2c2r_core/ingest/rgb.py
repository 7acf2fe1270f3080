"""Colour images: checked, copied untouched where they are JPEG, and rated for sharpness."""

import io

import cv2
import numpy as np

from r2c2r_core.ingest.readers.images import image_size
from r2c2r_core.ingest.readers.protocol import UnreadableFrame

_RATED_WIDTH = 320
_JPEG_QUALITY = 95
_UPRIGHT = 1  # EXIF orientation


def stored_jpeg(content: bytes, name: str, size: tuple[int, int]) -> tuple[bytes, float]:
    """(JPEG bytes to store, sharpness). Raises UnreadableFrame when the image is damaged or of another size."""
    from PIL import Image

    found = image_size(content, name)
    if found != size:
        raise UnreadableFrame(f"{name}: {found[0]}x{found[1]} pixels, {size[0]}x{size[1]} expected")
    try:
        with Image.open(io.BytesIO(content)) as image:
            untouched = (
                image.format == "JPEG" and image.mode in ("RGB", "L") and image.getexif().get(0x0112, _UPRIGHT) == _UPRIGHT
            )
            if untouched:
                image.draft("L", (_RATED_WIDTH, _RATED_WIDTH))  # a fraction of the decoding work, and still reads every byte
                return content, _sharpness(np.asarray(image.convert("L")))
            rgb = np.asarray(image.convert("RGB"))
    except (OSError, ValueError, SyntaxError) as problem:
        raise UnreadableFrame(f"{name}: damaged image ({problem})") from problem
    done, jpeg = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    assert done, "encoding an RGB array cannot fail"
    return jpeg.tobytes(), _sharpness(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY))


def _sharpness(grey: np.ndarray) -> float:
    """Variance of the Laplacian at 320 px width; only its order within a recording means something."""
    height = round(grey.shape[0] * _RATED_WIDTH / grey.shape[1])
    small = cv2.resize(grey, (_RATED_WIDTH, height), interpolation=cv2.INTER_AREA)
    return float(cv2.Laplacian(small, cv2.CV_32F).var())
