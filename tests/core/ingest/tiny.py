"""Tiny recordings of a room with a box, written in each format's layout; depth is exact, by ray casting."""

import json
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import lzfse
import numpy as np
import OpenEXR
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.camera import Intrinsics, pixel_centres
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3, rotation_about_z

YUP_FROM_ZUP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # ARKit's world from ours


@dataclass(frozen=True)
class TinyRoom:
    """Floor z = 0, walls at x = 1.6 and y = 1.4 of a room turned by `yaw_rad`, and a box on the floor."""

    yaw_rad: float = 0.3
    count: int = 12
    rgb_size: tuple[int, int] = (96, 128)  # width, height: portrait
    depth_size: tuple[int, int] = (48, 64)
    focal: float = 92.0  # at RGB resolution
    box: tuple[np.ndarray, np.ndarray] = field(default_factory=lambda: (np.array([0.9, 0.6, 0.0]), np.array([1.5, 1.2, 0.8])))

    @property
    def camera(self) -> Intrinsics:
        """The RGB camera, off-centre, in our pixel convention."""
        width, height = self.rgb_size
        return Intrinsics(fx=self.focal, fy=self.focal, cx=width / 2 + 1.5, cy=height / 2 - 2.0, width=width, height=height)

    @property
    def depth_camera(self) -> Intrinsics:
        """The depth camera: the RGB camera at another size."""
        return self.camera.resized(*self.depth_size)

    def poses(self) -> list[Rigid3]:
        """world_from_camera (world: +Z up) along a walk that looks into the corner."""
        poses = []
        for k in range(self.count):
            share = k / max(self.count - 1, 1)
            eye = np.array([-0.8 + 0.9 * share, -0.7 + 0.25 * np.sin(3 * share), 1.35 + 0.1 * share])
            target = np.array([1.2 - 0.3 * share, 0.7 + 0.4 * share, 0.55])
            forward = (target - eye) / np.linalg.norm(target - eye)
            right = np.cross(forward, [0.0, 0.0, 1.0])
            right /= np.linalg.norm(right)
            rotation = np.column_stack([right, np.cross(forward, right), forward])
            turn = rotation_about_z(self.yaw_rad)
            poses.append(Rigid3(turn @ rotation, turn @ eye))
        return poses

    def depth(self, pose: Rigid3, camera: Intrinsics) -> np.ndarray:
        """Exact z-depth, float32 metres."""
        return self._cast(pose, camera)[0]

    def image(self, pose: Rigid3, camera: Intrinsics) -> np.ndarray:
        """BGR picture with a texture that is fixed to the surfaces."""
        _, points = self._cast(pose, camera)
        waves = [np.sin(points @ np.array(k)) for k in ((9.0, 4.0, 7.0), (-5.0, 8.0, 11.0), (13.0, -6.0, 3.0))]
        return (127 + 60 * np.stack(waves, axis=-1)).astype(np.uint8)

    def _cast(self, pose: Rigid3, camera: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
        room_from_camera = Rigid3(rotation_about_z(-self.yaw_rad), np.zeros(3)) @ pose
        uv = pixel_centres(camera)
        rays = np.stack([(uv[..., 0] - camera.cx) / camera.fx, (uv[..., 1] - camera.cy) / camera.fy, np.ones(uv.shape[:2])], -1)
        directions, eye = rays @ room_from_camera.rotation.T, room_from_camera.translation
        with np.errstate(divide="ignore", invalid="ignore"):
            planes = [
                (0.0 - eye[2]) / directions[..., 2],
                (1.6 - eye[0]) / directions[..., 0],
                (1.4 - eye[1]) / directions[..., 1],
            ]
            depth = np.min([np.where(t > 0, t, np.inf) for t in planes], axis=0)
            near, far = ((corner - eye) / directions for corner in self.box)
        enter, leave = np.minimum(near, far).max(axis=-1), np.maximum(near, far).min(axis=-1)
        depth = np.where((enter > 0) & (enter < leave), np.minimum(depth, enter), depth)
        return depth.astype(np.float32), eye + directions * depth[..., None]


def write_r3d(path: Path, room: TinyRoom, **changes: object) -> Path:
    """A `.r3d` of the newer app. `changes`: metadata keys to replace, or to drop with None; `raw`, `conf`, `nan`, `skip`."""
    raw, nan, skip = changes.pop("raw", False), changes.pop("nan", False), changes.pop("skip", ())
    conf = changes.pop("conf", 2)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", json.dumps(_metadata(room, changes)))
        archive.writestr("icon", jpeg(np.zeros((8, 8, 3), np.uint8)))
        for k, pose in enumerate(room.poses()):
            if k in skip:
                continue
            depth = room.depth(pose, room.depth_camera)
            if nan:
                depth[:4, :4] = np.nan
            confidence = conf(depth) if callable(conf) else np.full(depth.shape, conf or 0, np.uint8)
            archive.writestr(f"rgbd/{k}.jpg", jpeg(room.image(pose, room.camera)))
            packed = depth.astype("<f4").tobytes()
            archive.writestr(f"rgbd/{k}.depth", packed if raw else lzfse.compress(packed))
            if conf is not None:
                archive.writestr(f"rgbd/{k}.conf", lzfse.compress(confidence.astype(np.uint8).tobytes()))
    return path


def write_exr(folder: Path, room: TinyRoom, **changes: object) -> Path:
    """Record3D's EXR + JPG export."""
    skip = changes.pop("skip", ())
    (folder / "rgb").mkdir(parents=True)
    (folder / "depth").mkdir()
    (folder / "metadata.json").write_text(json.dumps(_metadata(room, changes)))
    for k, pose in enumerate(room.poses()):
        if k in skip:
            continue
        (folder / "rgb" / f"{k}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        half = room.depth(pose, room.depth_camera).astype(np.float16)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"R": half}).write(str(folder / "depth" / f"{k}.exr"))
    return folder


def write_seven_scenes(folder: Path, room: TinyRoom, *, gravity: bool = True, stride: int = 5) -> Path:
    """The layout of the real kitchen; its world is tilted, its depth has the colour image's size."""
    world = Rigid3(Rotation.from_euler("xyz", [70.0, 12.0, -25.0], degrees=True).as_matrix(), np.array([0.3, -1.0, 2.0]))
    for name in ("color", "depth", "pose"):
        (folder / name).mkdir(parents=True)
    for k, pose in enumerate(room.poses()):
        number = f"{k * stride:06d}"
        (folder / "color" / f"{number}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        millimetres = np.rint(room.depth(pose, room.camera) * 1000).astype(np.uint16)
        millimetres[0, :5] = (0, 65535, 0, 65535, 0)
        cv2.imwrite(str(folder / "depth" / f"{number}.png"), millimetres)
        np.savetxt(folder / "pose" / f"{number}.txt", (world @ pose).matrix)
    np.savetxt(folder / "intrinsics_color.txt", integer_centred(room.camera))
    if gravity:
        np.savetxt(folder / "gravity-direction.txt", world.rotation @ [0.0, 0.0, -1.0])
    return folder


def write_tum(folder: Path, room: TinyRoom, *, pose_clock_offset_s: float = 0.006) -> Path:
    """The standard TUM layout: three clocks, poses every 30 ms that must be interpolated."""
    (folder / "rgb").mkdir(parents=True)
    (folder / "depth").mkdir()
    start, rgb_lines, depth_lines = 1305031102.175304, ["# color images"], ["# depth maps"]
    for k, pose in enumerate(room.poses()):
        time_s = start + 0.03 * k
        cv2.imwrite(str(folder / "rgb" / f"{time_s:.6f}.png"), room.image(pose, room.camera))
        cv2.imwrite(
            str(folder / "depth" / f"{time_s + 0.011:.6f}.png"), np.rint(room.depth(pose, room.camera) * 5000).astype(np.uint16)
        )
        rgb_lines.append(f"{time_s:.6f} rgb/{time_s:.6f}.png")
        depth_lines.append(f"{time_s + 0.011:.6f} depth/{time_s + 0.011:.6f}.png")
    (folder / "rgb.txt").write_text("\n".join(rgb_lines))
    (folder / "depth.txt").write_text("\n".join(depth_lines))
    (folder / "groundtruth.txt").write_text("\n".join(_tum_poses(room, start, pose_clock_offset_s)))
    matrix = integer_centred(room.camera)
    keys = {"fx": matrix[0, 0], "fy": matrix[1, 1], "cx": matrix[0, 2], "cy": matrix[1, 2]}
    settings = "\n".join(f"Camera.{k}: {v}" for k, v in keys.items())
    (folder / "settings.yaml").write_text(f"%YAML:1.0\n{settings}\nDepthMapFactor: 5000.0\n")
    return folder


def jpeg(bgr: np.ndarray) -> bytes:
    """JPEG bytes."""
    return cv2.imencode(".jpg", bgr)[1].tobytes()


def integer_centred(camera: Intrinsics) -> np.ndarray:
    """The calibration matrix as the formats store it: pixel centres at integers."""
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= 0.5
    return matrix


def zip_folder(folder: Path, path: Path, *, top: str = "") -> Path:
    """A zip of a folder, optionally below a folder of that name."""
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                archive.write(file, f"{top}{file.relative_to(folder)}")
    return path


def arkit_rows(poses: list[Rigid3]) -> list[list[float]]:
    """[qx, qy, qz, qw, x, y, z] with OpenGL camera axes in a y-up world."""
    return [
        [*Rotation.from_matrix(YUP_FROM_ZUP @ p.rotation @ CAMERA_CV_FROM_GL).as_quat(), *(YUP_FROM_ZUP @ p.translation)]
        for p in poses
    ]


def _metadata(room: TinyRoom, changes: dict[str, object]) -> dict[str, object]:
    matrix = integer_centred(room.camera)
    metadata: dict[str, object] = {
        "w": room.rgb_size[0],
        "h": room.rgb_size[1],
        "dw": room.depth_size[0],
        "dh": room.depth_size[1],
        "fps": 60,
        "K": matrix.T.ravel().tolist(),  # column-major
        "poses": arkit_rows(room.poses()),
        "initPose": [0, 0, 0, 1, 0, 0, 0],
        "frameTimestamps": [k / 60 for k in range(room.count)],
        "cameraType": 1,
    }
    metadata.update(changes)
    return {k: v for k, v in metadata.items() if v is not None}


def _tum_poses(room: TinyRoom, start: float, offset_s: float) -> list[str]:
    """Poses of a smooth walk, sampled at times offset from the images' clock by moving along each step."""
    from scipy.spatial.transform import Slerp

    poses = room.poses()
    times = np.arange(len(poses)) * 0.03
    slerp = Slerp(times, Rotation.from_matrix(np.array([p.rotation for p in poses])))
    centres = np.array([p.translation for p in poses])
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for time_s in (times[0], *np.arange(offset_s, times[-1], 0.01), times[-1]):
        centre = [np.interp(time_s, times, centres[:, axis]) for axis in range(3)]
        numbers = [*centre, *slerp(time_s).as_quat()]
        lines.append(f"{start + time_s:.6f} " + " ".join(f"{n:.9f}" for n in numbers))
    return lines
