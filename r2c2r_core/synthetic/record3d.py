"""Writer of Record3D's .r3d: a zip of JPEGs, LZFSE depth and confidence, and one JSON."""

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3

_CAMERA_TYPE_LIDAR = 1
_ZIP_TIME = (2024, 1, 1, 0, 0, 0)  # a fixed date: the same seed gives the same bytes


@dataclass(kw_only=True)
class Record3DWriter:
    """Streaming writer of frames; metadata is written on close."""

    path: Path
    fps: int
    quality: int = 92

    def __post_init__(self) -> None:
        self._zip = zipfile.ZipFile(self.path, "w", zipfile.ZIP_STORED)
        self._poses: list[list[float]] = []
        self._times: list[float] = []
        self._cameras: list[Intrinsics] = []
        self._depth_size = (0, 0)

    def __enter__(self) -> "Record3DWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self._write("metadata", json.dumps(self._metadata()).encode())
        self._zip.close()

    def add(
        self,
        rgb: Image,
        depth_m: np.ndarray,
        confidence: np.ndarray,
        camera: Intrinsics,
        capture_from_camera: Rigid3,
        time_s: float,
    ) -> None:
        """Append a frame; the camera has OpenCV axes, the capture frame is y-up."""
        import lzfse

        number = len(self._poses)
        jpeg = _jpeg(rgb, self.quality)
        if number == 0:
            self._write("icon", _jpeg(np.asarray(cv2.resize(rgb, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)), 85))
        self._write(f"rgbd/{number}.jpg", jpeg)
        self._write(f"rgbd/{number}.depth", lzfse.compress(np.ascontiguousarray(depth_m, dtype="<f4").tobytes()))
        self._write(f"rgbd/{number}.conf", lzfse.compress(np.ascontiguousarray(confidence, dtype=np.uint8).tobytes()))
        self._poses.append(_pose_row(capture_from_camera))
        self._times.append(time_s)
        self._cameras.append(camera)
        self._depth_size = (depth_m.shape[1], depth_m.shape[0])

    def _metadata(self) -> dict[str, object]:
        first = self._cameras[0]
        fx, fy, cx, cy = np.mean([_coefficients(c) for c in self._cameras], axis=0)
        return {
            "w": first.width,
            "h": first.height,
            "dw": self._depth_size[0],
            "dh": self._depth_size[1],
            "fps": self.fps,
            "cameraType": _CAMERA_TYPE_LIDAR,
            "K": [fx, 0, 0, 0, fy, 0, cx, cy, 1],  # column-major
            "perFrameIntrinsicCoeffs": [_coefficients(c) for c in self._cameras],
            "initPose": [0, 0, 0, 1, 0, 0, 0],
            "poses": self._poses,
            "frameTimestamps": self._times,
        }

    def _write(self, name: str, content: bytes) -> None:
        self._zip.writestr(zipfile.ZipInfo(name, _ZIP_TIME), content)


def _coefficients(camera: Intrinsics) -> list[float]:
    """Fx, fy, cx, cy in ARKit's convention: pixel centres at integers."""
    return [round(float(value), 6) for value in (camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5)]


def _pose_row(capture_from_camera: Rigid3) -> list[float]:
    """Qx qy qz qw px py pz of the camera with OpenGL axes (x right, y up, z back)."""
    from scipy.spatial.transform import Rotation

    rotation = capture_from_camera.rotation @ CAMERA_CV_FROM_GL
    quaternion = Rotation.from_matrix(rotation).as_quat()
    return [float(value) for value in (*quaternion, *capture_from_camera.translation)]


def _jpeg(rgb: Image, quality: int) -> bytes:
    done, encoded = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return bytes(encoded)
