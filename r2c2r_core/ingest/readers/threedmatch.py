"""3DMatch and 7-Scenes as published: frame-N.color.png, frame-N.depth.png, frame-N.pose.txt, alone or in seq-NN folders.

3DMatch (and tsdf-fusion) has camera-intrinsics.txt and depth registered to colour. 7-Scenes has neither: depth is a Kinect's
own, f = 585, about 20 px away from colour, whose f is 525. uint16 millimetres, 0 and 65535 unknown; poses are 4x4
camera-to-world with OpenCV axes; pixel centres lie at integers; gravity-direction.txt, if there, points down.
"""

import re

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_recording, read_poses
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING, depth_size
from r2c2r_core.ingest.readers.texts import GRAVITY, gravity_up, integer_centred, read_calibration

_INTRINSICS = "camera-intrinsics.txt"
_UNREGISTERED = "no camera-intrinsics.txt: read as 7-Scenes, whose depth is not registered to colour (about 20 px)"
_FOLDER = r"(?:[^/]+/)?"
_COLOUR, _DEPTH, _POSE = (rf"frame-(\d+)\.{kind}" for kind in (r"color\.(?i:jpe?g|png)", rf"depth\.{ENDING}", r"pose\.txt"))


def open_threedmatch(files: Files) -> Recording:
    """The first sequence of a 3DMatch or 7-Scenes scene; raises CaptureError."""
    folders = sorted({name.rpartition("/")[0] for name in files.names() if re.fullmatch(_FOLDER + _DEPTH, name)})
    prefix = f"{folders[0]}/" if folders[0] else ""
    colour, depth, poses = (numbered(files.names(), prefix + pattern) for pattern in (_COLOUR, _DEPTH, _POSE))
    sizes = first_size(files, colour.values()), depth_size(files, depth.values())
    rgb_camera, depth_camera, others, notices = _cameras(files, prefix, *sizes)
    if len(folders) > 1:
        notices.append(f"of {len(folders)} sequences {folders[0]} is read; to read another one, give its folder")
    gravity = prefix + GRAVITY if prefix + GRAVITY in files.names() else GRAVITY
    up = gravity_up(files, gravity)
    found = Found(colour=colour, depth=depth, poses=read_poses(files, poses))
    return joined_recording(
        files,
        found,
        lambda _: rgb_camera,
        lambda _: depth_camera,
        format="3DMatch / 7-Scenes sequence",
        notices=notices,
        up_capture=up,
        other_names=(*others, *poses.values(), *([gravity] if up is not None else [])),
    )


def _cameras(
    files: Files, prefix: str, size: tuple[int, int], depth_pixels: tuple[int, int]
) -> tuple[Intrinsics, Intrinsics, list[str], list[str]]:
    for name in (prefix + _INTRINSICS, _INTRINSICS):
        if name in files.names():
            camera = read_calibration(files, name, size)
            return camera, camera.resized(*depth_pixels), [name], []
    colour, depth = (
        integer_centred(f, f, 319.5, 239.5, (640, 480)).resized(*pixels) for f, pixels in ((525.0, size), (585.0, depth_pixels))
    )
    return colour, depth, [], [_UNREGISTERED]


READER = Reader(
    name="3DMatch / 7-Scenes sequence",
    parts=(Part("frame-N.color.png", _FOLDER + _COLOUR), Part("frame-N.depth.png", _FOLDER + _DEPTH)),
    open=open_threedmatch,
)
