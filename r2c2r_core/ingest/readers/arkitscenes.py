"""ARKitScenes: lowres_wide/<id>_<t>.png, lowres_depth, confidence, lowres_wide_intrinsics/<id>_<t>.pincam, lowres_wide.traj.

Depth is uint16 millimetres, confidence 0..2. A .pincam line is `w h fx fy cx cy`; a .traj line is `t ax ay az tx ty tz`,
axis-angle, WORLD-TO-CAMERA, ten a second, so that only about one image in six has a pose. Camera axes are OpenCV's, world z up,
images in sensor orientation. (apple/ARKitScenes DATA.md, tenFpsDataLoader.py.)
"""

import re
from collections.abc import Iterable
from functools import cache

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import integer_centred, lines_of, read_numbers, tried
from r2c2r_core.ingest.readers.trajectory import Trajectory, named_at

_TRAJECTORY = "lowres_wide.traj"
_STAMP = r"(?:[^/]*_)?(\d{1,12}\.\d{1,12})"  # seconds
_COLOUR, _DEPTH = rf"lowres_wide/{_STAMP}\.(?i:png)", rf"lowres_depth/{_STAMP}\.(?i:png)"
_CONFIDENCE, _PINCAM = rf"confidence/{_STAMP}\.(?i:png)", rf"lowres_wide_intrinsics/{_STAMP}\.pincam"
_APART_S = 0.009  # half a frame at 60 Hz: interpolating all through the 0.1 s between two poses would smooth the hand away
_GAP_S = 0.15
_SAME_S = 0.0015  # names are rounded to a millisecond, not always alike


def open_arkitscenes(files: Files) -> Recording:
    """The recording in an ARKitScenes folder; raises CaptureError."""
    colour, depth, confidence, pincam = (
        _by_time(files.names(), pattern) for pattern in (_COLOUR, _DEPTH, _CONFIDENCE, _PINCAM)
    )
    times = dict(enumerate(sorted(colour)))
    trajectory = _trajectory(files)
    found = Found(
        colour={number: colour[time_s] for number, time_s in times.items()},
        depth=named_at(times, depth, _SAME_S),
        poses={n: p for n, t in times.items() if (p := trajectory.at(t, apart_s=_APART_S, gap_s=_GAP_S)) is not None},
        confidence=named_at(times, confidence, _SAME_S),
        times_s=times,
        cameras=named_at(times, pincam, np.inf),
    )
    size = first_size(files, colour.values())

    @cache
    def camera(number: int) -> Intrinsics | None:
        read = tried(_camera, files, found.cameras[number])
        return None if read is None else read.resized(*size)

    return joined_recording(files, found, camera, format="ARKitScenes", up_capture=Z_UP, other_names=[_TRAJECTORY])


def _by_time(names: Iterable[str], pattern: str) -> dict[float, str]:
    return {float(match.group(1)): name for name in sorted(names) if (match := re.fullmatch(pattern, name))}


def _trajectory(files: Files) -> Trajectory:
    from scipy.spatial.transform import Rotation

    rows = [r for line in lines_of(files, _TRAJECTORY) if (r := read_numbers(line.encode())) is not None and r.size == 7]
    table = np.array([row for row in rows if np.isfinite(row).all()]).reshape(-1, 7)
    if not len(table):
        raise CaptureError(f"{files.source}/{_TRAJECTORY}: no line 't ax ay az tx ty tz'", hint="download the recording again")
    table = table[np.argsort(table[:, 0], kind="stable")]
    camera_from_world = Rotation.from_rotvec(table[:, 1:4]).as_matrix()
    return Trajectory(table[:, 0], [Rigid3(r, t).inverse for r, t in zip(camera_from_world, table[:, 4:], strict=True)])


def _camera(files: Files, name: str) -> Intrinsics:
    numbers = read_numbers(files.read(name))
    if numbers is None or numbers.size != 6 or not (np.isfinite(numbers).all() and (numbers[:4] >= 1).all()):
        raise CaptureError(f"{files.source}/{name}: expected 'w h fx fy cx cy'", hint="download the recording again")
    width, height, fx, fy, cx, cy = numbers
    return integer_centred(fx, fy, cx, cy, (width, height))


READER = Reader(
    name="ARKitScenes",
    parts=(
        Part("lowres_wide/<time>.png", _COLOUR),
        Part("lowres_depth/<time>.png", _DEPTH),
        Part("lowres_wide_intrinsics/<time>.pincam", _PINCAM),
        Part(_TRAJECTORY, re.escape(_TRAJECTORY)),
    ),
    open=open_arkitscenes,
)
