"""Typical defects of recordings, applied to good ones; used by the tests and by benchmarks/capture_doctor.py."""

import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import lzfse
import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.camera import Intrinsics, depth_points, project
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL

Pose = np.ndarray  # 4x4, as stored in the file: in the format's own camera axes
Depth = np.ndarray  # metres


@dataclass(frozen=True, kw_only=True)
class Corruption:
    """One defect; `causes` are words with which the doctor may name it first, `refusal` a word of the reader's error."""

    name: str
    causes: tuple[str, ...] = ()
    refusal: str | None = None
    pose: Callable[[int, Pose], Pose] = lambda number, pose: pose
    depth: Callable[[Depth, Intrinsics], Depth] = lambda depth, camera: depth
    focal: float = 1.0
    keep: Callable[[int], bool] = lambda number: True
    truncate: Callable[[int], bool] = lambda number: False
    confidence: int | None = None

    @property
    def only_r3d(self) -> bool:
        """Whether it concerns features of a .r3d only: LZFSE and confidence."""
        return self.confidence is not None or self.truncate(0) or self.truncate(1)


def corrupt_r3d(corruption: Corruption, source: Path, target: Path) -> Path:
    """Write a .r3d with the defect."""
    with zipfile.ZipFile(source) as good, zipfile.ZipFile(target, "w") as bad:
        metadata = json.loads(good.read("metadata"))
        camera = _depth_camera(metadata)
        metadata["poses"] = [_row(corruption.pose(n, _matrix(row))) for n, row in enumerate(metadata["poses"])]
        for k in (0, 4):
            metadata["K"][k] *= corruption.focal
        for row in metadata.get("perFrameIntrinsicCoeffs") or ():
            row[:2] = [value * corruption.focal for value in row[:2]]
        bad.writestr("metadata", json.dumps(metadata))
        for name in good.namelist():
            number = int(name.split("/")[1].split(".")[0]) if name.startswith("rgbd/") else 0
            if name == "metadata" or (name.startswith("rgbd/") and not corruption.keep(number)):
                continue
            content = good.read(name)
            if name.endswith(".depth"):
                content = _depth_bytes(corruption, number, content, camera)
            elif name.endswith(".conf") and corruption.confidence is not None:
                flat = np.full(camera.width * camera.height, corruption.confidence, np.uint8)
                content = lzfse.compress(flat.tobytes())
            bad.writestr(name, content)
    return target


def corrupt_seven_scenes(corruption: Corruption, source: Path, target: Path, *, every: int = 1) -> Path:
    """Write a folder like 7-Scenes with the defect, with every n-th of its frames."""
    k = np.loadtxt(source / "intrinsics_color.txt")
    for name in ("color", "depth", "pose"):
        (target / name).mkdir(parents=True)
    shutil.copy(source / "gravity-direction.txt", target)
    for position, path in enumerate(sorted((source / "color").glob("*.jpg"))[::every]):
        if not corruption.keep(position):
            continue
        shutil.copy(path, target / "color")
        stored = cv2.imread(str(source / "depth" / f"{path.stem}.png"), cv2.IMREAD_UNCHANGED)
        height, width = stored.shape
        camera = Intrinsics(fx=k[0, 0], fy=k[1, 1], cx=k[0, 2] + 0.5, cy=k[1, 2] + 0.5, width=width, height=height)
        depth = corruption.depth(stored.astype(np.float32) / 1000, camera)
        cv2.imwrite(str(target / "depth" / f"{path.stem}.png"), np.rint(depth * 1000).astype(np.uint16))
        pose = corruption.pose(position, np.loadtxt(source / "pose" / f"{path.stem}.txt"))
        np.savetxt(target / "pose" / f"{path.stem}.txt", pose)
    k[:2, :2] *= corruption.focal
    np.savetxt(target / "intrinsics_color.txt", k)
    return target


def shifted_depth(depth: Depth, camera: Intrinsics, right_m: float = 0.03) -> Depth:
    """Unregistered depth: the view of a depth camera that far left of the colour camera, stored as the colour camera's."""
    points = depth_points(depth, camera)[depth > 0] + (right_m, 0.0, 0.0)
    uv = project(points, camera)
    column, row = np.floor(uv).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < camera.width) & (row < camera.height)
    seen = np.full(depth.shape, np.inf, np.float32)
    np.minimum.at(seen, (row[inside], column[inside]), points[inside, 2].astype(np.float32))
    seen[np.isinf(seen)] = 0
    holes = cv2.medianBlur(seen, 3)  # cracks one pixel wide where a surface is magnified
    return np.where(seen > 0, seen, holes)


def _nan(number: int, pose: Pose) -> Pose:
    return np.full((4, 4), np.nan) if number % 3 == 1 else pose


def _reordered(number: int, pose: Pose) -> Pose:
    """Quaternions with w first, where the format has it last."""
    changed = pose.copy()
    changed[:3, :3] = Rotation.from_quat(Rotation.from_matrix(pose[:3, :3]).as_quat()[[3, 0, 1, 2]]).as_matrix()
    return changed


def _drifting(number: int, pose: Pose) -> Pose:
    """Poses that drift by 3 mm per frame."""
    changed = pose.copy()
    changed[:3, 3] += 0.003 * number * np.array([0.6, 0.0, 0.8])
    return changed


_FLIP = np.block([[CAMERA_CV_FROM_GL, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])

CORRUPTIONS: tuple[Corruption, ...] = (
    Corruption(name="poses inverted", causes=("poses_inverted",), pose=lambda _, pose: np.linalg.inv(pose)),
    Corruption(name="OpenGL taken for OpenCV", causes=("camera_axes",), pose=lambda _, pose: pose @ _FLIP),
    Corruption(name="quaternions w first", causes=("quaternion_order",), pose=_reordered),
    Corruption(name="depth x0.9", causes=("depth_scale",), depth=lambda depth, _: depth * np.float32(0.9)),
    Corruption(name="depth /5", causes=("depth_scale",), depth=lambda depth, _: depth / np.float32(5)),
    Corruption(name="depth in mm", causes=("depth_unit",), depth=lambda depth, _: depth * np.float32(1000)),
    Corruption(name="focal length x1.1", causes=("focal_length",), focal=1.1),
    Corruption(name="depth 30 mm beside colour", causes=("unregistered",), depth=shifted_depth),
    Corruption(name="dropped frames", causes=("dropped_frames",), keep=lambda number: number % 10 not in (3, 4, 5)),
    Corruption(name="some NaN poses", causes=("poses_lost",), pose=_nan),
    Corruption(name="poses drift", causes=("drift",), pose=_drifting),
    Corruption(name="some truncated LZFSE", causes=("frames_unreadable",), truncate=lambda number: number % 10 == 1),
    Corruption(name="all LZFSE truncated", refusal="LZFSE", truncate=lambda number: True),
    Corruption(name="zero confidence", causes=("confidence",), confidence=0),
)


def _depth_bytes(corruption: Corruption, number: int, content: bytes, camera: Intrinsics) -> bytes:
    if corruption.truncate(number):
        return content[: len(content) // 2]
    packed = lzfse.decompress(content)
    depth = np.frombuffer(packed, "<f4").reshape(camera.height, camera.width)
    changed = corruption.depth(depth, camera)
    return content if changed is depth else lzfse.compress(changed.astype("<f4").tobytes())


def _depth_camera(metadata: dict) -> Intrinsics:
    k = metadata["K"]
    colour = Intrinsics(fx=k[0], fy=k[4], cx=k[6] + 0.5, cy=k[7] + 0.5, width=metadata["w"], height=metadata["h"])
    return colour.resized(metadata["dw"], metadata["dh"])


def _matrix(row: list[float]) -> Pose:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(row[:4]).as_matrix()
    matrix[:3, 3] = row[4:]
    return matrix


def _row(pose: Pose) -> list[float]:
    if not np.isfinite(pose).all():
        return [float("nan")] * 7
    return [*Rotation.from_matrix(pose[:3, :3]).as_quat(), *pose[:3, 3]]
