"""Evaluation of a dataset (see the dataset stage) against truth: its masks and aligned meshes.

Aligned meshes are scored by extents and centre along the true object's axes, box IoU, and yaw modulo 90 degrees, since a
mesh alone does not determine its front. Extents omit half a percent of the surface on each side, so that a handle's tip
counts as little as in the truth, whose boxes exclude handles.
"""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.disk import is_below
from r2c2r_core.documents import read_json
from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.extents import extent_errors
from r2c2r_core.evaluate.iou import mask_errors, mask_not_given
from r2c2r_core.evaluate.pose import pose_errors
from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.evaluate.shape import shape_errors
from r2c2r_core.evaluate.stage import Evaluation, ObjectRow, scene_metrics
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.meshes import face_normals, sample_surface
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.report import Metric
from r2c2r_core.texts import fault_of

_KIND, _VERSION = "r2c2r-dataset", 1
_SAMPLES = 20_000
_TRIM = 0.5  # percent of the surface at each end


def is_dataset(path: Path) -> bool:
    """Whether a folder is a dataset rather than a bundle."""
    try:
        return bool(read_json(path / "manifest.json", BundleError, hint="").get("kind") == _KIND)
    except (BundleError, AttributeError):
        return False


def evaluate_dataset(folder: Path, truth: Path) -> Evaluation:
    """Compare a dataset with truth.json and with truth_masks/ beside it; raises BundleError for a damaged file of either."""
    manifest = read_manifest(folder)
    truths = read_truth(truth, _world_from_capture(manifest, folder))
    found = {name: _aligned_box(folder, name) for name in manifest["objects"]}
    rows = tuple(_row(true, folder, found, truth.parent / "truth_masks") for true in truths)
    surplus = tuple(name for name in found if name not in {true.name for true in truths})
    return Evaluation(rows=rows, scene=scene_metrics(rows), surplus=surplus)


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest, with all its files verified; raises BundleError naming the first missing or damaged one."""
    path = folder / "manifest.json"
    try:
        manifest = read_json(path, BundleError, hint="write it with r2c2r dataset")
        version, files = manifest["version"], {str(k): str(v["sha256"]) for k, v in manifest["files"].items()}
        known = [str(name) for name in manifest["objects"]]
    except (KeyError, TypeError, AttributeError) as error:
        raise BundleError(
            f"{path}: not a dataset's manifest ({fault_of(error)})", hint="write it with r2c2r dataset"
        ) from error
    if version != _VERSION:
        raise BundleError(f"{path}: version {version}, expected {_VERSION}", hint="write it again with r2c2r dataset")
    for name, sha256 in files.items():
        member = folder / name
        if not is_below(member, folder):
            raise BundleError(f"{path}: '{name}' lies outside the dataset")
        if not member.is_file():
            raise BundleError(f"{member}: missing, but listed in the manifest", hint="copy the dataset again")
        with member.open("rb") as handle:
            if hashlib.file_digest(handle, "sha256").hexdigest() != sha256:
                raise BundleError(f"{member}: its checksum differs from the manifest's", hint="copy the dataset again")
    return {**manifest, "objects": known}


def _world_from_capture(manifest: dict[str, Any], folder: Path) -> Rigid3:
    try:
        return Rigid3.from_matrix(np.asarray(manifest["capture"]["world_from_capture"], dtype=np.float64).reshape(4, 4))
    except (KeyError, TypeError, ValueError) as error:
        raise BundleError(f"{folder / 'manifest.json'}: world_from_capture is not a 4x4 matrix") from error


def _aligned_box(folder: Path, name: str) -> ObjectRecord | None:
    """The upright box of an object's aligned mesh, with yaw modulo 90 degrees; None where there is no mesh."""
    path = folder / "objects" / name / "aligned.glb"
    if not path.is_file():
        return None
    points, normals = _surface_points(path)
    box = upright_box(points, normals, trim=_TRIM / 100)
    return ObjectRecord(name=name, category="", dimensions_m=box.size_m, world_from_object=box.world_from_box, joints=())


def _surface_points(path: Path) -> tuple[Points, Points]:
    """Points sampled evenly on a mesh file's surface, and their normals."""
    import trimesh

    try:
        mesh = trimesh.load_scene(path).to_geometry()
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # trimesh's parser may raise anything on damaged bytes
        raise BundleError(f"{path}: not a readable GLB ({error})", hint="write the dataset again") from error
    points, face = sample_surface(vertices, faces, _SAMPLES, np.random.default_rng(0))
    return points, face_normals(vertices, faces)[face]


def _row(true: ObjectRecord, folder: Path, found: dict[str, ObjectRecord | None], truth_masks: Path) -> ObjectRow:
    if true.name not in found:
        return ObjectRow(name=true.name, category=true.category, matched=None, metrics=())
    box = found[true.name]
    metrics: list[Metric] = []
    if box is not None:
        turned = _turned_like(box, true)
        metrics += [*extent_errors(true, turned), *pose_errors(true, turned), *shape_errors(true, turned)]
    if (truth_masks / true.name).is_dir():
        metrics += mask_errors(truth_masks / true.name, folder / "objects" / true.name / "masks")
    else:
        metrics += mask_not_given("the truth has no masks")
    return ObjectRow(name=true.name, category=true.category, matched=true.name, metrics=tuple(metrics))


def _turned_like(box: ObjectRecord, true: ObjectRecord) -> ObjectRecord:
    """The same box with axes ordered as the truth's: the nearest of its four quarter turns."""
    turns = [rotation_about_z(k * np.pi / 2) for k in range(4)]
    likeness = [np.trace(true.world_from_object.rotation.T @ box.world_from_object.rotation @ turn) for turn in turns]
    best = int(np.argmax(likeness))
    sizes = box.dimensions_m[[1, 0, 2]] if best % 2 else box.dimensions_m
    pose = box.world_from_object
    return replace(box, dimensions_m=sizes, world_from_object=Rigid3(pose.rotation @ turns[best], pose.translation))
