"""Recordings with ground truth, of either sample generator: true masks, clicks on the frames that were read, random clicks."""

import json
import shutil
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX, read_mask
from r2c2r_core.evaluate.records import JointRecord, MotionRecord, ObjectRecord, read_truth
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.readers.record3d_metadata import Record3DMetadata, parse_metadata
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.segment.prompts import read_prompts

CLICK_MARGIN_PX = 3  # minimum distance of a click from the mask's border
_WELL_VISIBLE = 0.5  # fraction of the pixels in the frame that shows most of them

TrueMask = Callable[[str, int], Mask | None]


def recording_in(folder: Path) -> Path:
    """The recording's file."""
    return next(path for name in ("scan.r3d", "capture.r3d") if (path := folder / name).exists())


def true_masks(folder: Path) -> TrueMask:
    """True masks of the project's own samples (a folder per object), or of images of object numbers (order of truth.json)."""
    own, numbers = folder / "truth_masks", folder / "masks"
    order = [item["name"] for item in json.loads((folder / "truth.json").read_text())["objects"]]

    @lru_cache(maxsize=256)
    def read(path: Path) -> np.ndarray | None:
        return cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.exists() else None

    def mask(name: str, frame: int) -> Mask | None:
        image = read(own / name / f"{frame:06d}.png" if own.exists() else numbers / f"{frame:06d}.png")
        if image is None:
            return None
        return np.asarray(image > 127) if own.exists() else np.asarray(image == order.index(name) + 1)

    return mask


def write_masks_by_name(folder: Path) -> None:
    """Replace masks/, images of object numbers, by truth_masks/NAME/ as `r2c2r sample` writes them."""
    for number, item in enumerate(json.loads((folder / "truth.json").read_text())["objects"], 1):
        own = folder / "truth_masks" / item["name"]
        own.mkdir(parents=True)
        for path in sorted((folder / "masks").glob("*.png")):
            mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) == number
            if mask.any():
                cv2.imwrite(str(own / path.name), mask.astype(np.uint8) * np.uint8(255))
    shutil.rmtree(folder / "masks")


def clicked(folder: Path, frames: Sequence[int]) -> Prompts:
    """One click per object: its own if that frame was read, else the innermost point in the frame that shows most of it."""
    masks, found = true_masks(folder), []
    for prompt in read_prompts(folder / "prompts.json").objects:
        points = tuple(point for point in prompt.points if point.frame in frames)[:1]
        points = points or _middle(prompt, {frame: masks(prompt.name, frame) for frame in frames})
        if points:
            found.append(ObjectPrompt(name=prompt.name, category=prompt.category, points=points))
    return Prompts(objects=tuple(found))


def random_clicks(folder: Path, rng: np.random.Generator) -> Prompts:
    """One click per object visible in some frame: any pixel of its visible face, in any frame that shows it well.

    The face of an object that opens is the front of its box; of other objects it is the whole visible surface. Clear views and
    central places are not preferred, as people click anywhere.
    """
    source = recording_in(folder)
    with zipfile.ZipFile(source) as archive:
        recorded = parse_metadata(archive.read("metadata"), str(source))
    masks, found = true_masks(folder), []
    for thing in read_truth(folder / "truth.json", Rigid3()):
        shown = [_pixels(masks(thing.name, frame)) for frame in range(len(recorded.poses))]
        well = [f for f, pixels in enumerate(shown) if pixels >= max(MIN_TRUTH_PX, _WELL_VISIBLE * max(shown))]
        points = (_click(thing, recorded, masks, int(frame), rng) for frame in rng.permutation(well))
        if point := next((point for point in points if point is not None), None):
            found.append(ObjectPrompt(name=thing.name, category=thing.category, points=(point,)))
    return Prompts(objects=tuple(found))


def write_prompts(prompts: Prompts, path: Path) -> None:
    """Write clicks as prompts.json."""
    entries = [
        {
            "name": prompt.name,
            "category": prompt.category,
            "points": [{"frame": p.frame, "x": p.x, "y": p.y, "label": p.label} for p in prompt.points],
        }
        for prompt in prompts.objects
    ]
    path.write_text(json.dumps({"version": 1, "objects": entries}, indent=1) + "\n", encoding="utf-8")


def _pixels(mask: Mask | None) -> int:
    return 0 if mask is None else int(np.count_nonzero(mask))


def _click(
    thing: ObjectRecord, recorded: Record3DMetadata, masks: TrueMask, frame: int, rng: np.random.Generator
) -> PromptPoint | None:
    """A pixel of the visible face, not near its border; None if this frame shows no such pixel."""
    mask, pose = masks(thing.name, frame), recorded.poses[frame]
    if mask is None or pose is None:
        return None
    face = mask & _front_pixels(thing, recorded.cameras[frame], pose) if thing.joints else mask
    inside = cv2.distanceTransform(np.pad(face.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1] > CLICK_MARGIN_PX
    if not inside.any():
        return None
    y, x = rng.choice(np.argwhere(inside))
    return PromptPoint(frame=frame, x=float(x) + 0.5, y=float(y) + 0.5, label=1)


def _front_pixels(thing: ObjectRecord, camera: Intrinsics, pose: Rigid3) -> Mask:
    """Pixels whose rays hit the front of the object's box (its -y side) from outside."""
    object_from_camera = thing.world_from_object.inverse @ pose
    half, eye = thing.dimensions_m / 2, object_from_camera.translation
    if eye[1] >= -half[1]:
        return np.zeros((camera.height, camera.width), np.bool_)
    rays = object_from_camera.turn(pixel_rays(pixel_centres(camera), camera).reshape(-1, 3))
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (-half[1] - eye[1]) / rays[:, 1]
        at = eye + reach[:, None] * rays
        within = (reach > 0) & (np.abs(at[:, 0]) < half[0]) & (np.abs(at[:, 2]) < half[2])
    return np.asarray(within.reshape(camera.height, camera.width))


def mask_overlap(folder: Path, name: str, found: Path) -> float:
    """Mean IoU of the masks in `found` (<frame:06d>.png) over the frames that show the object; a missing one counts as 0."""
    masks, overlaps = true_masks(folder), []
    own = folder / "truth_masks" / name
    for frame in sorted(int(path.stem) for path in (own if own.exists() else folder / "masks").glob("*.png")):
        true = masks(name, frame)
        if true is None or np.count_nonzero(true) < MIN_TRUTH_PX:
            continue
        file = found / f"{frame:06d}.png"
        overlaps.append(mask_iou(true, read_mask(file, like=true)) if file.exists() else 0.0)
    return float(np.mean(overlaps)) if overlaps else 0.0


def clicked_overlaps(folder: Path, prompts: Prompts, masks: Path, matched: Mapping[str, str | None]) -> dict[str, float]:
    """`mask_overlap` of every clicked object; `matched` maps it to its name in the bundle, whose masks are in `masks`/NAME."""
    return {each.name: mask_overlap(folder, each.name, masks / (matched.get(each.name) or "-")) for each in prompts.objects}


def _middle(prompt: ObjectPrompt, masks: dict[int, Mask | None]) -> tuple[PromptPoint, ...]:
    shown = {frame: int(np.count_nonzero(mask)) for frame, mask in masks.items() if mask is not None}
    best = max(shown, key=lambda frame: shown[frame], default=None)
    if best is None or shown[best] < MIN_TRUTH_PX:
        return ()
    inside = cv2.distanceTransform(np.pad(np.asarray(masks[best], np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    y, x = np.unravel_index(int(inside.argmax()), inside.shape)
    return (PromptPoint(frame=best, x=float(x), y=float(y), label=1),)


def record_of(item: SceneObject) -> ObjectRecord:
    """A built object as the record that the evaluation reads from a manifest."""
    pose = item.world_from_object
    joints = tuple(
        JointRecord(
            name=joint.name,
            type=joint.type,
            axis=pose.turn(joint.axis_object),
            origin=pose.apply(joint.origin_object),
            lower=joint.lower,
            upper=joint.upper,
            limit_source=joint.sources["limits"],
            motion=None if joint.motion is None else _filmed(joint.motion),
        )
        for joint in item.joints
    )
    return ObjectRecord(
        name=item.name, category=item.category, dimensions_m=item.dimensions_m, world_from_object=pose, joints=joints
    )


def _filmed(motion: JointMotion) -> MotionRecord:
    lengths = {} if motion.inside is None else asdict(motion.inside)
    return MotionRecord(
        states={frame: state.value for frame, state in motion.states.items()},
        shown=frozenset(),
        largest=motion.largest,
        inside={key: value for key, value in lengths.items() if isinstance(value, int | float)},
    )
