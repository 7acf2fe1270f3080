"""TUM RGB-D: rgb.txt, depth.txt, groundtruth.txt; depth in 1/5000 m registered to colour; world z up; OpenCV camera-to-world.

Also the key-frame layout whose pose file is truth_cam_poses.txt (line i belongs to image i, the clocks differ) and whose
calibration is an ORB-SLAM settings file. Clocks are associated within 20 ms, poses interpolated. Pixel centres lie at integers.
"""

import re
from functools import partial
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import colour_file, depth_file, first_size
from r2c2r_core.ingest.readers.protocol import Part, RawFrame, Reader, Recording
from r2c2r_core.ingest.readers.texts import integer_centred, lines_of
from r2c2r_core.ingest.readers.trajectory import Trajectory

_POSE_FILES = ("groundtruth.txt", "truth_cam_poses.txt")
_APART_S = 0.02
_GAP_S = 0.1  # poses farther apart than this are not interpolated
_KNOWN_CAMERAS = {  # vision.in.tum.de, intrinsic page; fx, fy, cx, cy at 640x480
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
}
_GENERIC_CAMERA = (525.0, 525.0, 319.5, 239.5)


class _Calibration(NamedTuple):
    fx: float
    fy: float
    cx: float
    cy: float
    units_per_metre: float
    notice: str | None
    name: str | None


def open_tum(files: Files) -> Recording:
    """The recording in a TUM RGB-D folder; raises CaptureError."""
    rgb, depth = _image_list(files, "rgb.txt"), _image_list(files, "depth.txt")
    pose_name = next(n for n in _POSE_FILES if n in files.names())
    poses = _pose_rows(files, pose_name)
    calibration = _calibration(files)
    pairs = [(i, _nearest(t, [d for d, _ in depth])) for i, (t, _) in enumerate(rgb)]
    placed, by_line = _pose_of_images(rgb, poses, files, pose_name)
    wanted = [(i, j, placed[i]) for i, j in pairs if j is not None and placed[i] is not None]
    if not wanted:
        raise CaptureError(
            f"{files.source}: {len(rgb)} colour images, {len(depth)} depth images, {len(poses)} poses: "
            f"none agree within {_APART_S * 1000:.0f} ms",
            hint=f"check the clocks of rgb.txt, depth.txt and {pose_name}",
        )
    size = first_size(files, (rgb[i][1] for i, _, _ in wanted), "colour image")
    depth_size = first_size(files, (depth[j][1] for _, j, _ in wanted), "depth image")
    camera = integer_centred(calibration.fx, calibration.fy, calibration.cx, calibration.cy, size)
    notices = [n for n in (calibration.notice,) if n]
    if by_line:
        notices.append(f"the clocks of rgb.txt and {pose_name} differ, their counts agree: poses are matched by line")
    if len(wanted) < len(rgb):
        notices.append(f"{len(rgb) - len(wanted)} of {len(rgb)} images have no depth or pose within 20 ms and were left out")
    others = ["rgb.txt", "depth.txt", pose_name, *([calibration.name] if calibration.name else [])]
    return Recording(
        format="TUM RGB-D",
        files=files,
        frames=tuple(
            RawFrame(
                index=i,
                timestamp_s=poses[i, 0] - poses[0, 0] if by_line else rgb[i][0] - rgb[0][0],
                rgb_camera=camera,
                depth_camera=camera.resized(*depth_size),
                capture_from_camera=pose,
                rgb_name=rgb[i][1],
                depth_name=depth[j][1],
            )
            for i, j, pose in wanted
            if pose is not None
        ),
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, calibration.units_per_metre),
        up_capture=np.array([0.0, 0.0, 1.0]),
        notices=tuple(notices),
        other_names=tuple(others),
    )


def _pose_of_images(
    rgb: list[tuple[float, str]], poses: np.ndarray, files: Files, pose_name: str
) -> tuple[list[Rigid3 | None], bool]:
    """A pose for each image, by clock; by line where the clocks have nothing in common and the counts agree."""
    trajectory = Trajectory(poses[:, 0], [_rigid(row[1:]) for row in poses])
    placed = [trajectory.at(t, apart_s=_APART_S, gap_s=_GAP_S) for t, _ in rgb]
    if any(p is not None for p in placed):
        return placed, False
    if len(rgb) != len(poses):
        raise CaptureError(
            f"{files.source}: {len(rgb)} images and {len(poses)} poses, and their clocks share no time ({pose_name})",
            hint="the pose file belongs to another recording",
        )
    return list(trajectory.poses), True


def _rigid(row: np.ndarray) -> Rigid3:
    from scipy.spatial.transform import Rotation

    return Rigid3(Rotation.from_quat(row[3:]).as_matrix(), row[:3].copy())


def _pose_rows(files: Files, name: str) -> np.ndarray:
    """Rows `t x y z qx qy qz qw`, by time; unusable ones left out."""
    rows = []
    for line in (text.split() for text in lines_of(files, name)):
        try:
            row = [float(word) for word in line]
        except ValueError:
            continue
        if len(row) >= 8 and np.isfinite(row[:8]).all() and 0.5 < np.linalg.norm(row[4:8]) < 2.0:
            rows.append(row[:8])
    if not rows:
        raise CaptureError(f"{files.source}/{name}: no line of the form 't x y z qx qy qz qw'", hint="check the pose file")
    table = np.array(rows)
    return table[np.argsort(table[:, 0], kind="stable")]


def _image_list(files: Files, name: str) -> list[tuple[float, str]]:
    images = []
    for line in (text.split() for text in lines_of(files, name)):
        try:
            images.append((float(line[0]), line[1]))
        except (ValueError, IndexError) as problem:
            raise CaptureError(f"{files.source}/{name}: line '{' '.join(line)}'", hint="expected 'time filename'") from problem
    present = [(t, n) for t, n in images if n in files.names()]
    if not present:
        found = f"none of the {len(images)} files it names exist" if images else "it names no file"
        raise CaptureError(f"{files.source}/{name}: {found}", hint="copy the images beside it")
    return images if len(present) == len(images) else present


def _nearest(time_s: float, others_s: list[float]) -> int | None:
    index = int(np.argmin(np.abs(np.array(others_s) - time_s)))
    return index if abs(others_s[index] - time_s) <= _APART_S else None


def _calibration(files: Files) -> _Calibration:
    """From a settings file beside the images, else from the sequence's name, else the generic Kinect's, with a notice."""
    for name in sorted(n for n in files.names() if "/" not in n and n.endswith((".yaml", ".yml"))):
        text = files.read(name).decode("utf-8", errors="replace")
        found = {k: float(v) for k, v in re.findall(r"^\s*(?:Camera1?\.)?(fx|fy|cx|cy)\s*:\s*([-+.\deE]+)", text, re.MULTILINE)}
        if len(found) == 4 and found["fx"] > 0 and found["fy"] > 0:
            factor = re.search(r"^\s*(?:RGBD\.)?Dep[t]?h?MapFactor\s*:\s*([-+.\deE]+)", text, re.MULTILINE)
            units = float(factor.group(1)) if factor and float(factor.group(1)) > 1.0 else 5000.0
            return _Calibration(found["fx"], found["fy"], found["cx"], found["cy"], units, None, name)
    for name, camera in _KNOWN_CAMERAS.items():
        if name in str(files.source).lower():
            notice = None if name == "freiburg3" else f"{name}'s colour images are distorted; the lens is treated as ideal"
            return _Calibration(*camera, 5000.0, notice, None)
    return _Calibration(*_GENERIC_CAMERA, 5000.0, "no calibration was found: the generic Kinect's 525 px is assumed", None)


READER = Reader(
    name="TUM RGB-D",
    parts=(
        Part("rgb.txt", r"rgb\.txt"),
        Part("depth.txt", r"depth\.txt"),
        Part(_POSE_FILES[0], "|".join(re.escape(name) for name in _POSE_FILES)),
    ),
    open=open_tum,
)
