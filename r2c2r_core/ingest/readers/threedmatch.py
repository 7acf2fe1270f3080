"""3DMatch and 7-Scenes as published: frame-N.color.png, frame-N.depth.png, frame-N.pose.txt, alone or in seq-NN folders.

3DMatch (and tsdf-fusion) has camera-intrinsics.txt and depth registered to colour. 7-Scenes has neither: depth is a Kinect's
own, f = 585, about 20 px away from colour, whose f is 525. uint16 millimetres, 0 and 65535 unknown; poses are 4x4
camera-to-world with OpenCV axes; pixel centres lie at integers.
"""

import re
from functools import partial

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_frames, read_poses
from r2c2r_core.ingest.readers.images import colour_file, depth_file, first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import integer_centred, read_calibration

_INTRINSICS = "camera-intrinsics.txt"
_FOLDER = r"(?:[^/]+/)?"
_COLOUR, _DEPTH, _POSE = (rf"frame-(\d+)\.{kind}" for kind in (r"color\.(?i:jpe?g|png)", r"depth\.(?i:png)", r"pose\.txt"))


def open_threedmatch(files: Files) -> Recording:
    """The first sequence of a 3DMatch or 7-Scenes scene; raises CaptureError."""
    folders = sorted({name.rpartition("/")[0] for name in files.names() if re.fullmatch(_FOLDER + _DEPTH, name)})
    prefix = f"{folders[0]}/" if folders[0] else ""
    colour, depth, poses = (numbered(files.names(), prefix + pattern) for pattern in (_COLOUR, _DEPTH, _POSE))
    size, depth_size = first_size(files, colour.values(), "colour image"), first_size(files, depth.values(), "depth image")
    rgb_camera, depth_camera, others, notices = _cameras(files, prefix, size, depth_size)
    if len(folders) > 1:
        notices.append(f"of {len(folders)} sequences {folders[0]} is read; to read another one, give its folder")
    found = Found(colour=colour, depth=depth, poses=read_poses(files, poses))
    frames, left_out = joined_frames(files, found, lambda _: rgb_camera, lambda _: depth_camera)
    return Recording(
        format="3DMatch / 7-Scenes sequence",
        files=files,
        frames=frames,
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, 1000.0),
        up_capture=None,
        notices=(*notices, *left_out),
        other_names=(*others, *poses.values()),
    )


def _cameras(
    files: Files, prefix: str, size: tuple[int, int], depth_size: tuple[int, int]
) -> tuple[Intrinsics, Intrinsics, list[str], list[str]]:
    for name in (prefix + _INTRINSICS, _INTRINSICS):
        if name in files.names():
            camera = read_calibration(files, name, size)
            return camera, camera.resized(*depth_size), [name], []
    colour, depth = (
        integer_centred(f, f, 319.5, 239.5, (640, 480)).resized(*pixels) for f, pixels in ((525.0, size), (585.0, depth_size))
    )
    return (
        colour,
        depth,
        [],
        ["no camera-intrinsics.txt: read as 7-Scenes, whose depth is not registered to colour (about 20 px)"],
    )


READER = Reader(
    name="3DMatch / 7-Scenes sequence",
    parts=(
        Part("frame-N.color.png", _FOLDER + _COLOUR),
        Part("frame-N.depth.png", _FOLDER + _DEPTH),
    ),
    open=open_threedmatch,
)
