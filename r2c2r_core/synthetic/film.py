"""Frames and true masks of a stored Record3D recording with known truth."""

import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3


@dataclass(frozen=True, kw_only=True)
class Film:
    """Frames of a recording whose capture frame has y up."""

    archive: zipfile.ZipFile
    cameras: Sequence[Intrinsics]  # of the colour images
    poses: Sequence[Rigid3]  # capture_from_camera, OpenCV axes
    depth_size: tuple[int, int]  # width, height
    fps: int

    @classmethod
    def read(cls, path: Path) -> "Film":
        """Open a recording."""
        from scipy.spatial.transform import Rotation

        archive = zipfile.ZipFile(path)
        said = json.loads(archive.read("metadata"))
        turns = Rotation.from_quat([row[:4] for row in said["poses"]]).as_matrix() @ CAMERA_CV_FROM_GL
        cameras = [
            Intrinsics(fx=fx, fy=fy, cx=cx + 0.5, cy=cy + 0.5, width=said["w"], height=said["h"])
            for fx, fy, cx, cy in said["perFrameIntrinsicCoeffs"]
        ]
        poses = [Rigid3(turn, np.array(row[4:])) for turn, row in zip(turns, said["poses"], strict=True)]
        return cls(archive=archive, cameras=cameras, poses=poses, depth_size=(said["dw"], said["dh"]), fps=said["fps"])

    def depth_camera(self, frame: int) -> Intrinsics:
        """The colour camera at the size of the depth image."""
        return self.cameras[frame].resized(*self.depth_size)

    def colour(self, frame: int) -> Image:
        """Colour image (h, w, 3)."""
        stored = np.frombuffer(self.archive.read(f"rgbd/{frame}.jpg"), np.uint8)
        return np.asarray(cv2.cvtColor(cv2.imdecode(stored, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB))

    def depth_m(self, frame: int) -> np.ndarray:
        """Depth image (h, w), 0 where unknown."""
        import lzfse

        values = np.frombuffer(lzfse.decompress(self.archive.read(f"rgbd/{frame}.depth")), "<f4")
        return np.nan_to_num(values.reshape(self.depth_size[::-1]))


@dataclass(frozen=True, kw_only=True)
class TrueMasks:
    """True masks beside a recording, NAME/NNNNNN.png in a folder."""

    folder: Path
    names: Sequence[str]  # of the objects, in the order of truth.json
    size: tuple[int, int]  # height, width of the images

    def read(self, frame: int) -> np.ndarray:
        """Number of the object in each pixel (h, w), from 1; 0 where there is none."""
        numbers = np.zeros(self.size, np.uint8)
        for number, name in enumerate(self.names, 1):
            path = self.folder / name / f"{frame:06d}.png"
            if path.exists():
                mask = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)) > 127
                numbers = numbers[-len(mask) :]
                numbers[mask] = number
        return numbers

    def write(self, frame: int, numbers: np.ndarray) -> None:
        """Replace the masks of a frame."""
        for number, name in enumerate(self.names, 1):
            path, mask = self.folder / name / f"{frame:06d}.png", numbers == number
            path.unlink(missing_ok=True)
            if mask.any():
                path.parent.mkdir(exist_ok=True)
                cv2.imwrite(str(path), mask.astype(np.uint8) * np.uint8(255))
