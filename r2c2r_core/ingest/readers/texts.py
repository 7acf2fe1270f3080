"""Numbers in text files: matrices, poses and cameras as the folder formats write them."""

import csv
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.documents import parse_json
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3, nearest_rotation
from r2c2r_core.ingest.files import Files

GRAVITY = "gravity-direction.txt"  # of 7-Scenes and 3DMatch folders
S = TypeVar("S")
T = TypeVar("T")


def read_numbers(content: bytes) -> np.ndarray | None:
    """All numbers of a text, in order; None when a word is not one."""
    try:
        return np.array([float(word) for word in content.decode().replace(",", " ").split()])
    except ValueError:  # UnicodeDecodeError is one too
        return None


def gravity_up(files: Files, name: str) -> Vector3 | None:
    """Up by a text of three numbers that point down; None without that file. Raises CaptureError."""
    if name not in files.names():
        return None
    down = read_numbers(files.read(name))
    if down is None or down.size != 3 or not 1e-6 < np.linalg.norm(down) < np.inf:  # a length may overflow, too
        raise CaptureError(f"{files.source}/{name}: expected three numbers pointing down", hint="correct or remove the file")
    return np.asarray(-down / np.linalg.norm(down))


def finite_numbers(value: Any, shape: tuple[int, ...]) -> np.ndarray | None:
    """The numbers of a JSON value, as an array of that shape; None when they are not that, or not all finite."""
    try:
        numbers = np.atleast_1d(np.array(value, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):  # words, objects, rows of different lengths
        return None
    return numbers if numbers.shape == shape and np.isfinite(numbers).all() else None


def pose_of_matrix(matrix: np.ndarray, camera_axes: Matrix3 | None = None) -> Rigid3 | None:
    """The pose in a (3 or 4, 4) matrix, for cameras whose axes `camera_axes` turns into ours; None when it is no pose."""
    rotation = matrix[:3, :3]
    if not np.isfinite(matrix[:3]).all() or abs(np.linalg.det(rotation) - 1.0) > 0.05:
        return None
    return Rigid3(nearest_rotation(rotation if camera_axes is None else rotation @ camera_axes), matrix[:3, 3].copy())


def pose_of_quaternion(numbers: np.ndarray, camera_axes: Matrix3 | None = None) -> Rigid3 | None:
    """The pose in [x, y, z, qx, qy, qz, qw]; None when the numbers are not finite or the quaternion has no length."""
    from scipy.spatial.transform import Rotation

    if not np.isfinite(numbers).all() or not 0.5 < np.linalg.norm(numbers[3:7]) < 2.0:
        return None
    rotation = Rotation.from_quat(numbers[3:7]).as_matrix()
    return Rigid3(nearest_rotation(rotation if camera_axes is None else rotation @ camera_axes), numbers[:3].copy())


def read_calibration(files: Files, name: str, size: tuple[int, int]) -> Intrinsics:
    """The camera of a 3x3 or 4x4 calibration matrix with pixel centres at integers; raises CaptureError."""
    numbers = read_numbers(files.read(name))
    camera = camera_of(numbers if numbers is None or numbers.size != 16 else numbers.reshape(4, 4)[:3, :3], size)
    if camera is None:
        raise CaptureError(f"{files.source}/{name}: expected a 3x3 calibration matrix", hint="write fx 0 cx / 0 fy cy / 0 0 1")
    return camera


def camera_of(matrix: np.ndarray | None, size: tuple[int, int]) -> Intrinsics | None:
    """The camera of nine numbers, row by row, with pixel centres at integers; None when they are no calibration."""
    if matrix is None or matrix.size != 9 or not np.isfinite(matrix).all() or min(size) < 1:
        return None
    fx, _, cx, _, fy, cy = matrix.ravel()[:6]
    return integer_centred(fx, fy, cx, cy, size) if min(fx, fy) > 0 else None


def integer_centred(fx: float, fy: float, cx: float, cy: float, size: tuple[int, int]) -> Intrinsics:
    """A camera whose format puts pixel centres at integers, in our convention; `size` is (width, height)."""
    return Intrinsics(
        fx=float(fx), fy=float(fy), cx=float(cx) + 0.5, cy=float(cy) + 0.5, width=int(size[0]), height=int(size[1])
    )


def tried(read: Callable[[Files, S], T], files: Files, name: S) -> T | None:
    """Content of one frame's file; None when it is damaged, which costs that frame and not the recording."""
    try:
        return read(files, name)
    except CaptureError:
        return None


def read_json_object(files: Files, name: str) -> dict[str, Any]:
    """A JSON object; raises CaptureError."""
    return parse_json_object(files.read(name), f"{files.source}/{name}")


def parse_json_object(content: bytes, source: str) -> dict[str, Any]:
    """A JSON object; `source` names it in messages. Raises CaptureError."""
    hint = "export the recording again"
    document = parse_json(content, source, CaptureError, hint=hint, lenient=True)
    if not isinstance(document, dict):
        raise CaptureError(f"{source}: a JSON {type(document).__name__}, an object was expected", hint=hint)
    return document


def lines_of(files: Files, name: str) -> list[str]:
    """The lines of a text that are neither empty nor comments."""
    text = files.read(name).decode("utf-8", errors="replace")
    return [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]


def read_table(files: Files, name: str, needed: tuple[str, ...]) -> list[dict[str, float]]:
    """The rows of a CSV by the names in its first line; a value that is no number is NaN. Raises CaptureError."""
    try:
        header, *lines = csv.reader(lines_of(files, name) or [""], skipinitialspace=True)
    except csv.Error as problem:
        raise CaptureError(f"{files.source}/{name}: {problem}", hint="copy the recording again") from problem
    columns = [column.strip() for column in header]
    if lacking := [column for column in needed if column not in columns]:
        raise CaptureError(
            f"{files.source}/{name}: no column {', '.join(lacking)} among {', '.join(columns)[:80] or 'none'}",
            hint="the first line names the columns",
        )
    absent = dict.fromkeys(columns, np.nan)
    return [absent | {c: _number(value) for c, value in zip(columns, line, strict=False)} for line in lines]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan
