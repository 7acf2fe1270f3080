"""File types often mistaken for recordings, with advice on how to export a recording instead."""

from collections.abc import Iterable
from pathlib import PurePath
from typing import NamedTuple

from r2c2r_core.errors import CaptureError


class Foreign(NamedTuple):
    """A file type that is not a recording."""

    what: str
    bring: str  # what to do instead
    endings: tuple[str, ...]

    def refusal(self, where: str, name: str) -> CaptureError:
        """The error for that file; `where` names it, or the folder or zip that it was found in."""
        found = f"{where}: {self.what}" if where.endswith(name) else f"{where}: found {name}, {self.what}"
        return CaptureError(found, hint=self.bring)


_OPEN3D = "Open3D saves its frames: `open3d.t.io.RGBDVideoReader.create(FILE).save_frames(FOLDER)`; bring that folder"
_EXAMPLE = "open3d.examples.reconstruction_system.sensors.azure_kinect_mkv_reader"  # RGBDVideoReader refuses a .mkv
_KINECT = f"Open3D saves its frames: `python -m {_EXAMPLE} --input FILE --output FOLDER`; bring that folder"
_CAMERA = 'and add camera.json: {"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 320, "cy": 240}'
_RAW = "Polycam's Raw data, 3D Scanner App's All data, or record with Record3D or Stray Scanner"
_IMAGES = "its images to color/ and depth/ by number, 16-bit in mm"
_RTABMAP = "`rtabmap-export --images --poses_camera FILE`"
_SENS = (
    "`reader.py --filename FILE --output_path FOLDER --export_depth_images --export_color_images --export_poses "
    "--export_intrinsics`"
)
_ZED = "`ZED_SVO_Export FILE FOLDER 4`, move them to color/ and depth/"
_ARCHIVES = (".rar", ".7z", ".tar", ".gz", ".tgz", ".bz2", ".xz", ".zst")
_FILMS, _PICTURES = (".mp4", ".mov", ".m4v", ".avi", ".webm"), (".heic", ".heif", ".dng", ".jpg", ".jpeg")
_SCENES = (".usdz", ".usd", ".usdc", ".usda", ".glb", ".gltf", ".obj", ".ply", ".stl", ".fbx", ".dae")
_MODELS = (*_SCENES, ".e57", ".las", ".laz", ".pts", ".xyz", ".pcd", ".splat", ".spz")

# In the order in which they are named where a folder holds several kinds.
_KINDS = (
    Foreign("a ROS or RealSense bag", f"{_OPEN3D} (a .bag of a RealSense), or export {_IMAGES}, {_CAMERA}", (".bag",)),
    Foreign("a ROS 2 bag", f"export {_IMAGES}, {_CAMERA}; or record it with RTAB-Map", (".db3", ".mcap")),
    Foreign(
        "a Matroska film, such as an Azure Kinect's recording", f"{_KINECT}; a film without depth cannot be used", (".mkv",)
    ),
    Foreign("a database of RTAB-Map", f"export it: {_RTABMAP}; bring that folder", (".db",)),
    Foreign(
        "ScanNet's packed .sens stream", f"unpack it with ScanNet's SensReader/python: {_SENS}; bring that folder", (".sens",)
    ),
    Foreign("a recording of a ZED camera", f"export left images and 16-bit depth by {_ZED}, {_CAMERA}", (".svo", ".svo2")),
    Foreign("an archive that is not a zip", "unpack it and send the recording's folder as a zip", _ARCHIVES),
    Foreign("a finished 3D model or point cloud, not the recording it was made from", f"export the recording: {_RAW}", _MODELS),
    Foreign("a film without depth", f"bring the whole folder of a recording with depth: {_RAW}", _FILMS),
    Foreign("a picture, without depth beside it", f"bring a recording with depth: {_RAW}", _PICTURES),
)


def foreign(name: PurePath) -> Foreign | None:
    """The known non-recording type of a file name, or None."""
    return next((kind for kind in _KINDS if name.suffix.lower() in kind.endings), None)


def refuse_foreign(name: PurePath) -> None:
    """Raise CaptureError for a file whose name shows that it is not a recording."""
    if kind := foreign(name):
        raise kind.refusal(str(name), name.name)


def foreign_among(names: Iterable[str]) -> tuple[str, Foreign] | None:
    """The file that best shows what a folder contains instead of a recording; None where a name suggests depth."""
    names = sorted(names)
    if any("depth" in name.lower() for name in names):
        return None
    found = [(name, kind) for name in names if (kind := foreign(PurePath(name)))]
    return min(found, key=lambda pair: _KINDS.index(pair[1]), default=None)
