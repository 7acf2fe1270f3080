"""Record3D `.r3d`: a zip (or its folder) of `metadata` and rgbd/N.jpg, N.depth, N.conf; and its export "EXR + JPG".

.depth is LZFSE of little-endian float32 metres, row-major (some writers store it raw); .conf is LZFSE of uint8 0..2, LiDAR
only.
Colour, depth, calibration and pose all belong to the portrait image. Depth may contain NaN. The export is metadata.json,
rgb/N.jpg and depth/N.exr (one channel 'R', HALF or FLOAT metres), without confidence; numbers may be missing.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.lzfse_blocks import unpacked, unpacked_size
from r2c2r_core.ingest.readers.protocol import Part, RawDepth, RawFrame, Reader, Recording, UnreadableFrame, with_confidence
from r2c2r_core.ingest.readers.record3d_metadata import Record3DMetadata, parse_metadata
from r2c2r_core.ingest.readers.stored_depth import depth_size

_METADATA = "metadata"
_EXR_METADATA, _EXR_COLOUR, _EXR_DEPTH = "metadata.json", r"rgb/(\d+)\.(?i:jpe?g|png)", r"depth/(\d+)\.exr"


def open_record3d(files: Files) -> Recording:
    """The recording in a .r3d; raises CaptureError."""
    metadata = parse_metadata(files.read(_METADATA), f"{files.source}, member '{_METADATA}'")
    names = files.names()
    colour = numbered(names, r"rgbd/(\d+)\.(?i:jpe?g|png)")
    depth = numbered(names, r"rgbd/(\d+)\.depth")
    confidence = numbered(names, r"rgbd/(\d+)\.conf")
    if not colour and not depth:
        raise CaptureError(
            f"{files.source}: metadata for {len(metadata.poses)} frames but no rgbd/N.jpg and rgbd/N.depth",
            hint="share the .r3d from the app again; this one was stripped",
        )
    if not depth:
        raise CaptureError(
            f"{files.source}: {len(colour)} colour images but no depth, rgbd/N.depth were expected",
            hint="record with the LiDAR camera, not the video mode",
        )
    size = _depth_size(files, metadata, depth)
    found = Found(colour=colour, depth=depth, confidence=confidence, poses=metadata.poses, times_s=metadata.times_s)
    recording = _joined(files, metadata, _METADATA, found, size, "Record3D .r3d")
    return replace(recording, depth_of=partial(_depth_of, files))


def open_record3d_exr(files: Files) -> Recording:
    """The recording in an EXR+JPG export; raises CaptureError."""
    metadata = parse_metadata(files.read(_EXR_METADATA), f"{files.source}, file '{_EXR_METADATA}'")
    colour, depth = (numbered(files.names(), pattern) for pattern in (_EXR_COLOUR, _EXR_DEPTH))
    size = metadata.depth_size or depth_size(files, depth.values())
    found = Found(colour=colour, depth=depth, poses=metadata.poses, times_s=metadata.times_s)
    return _joined(files, metadata, _EXR_METADATA, found, size, "Record3D EXR+JPG")


def _joined(
    files: Files, metadata: Record3DMetadata, name: str, found: Found, depth_pixels: tuple[int, int], format: str
) -> Recording:
    """The recording of those images; cameras are scaled to the sizes that these really have."""
    metadata.require_poses(found.colour.keys() & found.depth.keys())
    size = first_size(files, found.colour.values())
    _same_shape(size, (metadata.width, metadata.height), f"{files.source}: colour images are", "the metadata says")
    _same_shape(depth_pixels, size, f"{files.source}: depth images are", "colour images are")
    recording = joined_recording(
        files,
        found,
        lambda n: metadata.cameras[n].resized(*size),
        lambda n: metadata.cameras[n].resized(*size).resized(*depth_pixels),
        format=format,
        up_capture=metadata.up_capture,
        other_names=[name],
        units_per_metre=1.0,
    )
    return replace(recording, other_ups=metadata.other_ups)


def _depth_size(files: Files, metadata: Record3DMetadata, depth: dict[int, str]) -> tuple[int, int]:
    if metadata.depth_size is not None:
        return metadata.depth_size
    found = 0
    for name in list(depth.values())[:5]:
        try:
            found = unpacked_size(files.read(name), name) // 4
        except UnreadableFrame:
            continue
        # The depth image has the shape of the colour image: w/h is known, w*h was just counted
        height = round((found * metadata.height / metadata.width) ** 0.5)
        if height and found % height == 0:
            return found // height, height
    raise CaptureError(
        f"{files.source}: depth images of {found} values have no size of the shape {metadata.width}x{metadata.height}",
        hint="the metadata lacks 'dw' and 'dh'; export the recording with a newer app",
    )


def _depth_of(files: Files, frame: RawFrame) -> RawDepth:
    width, height = frame.depth_camera.width, frame.depth_camera.height
    name = frame.confidence_name

    def confidence() -> np.ndarray | None:
        if name is None or unpacked_size(files.read(name), name) == 0:  # FaceID recordings have none, or an empty one
            return None
        return _values(files, name, np.dtype(np.uint8), width, height)

    return with_confidence(_values(files, frame.depth_name, np.dtype("<f4"), width, height), confidence)


def _values(files: Files, name: str, dtype: np.dtype, width: int, height: int) -> np.ndarray:
    content, expected = files.read(name), width * height * dtype.itemsize
    found = len(content) if len(content) == expected else unpacked_size(content, name)
    if found != expected:
        raise UnreadableFrame(f"{name}: {found} bytes of {dtype.name}, {width}x{height} needs {expected}")
    raw = content if len(content) == expected else unpacked(content, name)
    if len(raw) != expected:
        raise UnreadableFrame(f"{name}: damaged LZFSE data, {len(raw)} of {expected} bytes")
    return np.frombuffer(raw, dtype).reshape(height, width)


def _same_shape(found: tuple[int, int], expected: tuple[int, int], found_is: str, expected_is: str) -> None:
    if abs(found[0] * expected[1] / (found[1] * expected[0]) - 1.0) > 0.03:
        raise CaptureError(
            f"{found_is} {found[0]}x{found[1]} (width x height), {expected_is} {expected[0]}x{expected[1]}: another shape",
            hint="were the images rotated or cropped after the export? use the untouched recording",
        )


READER = Reader(
    name="Record3D .r3d",
    parts=(Part("metadata beside rgbd/N.jpg and N.depth", _METADATA),),  # without its frames the error is a clear one
    open=open_record3d,
)
EXR_READER = Reader(
    name="Record3D EXR+JPG",
    parts=(Part(_EXR_METADATA, r"metadata\.json"), Part("rgb/N.jpg", _EXR_COLOUR), Part("depth/N.exr", _EXR_DEPTH)),
    open=open_record3d_exr,
)
