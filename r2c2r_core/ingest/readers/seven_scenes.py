"""7-Scenes-like folders: color/N.jpg, depth/N.png, intrinsics_color.txt; also pose/N.txt and gravity-direction.txt.

Depth is uint16 millimetres (0 and 65535 unknown), registered to colour; poses are 4x4 camera-to-world with OpenCV axes, their
rotations off by up to 4e-4; pixel centres lie at integers; gravity-direction.txt points down.
"""

from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_recording, read_poses
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING
from r2c2r_core.ingest.readers.texts import GRAVITY, gravity_up, read_calibration

_INTRINSICS = "intrinsics_color.txt"
_COLOUR = r"color/(?:frame-)?(\d+)(?:\.color)?\.(?i:jpe?g|png)"
_DEPTH = rf"depth/(?:frame-)?(\d+)(?:\.depth)?\.{ENDING}"
_POSE = r"pose/(?:frame-)?(\d+)(?:\.pose)?\.txt"


def open_seven_scenes(files: Files) -> Recording:
    """The recording in a 7-Scenes-like folder; raises CaptureError."""
    colour, depth, poses = (numbered(files.names(), pattern) for pattern in (_COLOUR, _DEPTH, _POSE))
    rgb_camera = read_calibration(files, _INTRINSICS, first_size(files, colour.values()))
    found = Found(colour=colour, depth=depth, poses=read_poses(files, poses))
    up = gravity_up(files, GRAVITY)
    others = [_INTRINSICS, *poses.values(), *([GRAVITY] if up is not None else [])]
    return joined_recording(files, found, lambda _: rgb_camera, format="7-Scenes folder", up_capture=up, other_names=others)


READER = Reader(
    name="7-Scenes folder",
    parts=(Part("color/N.jpg", _COLOUR), Part("depth/N.png", _DEPTH), Part(_INTRINSICS, _INTRINSICS)),
    open=open_seven_scenes,
)
