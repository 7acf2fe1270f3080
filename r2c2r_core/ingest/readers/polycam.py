"""Polycam's raw export: keyframes/{images,cameras,depth,confidence}/<microseconds>.{jpg,json,png,png}.

corrected_images and corrected_cameras (undistorted) are preferred frame by frame; large scans have none. Camera files hold
fx, fy, cx, cy, width, height and t_00..t_23, row-major camera-to-world with ARKit's axes in a y-up world; since 2025 corrected
ones have no width and height, which are those of the image. Depth is uint16 millimetres, confidence 0, 127 or 255. Frames are
named by their time; their number here is its rank. (PolyCam/polyform; nerfstudio pull request 3725.)
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Y_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import finite_numbers, integer_centred, pose_of_matrix, read_json_object, tried

_IMAGES, _CAMERAS = r"images/(\d+)\.(?i:jpe?g|png)", r"cameras/(\d+)\.json"
_DEPTH, _CONFIDENCE = r"keyframes/depth/(\d+)\.(?i:png)", r"keyframes/confidence/(\d+)\.(?i:png)"
_CONFIDENCE_LEVELS = (64, 192)  # between 0, 127 and 255
_PARTLY = "{} of {} colour images were corrected (undistorted) by Polycam; the others are read as recorded"


class _Shot(NamedTuple):
    image: str | None
    file: str | None  # its camera's
    camera: Intrinsics | None
    pose: Rigid3 | None


def open_polycam(files: Files) -> Recording:
    """The recording in a Polycam raw export; raises CaptureError."""
    names = files.names()
    depth, confidence = (_by_time(names, pattern) for pattern in (_DEPTH, _CONFIDENCE))
    shots: dict[int, _Shot] = {}
    for kind in ("", "corrected_"):  # the last is preferred, frame by frame: an export may have corrected only some
        colour, cameras = (_by_time(names, f"keyframes/{kind}{pattern}") for pattern in (_IMAGES, _CAMERAS))
        size = first_size(files, colour.values()) if colour else (0, 0)
        for time_us in colour.keys() | cameras.keys():
            document = (tried(read_json_object, files, cameras[time_us]) if time_us in cameras else None) or {}
            shot = _Shot(
                colour.get(time_us), cameras.get(time_us), _camera(document, size) if colour else None, _pose(document)
            )
            if time_us not in shots or (None not in shot and tried(first_size, files, [str(shot.image)]) is not None):
                shots[time_us] = shot
    ranks = {time_us: rank for rank, time_us in enumerate(sorted(shots.keys() | depth.keys() | confidence.keys()))}
    taken = {ranks[time_us]: shot for time_us, shot in shots.items()}
    found = Found(
        colour={n: shot.image for n, shot in taken.items() if shot.image},
        depth={ranks[t]: name for t, name in depth.items()},
        poses={n: shot.pose for n, shot in taken.items() if shot.file},
        confidence={ranks[t]: name for t, name in confidence.items()},
        times_s={rank: time_us * 1e-6 for time_us, rank in ranks.items()},
        cameras={n: shot.file for n, shot in taken.items() if shot.file},
    )
    partly = sum("corrected_images" in name for name in found.colour.values())
    return joined_recording(
        files,
        found,
        lambda n: taken[n].camera,
        format="Polycam raw export",
        up_capture=Y_UP,
        notices=[_PARTLY.format(partly, len(found.colour))] if 0 < partly < len(found.colour) else [],
        confidence_levels=_CONFIDENCE_LEVELS,
    )


def _by_time(names: Iterable[str], pattern: str) -> dict[int, str]:
    return numbered(names, pattern, below=10**18)  # microseconds: files are numbered by the clock, not by frame


def _camera(document: dict[str, Any], size: tuple[int, int]) -> Intrinsics | None:
    sized = {"width": size[0], "height": size[1], **document}
    numbers = finite_numbers([sized.get(key) for key in ("fx", "fy", "cx", "cy", "width", "height")], (6,))
    if numbers is None or not (numbers[[0, 1, 4, 5]] >= 1).all():
        return None
    fx, fy, cx, cy, width, height = numbers
    return integer_centred(fx, fy, cx, cy, (width, height)).resized(*size)


def _pose(document: dict[str, Any]) -> Rigid3 | None:
    numbers = finite_numbers([[document.get(f"t_{row}{column}") for column in range(4)] for row in range(3)], (3, 4))
    return None if numbers is None else pose_of_matrix(numbers, CAMERA_CV_FROM_GL)


READER = Reader(
    name="Polycam raw export",
    parts=(
        Part("keyframes/images/<time>.jpg", f"keyframes/(?:corrected_)?{_IMAGES}"),
        Part("keyframes/cameras/<time>.json", f"keyframes/(?:corrected_)?{_CAMERAS}"),
        Part("keyframes/depth/<time>.png", _DEPTH),
    ),
    open=open_polycam,
)
