"""ScanNet's export: color/N.jpg, depth/N.png, pose/N.txt, intrinsic/intrinsic_color.txt and intrinsic_depth.txt.

Depth is uint16 millimetres, aligned to colour up to scale, each with its own calibration and no extrinsic between them; poses
are 4x4 camera-to-world with OpenCV axes, -inf where tracking was lost; world z up; pixel centres lie at integers.
"""

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording, read_poses
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING, depth_size
from r2c2r_core.ingest.readers.texts import read_calibration

_COLOUR, _DEPTH, _POSE = r"color/(\d+)\.(?i:jpe?g|png)", rf"depth/(\d+)\.{ENDING}", r"pose/(\d+)\.txt"
_INTRINSIC_COLOUR, _INTRINSIC_DEPTH = "intrinsic/intrinsic_color.txt", "intrinsic/intrinsic_depth.txt"
_SENSOR_SIZE = (1296, 968)  # of the colour images that intrinsic_color.txt is for


def open_scannet(files: Files) -> Recording:
    """The recording in a ScanNet export; raises CaptureError."""
    colour, depth, poses = (numbered(files.names(), pattern) for pattern in (_COLOUR, _DEPTH, _POSE))
    rgb_camera, notices = _colour_camera(files, first_size(files, colour.values()))
    depth_camera = read_calibration(files, _INTRINSIC_DEPTH, depth_size(files, depth.values()))
    found = Found(colour=colour, depth=depth, poses=read_poses(files, poses))
    return joined_recording(
        files,
        found,
        lambda _: rgb_camera,
        lambda _: depth_camera,
        format="ScanNet export",
        up_capture=Z_UP,
        notices=notices,
        other_names=(_INTRINSIC_COLOUR, _INTRINSIC_DEPTH, *poses.values()),
    )


def _colour_camera(files: Files, size: tuple[int, int]) -> tuple[Intrinsics, list[str]]:
    """The colour camera, scaled if the images were downscaled without updating their calibration."""
    camera = read_calibration(files, _INTRINSIC_COLOUR, size)
    if abs(camera.cx / camera.width - 0.5) < 0.15:
        return camera, []
    full = read_calibration(files, _INTRINSIC_COLOUR, _SENSOR_SIZE)
    return full.resized(*size), [f"the colour calibration is for {full.width}x{full.height} and was scaled to the images"]


READER = Reader(
    name="ScanNet export",
    parts=(
        Part("color/N.jpg", _COLOUR),
        Part("depth/N.png", _DEPTH),
        Part(_INTRINSIC_COLOUR, _INTRINSIC_COLOUR),
        Part(_INTRINSIC_DEPTH, _INTRINSIC_DEPTH),
    ),
    open=open_scannet,
)
