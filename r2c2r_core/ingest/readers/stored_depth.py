"""Depth images as people store them: PNG, TIFF, PGM, PFM, OpenEXR and NumPy's .npy and .npz, told apart by their content."""

import io
import zipfile
import zlib
from collections.abc import Iterable
from functools import partial
from tokenize import TokenError

import numpy as np

from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import MAX_PIXELS, decoded, first_size
from r2c2r_core.ingest.readers.protocol import RawDepth, RawFrame, UnreadableFrame, with_confidence

ENDING = r"(?i:png|tiff?|pgm|pfm|exr|npy|npz)"
WRITE = "write depth as 16-bit PNG in millimetres, or as float32 .npy, .tiff or .exr in metres"
_FORMATS = ("PNG", "TIFF", "PPM")  # Pillow's names; PPM has PGM and PFM
_EXR, _NPY, _ZIP = b"\x76\x2f\x31\x01", b"\x93NUMPY", b"PK\x03\x04"
_CHANNELS = ("R", "Z", "V", "Y", "depth.V", "Depth.V", "ViewLayer.Depth.Z")  # of depth alone: Record3D's, OpenEXR's, Blender's
_NEAREST_M = 0.1  # of the median pixel: no depth camera sees nearer, so decimal numbers below are metres
# A header is a Python literal, and numpy does not catch the errors of its parser
_OF_ARRAYS = (ValueError, EOFError, OSError, SyntaxError, TypeError, KeyError, MemoryError, RecursionError, TokenError)
_OF_ZIPS = (zipfile.BadZipFile, zlib.error, NotImplementedError)
_SKY = 65504.0  # the largest HALF; renderers write it, or 1e10, where there is nothing
_DEPTH, _CODES = 0x1FFF, 13  # Android's DEPTH16: the bits of its millimetres, and how far above them its confidence is
_STEP_MM, _SURFACE_MM = 4096, 100  # a step between neighbours that only a wall far behind makes, and a surface's own
_FAR_CODE, _FAR_SHARE = 4, 0.01  # 32.8 m and more: where such pixels are this common, it is no room


def depth_file(
    files: Files,
    units_per_metre: float,
    frame: RawFrame,
    *,
    confidence_levels: tuple[int, int] = (1, 2),
    packed: bool = False,
) -> RawDepth:
    """A frame's depth, and confidence 0..2 of an 8-bit PNG where the frame has it. Raises UnreadableFrame.

    `confidence_levels` are the file's minimum values for medium and high confidence; `packed`: it is Android's DEPTH16.
    """
    stored = stored_values(files.read(frame.depth_name), frame.depth_name)
    _require_size(stored, frame.depth_name, frame)
    if packed and stored.dtype == np.uint16:
        return _unpacked(stored)
    return with_confidence(_metres(stored, units_per_metre), partial(_confidence, files, frame, confidence_levels))


def _confidence(files: Files, frame: RawFrame, levels: tuple[int, int]) -> np.ndarray | None:
    name = frame.confidence_name
    if name is None:
        return None
    marks = decoded(files.read(name), name, ("PNG",))
    _require_size(marks, name, frame)
    if marks.dtype != np.uint8:
        raise UnreadableFrame(f"{name}: {marks.dtype.name} a pixel, uint8 expected")
    return np.asarray((marks >= levels[0]).astype(np.uint8) + (marks >= levels[1]))


def stored_values(content: bytes, name: str) -> np.ndarray:
    """The (h, w) numbers of a depth image; raises UnreadableFrame, which says what was found."""
    if content.startswith(_EXR) or name.endswith(".exr"):
        values = _exr(content, name)
    elif content.startswith((_NPY, _ZIP)) or name.endswith((".npy", ".npz")):
        values = _array(content, name)
    else:
        values = decoded(content, name, _FORMATS)
    if values.ndim == 3 and (values[..., :3] == values[..., :1]).all():  # grey, saved as colour
        values = values[..., 0]
    if values.ndim != 2 or values.dtype.itemsize < 2:
        channels = 1 if values.ndim == 2 else values.shape[2]
        raise UnreadableFrame(f"{name}: {channels} x {values.dtype.name} a pixel, one uint16 expected")
    return values


def depth_size(files: Files, names: Iterable[str]) -> tuple[int, int]:
    """(width, height) of the first readable depth image; raises CaptureError when none of them is."""
    return first_size(
        files, names, "depth image", size_of=lambda content, name: stored_values(content, name).shape[::-1], hint=WRITE
    )


def are_depth16(images: Iterable[np.ndarray]) -> bool:
    """Whether images are Android's DEPTH16, not millimetres: steps are in the upper three bits alone, or all is 33 m away."""
    pixels, far, steps, of_codes, codes = 0, 0, 0, 0, set[int]()
    for image in images:
        whole = np.where(image == 65535, 0, image).astype(np.int32)
        pixels, far = pixels + whole.size, far + int((whole >> _CODES >= _FAR_CODE).sum())
        codes.update(np.unique(whole[whole & _DEPTH > 0] >> _CODES).tolist())
        for a, b in ((whole[1:], whole[:-1]), (whole[:, 1:], whole[:, :-1])):
            step = (np.abs(a - b) > _STEP_MM) & (a > 0) & (b > 0)
            steps += int(step.sum())
            of_codes += int((step & (np.abs((a & _DEPTH) - (b & _DEPTH)) < _SURFACE_MM)).sum())
    return far > _FAR_SHARE * pixels and (2 * of_codes > steps or len(codes) == 1)


def _unpacked(stored: np.ndarray) -> RawDepth:
    """Depth and confidence of DEPTH16, whose code 0 is certain and 1 to 7 are 0 to 6/7, here in thirds."""
    codes = stored >> _CODES
    confidence = np.where(codes == 0, 2, np.minimum((np.maximum(codes, 1) - 1) // 2, 2)).astype(np.uint8)
    return RawDepth(np.where(stored == 65535, 0, stored & _DEPTH).astype(np.float32) / np.float32(1000), confidence)


def _metres(stored: np.ndarray, units_per_metre: float) -> np.ndarray:
    """Depth in metres; decimal numbers that would then be nearer than any camera sees are metres already."""
    with np.errstate(over="ignore"):
        values = stored.astype(np.float32)
    few = values[::8, ::8]
    few = few[(few > 0) & (few < _SKY)]
    if stored.dtype.kind == "f" and few.size and np.median(few) < _NEAREST_M * units_per_metre:
        units_per_metre = 1.0
    metres = values / np.float32(units_per_metre)
    metres[values >= _SKY if stored.dtype.kind == "f" else values == 65535] = 0
    return metres


def _require_size(values: np.ndarray, name: str, frame: RawFrame) -> None:
    expected = frame.depth_camera
    if values.shape != (expected.height, expected.width):
        found = "x".join(str(n) for n in values.shape[1::-1])
        raise UnreadableFrame(f"{name}: {found} pixels, {expected.width}x{expected.height} expected")


def _exr(content: bytes, name: str) -> np.ndarray:
    """The only channel of an OpenEXR image, or the one that is named as depth."""
    import OpenEXR

    try:
        low, high = OpenEXR.File(io.BytesIO(content), header_only=True).header()["dataWindow"]
        if float(np.prod(high - low + 1.0)) > MAX_PIXELS:
            raise ValueError("too large")
        channels = OpenEXR.File(io.BytesIO(content), separate_channels=True, num_threads=0).channels()
    except (RuntimeError, ValueError, TypeError, KeyError) as problem:
        raise UnreadableFrame(f"{name}: not a readable OpenEXR image ({len(content)} bytes)") from problem
    named = [channel for channel in _CHANNELS if channel in channels] or list(channels)
    if named[0] not in _CHANNELS and len(named) != 1:
        raise UnreadableFrame(f"{name}: channels {', '.join(sorted(channels)) or 'none'}, depth in 'R' or 'Z' was expected")
    return np.asarray(channels[named[0]].pixels)


def _array(content: bytes, name: str) -> np.ndarray:
    """The numeric array (h, w) of a .npy file, or the only one of a .npz, with its size checked before loading."""
    try:
        if content.startswith(_ZIP):
            content = _only_member(content)
        stream = io.BytesIO(content)
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        if len(shape) == 3 and 1 in (shape[0], shape[2]):
            shape = shape[:2] if shape[2] == 1 else shape[1:]
        if len(shape) != 2 or min(shape) < 1 or shape[0] * shape[1] > MAX_PIXELS or dtype.kind not in "fiu":
            raise ValueError(f"{dtype} of shape {shape}")
        return np.load(io.BytesIO(content), allow_pickle=False).reshape(shape)
    except (*_OF_ARRAYS, *_OF_ZIPS) as problem:
        raise UnreadableFrame(f"{name}: not a readable depth array ({problem})") from problem


def _only_member(content: bytes) -> bytes:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        members = [member for member in members if "depth" in member.filename] or members
        if len(members) != 1 or members[0].file_size > 8 * MAX_PIXELS + 1024:
            raise ValueError(f"{', '.join(m.filename for m in members)[:80]}: one array of depth expected")
        return archive.read(members[0])
