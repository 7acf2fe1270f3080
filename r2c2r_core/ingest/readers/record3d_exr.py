"""Record3D's "EXR + JPG" export: metadata.json, rgb/N.jpg, depth/N.exr (one channel 'R', HALF or FLOAT metres); no confidence.

Colour and depth share a frame's number; numbers may be missing, so nothing is matched by position.
"""

import io
from functools import partial

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import MAX_PIXELS, colour_file, numbered
from r2c2r_core.ingest.readers.protocol import Part, RawDepth, RawFrame, Reader, Recording, UnreadableFrame
from r2c2r_core.ingest.readers.record3d import record3d_frames
from r2c2r_core.ingest.readers.record3d_metadata import parse_metadata

_METADATA = "metadata.json"
_COLOUR, _DEPTH = r"rgb/(\d+)\.(?i:jpe?g|png)", r"depth/(\d+)\.exr"


def open_record3d_exr(files: Files) -> Recording:
    """The recording in an EXR+JPG export; raises CaptureError."""
    metadata = parse_metadata(files.read(_METADATA), f"{files.source}, file '{_METADATA}'")
    colour = numbered(files.names(), _COLOUR)
    depth = numbered(files.names(), _DEPTH)
    shared = colour.keys() & depth.keys()
    if not shared:
        raise CaptureError(
            f"{files.source}: {len(colour)} colour images and {len(depth)} depth images, none with the same number",
            hint="rgb/N.jpg and depth/N.exr share N; export the recording again",
        )
    posed, notices = metadata.posed(shared)
    if alone := len(colour.keys() ^ depth.keys()):
        notices.append(f"{alone} frames lack their colour or their depth and were left out")
    size = metadata.depth_size or _first_size(files, [depth[n] for n in posed])
    return Recording(
        format="Record3D EXR+JPG",
        files=files,
        frames=record3d_frames(files, metadata, posed, colour, depth, {}, size),
        colour_of=partial(colour_file, files),
        depth_of=partial(_depth_of, files),
        up_capture=metadata.up_capture,
        other_ups=metadata.other_ups,
        notices=tuple(notices),
        other_names=(_METADATA,),
    )


def _depth_of(files: Files, frame: RawFrame) -> RawDepth:
    metres = _channel(files.read(frame.depth_name), frame.depth_name)
    expected = (frame.depth_camera.height, frame.depth_camera.width)
    if metres.shape != expected:
        found = "x".join(str(n) for n in metres.shape[::-1])
        raise UnreadableFrame(f"{frame.depth_name}: {found} pixels, {expected[1]}x{expected[0]} expected")
    return RawDepth(metres.astype(np.float32), None)


def _first_size(files: Files, names: list[str]) -> tuple[int, int]:
    problem: UnreadableFrame | None = None
    for name in names[:5]:
        try:
            height, width = _channel(files.read(name), name).shape
            return width, height
        except UnreadableFrame as failure:
            problem = failure
    raise CaptureError(f"{files.source}: no readable depth image: {problem}", hint="export the recording again")


def _channel(content: bytes, name: str) -> np.ndarray:
    import OpenEXR

    try:
        low, high = OpenEXR.File(io.BytesIO(content), header_only=True).header()["dataWindow"]
        if float(np.prod(high - low + 1.0)) > MAX_PIXELS:
            raise ValueError("too large")
        channels = OpenEXR.File(io.BytesIO(content), separate_channels=True, num_threads=0).channels()
    except (RuntimeError, ValueError, TypeError, KeyError) as problem:
        raise UnreadableFrame(f"{name}: not a readable OpenEXR image ({len(content)} bytes)") from problem
    if "R" not in channels:
        raise UnreadableFrame(f"{name}: channels {', '.join(sorted(channels)) or 'none'}, depth in 'R' was expected")
    return np.asarray(channels["R"].pixels)


READER = Reader(
    name="Record3D EXR+JPG",
    parts=(Part(_METADATA, r"metadata\.json"), Part("rgb/N.jpg", _COLOUR), Part("depth/N.exr", _DEPTH)),
    open=open_record3d_exr,
)
