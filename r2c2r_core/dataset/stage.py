"""Export of a reconstruction as a dataset for benchmarks of generation and alignment (paper §3).

DIR/
├── manifest.json                    below; written last, so a folder without it is unfinished
├── annotations.json                 COCO: every mask of every object as run lengths (coco.py)
├── cameras.json                     {"frames": [{"frame", "rgb_camera", "depth_camera", "world_from_camera", "timestamp_s"}]}
├── images/<frame:06d>.jpg           colour, byte for byte as recorded
├── depth/<frame:06d>.png            16 bit, steps of 0.25 mm, 0 unknown, at the sensor's resolution, never filled
└── objects/<name>/
    ├── object.json                  category, candidates, the chosen one, its pose with uncertainty and evidence
    ├── masks/<frame:06d>.png        0 or 255, at colour resolution
    ├── candidates/<id>.glb          closed textured meshes, each in an arbitrary frame and unit of its own (`mesh`)
    ├── matches.npz                  n keypoint matches of photos with renders of the chosen candidate: frame_index (n,),
    │                                points_mesh (n, 3), points_world (n, 3) metres, noise_m (n,), inlier (n,)
    └── aligned.glb                  the chosen candidate in `world`: placed by object.json's world_from_mesh, before any fit

Frames (geometry/transforms.py): world is metres, +Z up, floor at 0; cameras look along +Z, +X right, +Y down, pixel centres
at i + 0.5; a camera is {"fx", "fy", "cx", "cy", "width", "height"}. A GLB holds its mesh in the frame named above: nothing
is turned to glTF's +Y up. Matrices are rows. An object without a mesh or a pose lacks those files, and object.json says null.

manifest.json: {"kind": "r2c2r-dataset", "version": 1, "capture": {"name", "sha256", "format", "world_from_capture"},
"objects": [name], "files": {path: {"bytes", "sha256"}}} with every other file of the folder.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from r2c2r_core.dataset.coco import coco_document
from r2c2r_core.errors import InputError
from r2c2r_core.geometry.glb import glb_bytes
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.model.mesh import CandidateSet, MeshAsset
from r2c2r_core.model.placement import Placement, Spread
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress

KIND, VERSION = "r2c2r-dataset", 1
_PICTURE = "images/{:06d}.jpg"


class LabelledObject(NamedTuple):
    """Results of a reconstruction for one object; failed or missing ones are None."""

    track: MaskTrack
    candidates: CandidateSet | None
    placement: Placement | None


class StoredFrames(NamedTuple):
    """Paths of a frame's recorded images, by Frame.index."""

    colour: Callable[[int], Path]  # JPEG
    depth: Callable[[int], Path]  # 16 bit PNG, steps of 0.25 mm


def write_dataset(
    capture: Capture,
    objects: Sequence[LabelledObject],
    stored: StoredFrames,
    destination: Path,
    *,
    progress: Progress = SILENT,
) -> Path:
    """Write the folder `destination` and return its manifest; raises InputError when there is something there already.

    Only frames in which at least one object is labelled are written.
    """
    if destination.exists() and (not destination.is_dir() or any(destination.iterdir())):
        raise InputError(f"{destination}: not an empty folder", hint="name a new folder for the dataset")
    frames = _labelled_frames(capture, objects)
    if not frames:
        raise InputError("no object has a mask in any frame", hint="run the pipeline on this work folder first")
    partial = destination.with_name(f".{destination.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        partial.mkdir(parents=True)
        _write_frames(capture, frames, stored, partial, progress.part(0.0, 0.3))
        _write_json(partial / "annotations.json", coco_document(frames, [item.track for item in objects], _PICTURE))
        for item in progress.part(0.3, 0.9).each(list(objects), "objects"):
            _write_object(item, partial / "objects" / item.track.name)
        progress.at(0.9, "checksums")
        _write_json(partial / "manifest.json", _manifest(capture, objects, partial))
        if destination.exists():
            destination.rmdir()
        partial.replace(destination)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return destination / "manifest.json"


def _labelled_frames(capture: Capture, objects: Sequence[LabelledObject]) -> list[Frame]:
    labelled = {index for item in objects for index, packed in item.track.masks.items() if packed.area_px}
    return [frame for frame in capture.frames if frame.index in labelled]


def _write_frames(capture: Capture, frames: list[Frame], stored: StoredFrames, folder: Path, progress: Progress) -> None:
    for name in ("images", "depth"):
        (folder / name).mkdir()
    for frame in progress.each(frames, "frames"):
        shutil.copyfile(stored.colour(frame.index), folder / _PICTURE.format(frame.index))
        shutil.copyfile(stored.depth(frame.index), folder / "depth" / f"{frame.index:06d}.png")
    entries = [
        {
            "frame": frame.index,
            "timestamp_s": frame.timestamp_s,
            "rgb_camera": asdict(frame.rgb_camera),
            "depth_camera": asdict(frame.depth_camera),
            "world_from_camera": frame.world_from_camera.matrix.tolist(),
        }
        for frame in frames
    ]
    _write_json(folder / "cameras.json", {"frames": entries})


def _write_object(item: LabelledObject, folder: Path) -> None:
    (folder / "masks").mkdir(parents=True)
    for index, packed in item.track.masks.items():
        if packed.area_px:
            _, png = cv2.imencode(".png", unpack_mask(packed).astype(np.uint8) * 255)
            (folder / "masks" / f"{index:06d}.png").write_bytes(png.tobytes())
    candidates = item.candidates.candidates if item.candidates is not None else ()
    for asset in candidates:
        (folder / "candidates").mkdir(exist_ok=True)
        (folder / "candidates" / f"{asset.candidate_id}.glb").write_bytes(_glb(asset, asset.mesh.vertices))
    placed = _placed(item)
    if placed is not None:
        asset, placement = placed
        (folder / "aligned.glb").write_bytes(_glb(asset, placement.world_from_mesh.apply(asset.mesh.vertices)))
        np.savez_compressed(folder / "matches.npz", **asdict(placement.matched))
    _write_json(folder / "object.json", _object_entry(item, placed))


def _placed(item: LabelledObject) -> tuple[MeshAsset, Placement] | None:
    """The placed candidate with its placement; None without one, or if a later run has replaced the candidate."""
    if item.candidates is None or item.placement is None:
        return None
    found = [c for c in item.candidates.candidates if c.candidate_id == item.placement.candidate_id]
    return (found[0], item.placement) if found else None


def _glb(asset: MeshAsset, vertices: np.ndarray) -> bytes:
    return glb_bytes(vertices, asset.mesh.faces, asset.mesh.uv, asset.mesh.texture)


def _object_entry(item: LabelledObject, placed: tuple[MeshAsset, Placement] | None) -> dict[str, Any]:
    track, candidates = item.track, item.candidates
    return {
        "name": track.name,
        "category": track.category,
        "kind": track.kind,
        "segmenter": track.backend,
        "clicks": track.prompt_count,
        "frames": sorted(index for index, packed in track.masks.items() if packed.area_px),
        "candidates": [_candidate_entry(asset) for asset in candidates.candidates] if candidates is not None else [],
        "ranking": list(candidates.ranking) if candidates is not None else [],
        "reason": candidates.reason if candidates is not None else None,
        "placement": _placement_entry(placed[1]) if placed is not None else None,
    }


def _candidate_entry(asset: MeshAsset) -> dict[str, Any]:
    names = ("candidate_id", "generator", "seed", "assumes", "watertight", "frames", "metrics", "parameters", "warnings")
    return {name: getattr(asset, name) for name in names}


def _placement_entry(placement: Placement) -> dict[str, Any]:
    names = (
        "candidate_id",
        "matches",
        "inliers",
        "rms_m",
        "mask_iou",
        "condition",
        "unsure",
        "runner_up",
        "runner_up_turn_deg",
        "method",
        "warnings",
    )
    return {
        "world_from_mesh": placement.world_from_mesh.matrix.tolist(),
        "scale": placement.world_from_mesh.scale,
        **{name: getattr(placement, name) for name in names},
        "spread": _spread_entry(placement.spread) if placement.spread is not None else None,
    }


def _spread_entry(spread: Spread) -> dict[str, Any]:
    """Standard deviations of rotation (degrees), translation (metres) and scale (share), and the axes of the largest ones."""
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in asdict(spread).items()}


def _manifest(capture: Capture, objects: Sequence[LabelledObject], folder: Path) -> dict[str, Any]:
    return {
        "kind": KIND,
        "version": VERSION,
        "capture": {
            "name": capture.name,
            "sha256": capture.sha256,
            "format": capture.format,
            "world_from_capture": capture.world_from_capture.matrix.tolist(),
        },
        "objects": [item.track.name for item in objects],
        "files": dict(_checksums(folder)),
    }


def _checksums(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        with path.open("rb") as handle:
            digest = hashlib.file_digest(handle, "sha256").hexdigest()
        yield path.relative_to(folder).as_posix(), {"bytes": path.stat().st_size, "sha256": digest}


def _write_json(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(_finite(document), indent=None if path.name == "annotations.json" else 1) + "\n")


def _finite(value: Any) -> Any:
    """JSON values with non-finite numbers as null, since JSON has no NaN."""
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        return _finite(value.item())
    return None if isinstance(value, float) and not np.isfinite(value) else value
