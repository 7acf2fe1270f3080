"""TUM RGB-D: rgb.txt, depth.txt, often groundtruth.txt; depth in 1/5000 m registered to colour; OpenCV camera-to-world, z up.

Also the key-frame layout whose pose file is truth_cam_poses.txt (line i belongs to image i, the clocks differ) and whose
calibration is an ORB-SLAM settings file; and associations.txt (`time file time file`, colour or depth first) beside or in place
of the two lists, as in ICL-NUIM: its pairs hold, and each list adds the images that the other lacks. ICL-NUIM's poses, in a
.freiburg file or one renamed, are of a renderer's left-handed world, so they are reflected; its camera is 481.2, 480, 319.5,
239.5, and which way is up is left to the planes. Clocks are associated within 20 ms, poses interpolated. Pixel centres lie at
integers.
"""

import posixpath
import re
from functools import partial
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import integer_centred, lines_of, pose_of_quaternion, read_numbers, tried
from r2c2r_core.ingest.readers.trajectory import Trajectory, named_at

_POSES = r"groundtruth\.txt|truth_cam_poses\.txt|[^/]+\.freiburg"  # z is up but in the last
_ASSOCIATIONS = r"associat\w*\.txt"
_NAMED_IN = ("groundtruth.txt", "rgb.txt", "depth.txt")
_APART_S = 0.02
_GAP_S = 0.1  # poses farther apart than this are not interpolated
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_KNOWN_CAMERAS = {  # vision.in.tum.de, intrinsic page; fx, fy, cx, cy at 640x480
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
}
_GENERIC_CAMERA = (525.0, 525.0, 319.5, 239.5)
_ICL = r"\.freiburg\b|(?:living|office)_room_traj\d|traj\d\w*_frei_png"
_ICL_CAMERA = (481.2, 480.0, 319.5, 239.5)  # and 640x480
_MIRROR = np.diag([1.0, -1.0, 1.0])
_LEFT_HANDED = "ICL-NUIM's world is left-handed: its poses were reflected about the XZ plane"


class _Calibration(NamedTuple):
    coefficients: tuple[float, float, float, float]  # fx, fy, cx, cy, pixel centres at integers
    units_per_metre: float
    notice: str | None
    name: str | None


def open_tum(files: Files) -> Recording:
    """The recording in a TUM RGB-D folder; raises CaptureError."""
    *lists, pairs = _lists(files)
    rgb, depth = (_present(files, listed) for listed in lists)
    pose_name = next((name for name in sorted(files.names()) if re.fullmatch(_POSES, name)), None)
    icl = re.search(_ICL, f"{files.source} {pose_name}", re.IGNORECASE) is not None
    calibration = _calibration(files, icl)
    colour, times = {n: name for n, (_, name) in rgb.items()}, {n: time_s for n, (time_s, _) in rgb.items()}
    placed = _placed(files, pose_name, times, len(lists[0].images), icl) if pose_name else _Placed({}, times, None)
    there = dict(image[::-1] for image in depth.values())
    paired = {n: pairs[name] for n, name in colour.items() if pairs.get(name) in there}
    found = Found(
        colour=colour,
        depth={**named_at(times, dict(depth.values()), _APART_S), **paired},
        poses=placed.poses,
        times_s=placed.times_s,
    )
    camera = integer_centred(*calibration.coefficients, first_size(files, colour.values()))
    return joined_recording(
        files,
        found,
        lambda _: camera,
        format="TUM RGB-D",
        up_capture=Z_UP if pose_name and not icl else None,
        notices=[
            *(n for n in (calibration.notice, placed.notice, _LEFT_HANDED if icl and pose_name else None) if n),
            *(n for listed in lists for n in _left_out(files, listed)),
        ],
        other_names={*lists[0].names, *lists[1].names, *(n for n in (pose_name, calibration.name) if n)},
        units_per_metre=calibration.units_per_metre,
    )


class _Placed(NamedTuple):
    poses: dict[int, Rigid3 | None]
    times_s: dict[int, float]
    notice: str | None


def _placed(files: Files, pose_name: str, times_s: dict[int, float], rgb_lines: int, icl: bool) -> _Placed:
    """A pose for each image, by time; by line if the clocks do not overlap and the line counts are equal."""
    posed, pose_lines = _timed_poses(files, pose_name)
    if icl:
        posed = {
            n: (time_s, Rigid3(_MIRROR @ p.rotation @ _MIRROR, _MIRROR @ p.translation)) for n, (time_s, p) in posed.items()
        }
    by_time = sorted(posed.values(), key=lambda timed: timed[0])
    trajectory = Trajectory(np.array([time_s for time_s, _ in by_time]), [pose for _, pose in by_time])
    near = {n: trajectory.at(t, apart_s=_APART_S, gap_s=_GAP_S) for n, t in times_s.items()}
    if any(pose is not None for pose in near.values()):
        return _Placed({n: pose for n, pose in near.items() if pose is not None}, times_s, None)
    if rgb_lines != pose_lines:
        raise CaptureError(
            f"{files.source}: {rgb_lines} images and {pose_lines} poses, and their times do not overlap ({pose_name})",
            hint="the pose file belongs to another recording",
        )
    return _Placed(
        {n: pose for n, (_, pose) in posed.items()},
        {n: time_s for n, (time_s, _) in posed.items()},
        f"the clocks of rgb.txt and {pose_name} differ, their counts agree: poses are matched by line",
    )


def _timed_poses(files: Files, name: str) -> tuple[dict[int, tuple[float, Rigid3]], int]:
    """(time, pose) by line `t x y z qx qy qz qw`, without unusable ones, and the number of lines."""
    posed, lines = {}, lines_of(files, name)
    for number, line in enumerate(lines):
        row = read_numbers(line.encode())
        pose = None if row is None or row.size < 8 else pose_of_quaternion(row[1:8])
        if row is not None and pose is not None and np.isfinite(row[0]):
            posed[number] = float(row[0]), pose
    if not posed:
        raise CaptureError(f"{files.source}/{name}: no line of the form 't x y z qx qy qz qw'", hint="check the pose file")
    return posed, len(lines)


_Timed = tuple[float, str]  # time, file


class _List(NamedTuple):
    names: tuple[str, ...]  # of the files that list the images
    images: list[_Timed]


def _lists(files: Files) -> tuple[_List, _List, dict[str, str]]:
    """Lists of rgb.txt, depth.txt and an associations file, where a file below depth/ is depth; and the latter's pairs."""
    own = {"rgb.txt", "depth.txt"} <= files.names()
    names = [name for name in sorted(files.names()) if re.fullmatch(_ASSOCIATIONS, name)][:1]
    read = partial(_columns, count=2)
    rows = [row for name in names for row in (tried(read, files, name) or [] if own else read(files, name))]
    rows = [row if "depth" in row[1][1].lower() else row[::-1] for row in rows]
    colour, depth = (_merged(files, f"{kind}.txt", names, [row[k] for row in rows]) for k, kind in enumerate(("rgb", "depth")))
    return colour, depth, {rgb[1]: of_depth[1] for rgb, of_depth in rows}


def _merged(files: Files, name: str, others: list[str], associated: list[_Timed]) -> _List:
    """A list, with what only the associations file has, in the order of time."""
    listed = [row[0] for row in _columns(files, name, 1)] if name in files.names() else []
    known = {image for _, image in listed}
    more = [image for image in associated if image[1] not in known]
    names = (*([name] if listed else []), *(others if more else []))
    return _List(names or (name,), sorted([*listed, *more]) if listed and more else [*listed, *more])


def _columns(files: Files, name: str, count: int) -> list[list[_Timed]]:
    """`count` pairs of time and file in each line; a line without them, such as one cut off, is left out."""
    rows, odd = [], []
    for words in (line.split() for line in lines_of(files, name)):
        try:
            rows.append([(float(words[2 * k]), words[2 * k + 1]) for k in range(count)])
        except (ValueError, IndexError):
            odd.append(" ".join(words))
    if odd and not rows:
        expected = " ".join(["time filename"] * count)
        raise CaptureError(f"{files.source}/{name}: line '{odd[0][:80]}'", hint=f"expected '{expected}'")
    return rows


def _present(files: Files, listed: _List) -> dict[int, _Timed]:
    """(time, file) by line, of the files that exist."""
    names = files.names()
    present = {n: image for n, image in enumerate(listed.images) if image[1] in names}
    if not present:
        found = f"none of the {len(listed.images)} files it lists exist" if listed.images else "it lists no file"
        raise CaptureError(f"{files.source}/{listed.names[0]}: {found}", hint="copy the images beside it")
    return present


def _left_out(files: Files, listed: _List) -> list[str]:
    """Notices about listed images that do not exist, and about images of the same folders that are not listed."""
    lists, known, names = " and ".join(listed.names), {image for _, image in listed.images}, files.names()
    folders = {posixpath.dirname(image) for image in known & names} - {""}
    beside, lost = sum(posixpath.dirname(name) in folders for name in names - known), len(known - names)
    return [
        *([f"{lost} of {len(known)} images that {lists} names do not exist: their frames were left out"] if lost else []),
        *([f"{beside} files in {min(folders)}/ are not named in {lists} and were left out"] if beside else []),
    ]


def _calibration(files: Files, icl: bool) -> _Calibration:
    """Calibration from a settings file beside the images, else from the sequence's name, else the generic Kinect's.

    The last comes with a notice. The sequence is named in the comments at the head of its lists (`# file:
    'rgbd_dataset_freiburg1_rpy.bag'`), often in its folder's name as well; folders are renamed, so the lists are tried first.
    """
    for name in sorted(n for n in files.names() if "/" not in n and n.endswith((".yaml", ".yml"))):
        text = files.read(name).decode("utf-8", errors="replace")
        found = {k: float(v) for k, v in re.findall(rf"^\s*(?:Camera1?\.)?(fx|fy|cx|cy)\s*:\s*({_NUMBER})", text, re.MULTILINE)}
        if len(found) == 4 and found["fx"] > 0 and found["fy"] > 0:
            factor = re.search(rf"^\s*(?:RGBD\.)?Dep[t]?h?MapFactor\s*:\s*({_NUMBER})", text, re.MULTILINE)
            units = float(factor.group(1)) if factor and float(factor.group(1)) > 1.0 else 5000.0
            return _Calibration((found["fx"], found["fy"], found["cx"], found["cy"]), units, None, name)
    if icl:
        return _Calibration(_ICL_CAMERA, 5000.0, None, None)
    told = (*(_heading(files, name) for name in _NAMED_IN if name in files.names()), str(files.source))
    for name in (name for text in told for name in _KNOWN_CAMERAS if name in text.lower()):
        notice = None if name == "freiburg3" else f"{name}'s colour images are distorted; the lens is treated as ideal"
        return _Calibration(_KNOWN_CAMERAS[name], 5000.0, notice, None)
    return _Calibration(_GENERIC_CAMERA, 5000.0, "no calibration was found: the generic Kinect's 525 px is assumed", None)


def _heading(files: Files, name: str) -> str:
    """The comments before a list's first line."""
    lines = files.read(name).decode("utf-8", errors="replace").splitlines()
    return "\n".join(takewhile(lambda line: not line.strip() or line.lstrip().startswith("#"), lines))


READER = Reader(
    name="TUM RGB-D",
    parts=(
        Part("rgb.txt (or associations.txt)", rf"rgb\.txt|{_ASSOCIATIONS}"),
        Part("depth.txt (or associations.txt)", rf"depth\.txt|{_ASSOCIATIONS}"),
    ),
    open=open_tum,
)
