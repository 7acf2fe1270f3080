"""Recordings with a truth, of either sample generator: their true masks, and clicks on the frames that were read."""

import json
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX
from r2c2r_core.evaluate.records import JointRecord, ObjectRecord
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.segment.prompts import read_prompts

TrueMask = Callable[[str, int], Mask | None]


def recording_in(folder: Path) -> Path:
    """The recording's file."""
    return next(path for name in ("scan.r3d", "capture.r3d") if (path := folder / name).exists())


def true_masks(folder: Path) -> TrueMask:
    """Of the project's own samples (a folder an object) or of images of object numbers, in the order of truth.json."""
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


def clicked(folder: Path, frames: Sequence[int]) -> Prompts:
    """One click an object: its own where that frame was read, else the middle of it in the frame that shows most of it."""
    masks, found = true_masks(folder), []
    for prompt in read_prompts(folder / "prompts.json").objects:
        points = tuple(point for point in prompt.points if point.frame in frames)[:1]
        points = points or _middle(prompt, {frame: masks(prompt.name, frame) for frame in frames})
        if points:
            found.append(ObjectPrompt(name=prompt.name, category=prompt.category, points=points))
    return Prompts(objects=tuple(found))


def _middle(prompt: ObjectPrompt, masks: dict[int, Mask | None]) -> tuple[PromptPoint, ...]:
    shown = {frame: int(np.count_nonzero(mask)) for frame, mask in masks.items() if mask is not None}
    best = max(shown, key=lambda frame: shown[frame], default=None)
    if best is None or shown[best] < MIN_TRUTH_PX:
        return ()
    inside = cv2.distanceTransform(np.pad(np.asarray(masks[best], np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    y, x = np.unravel_index(int(inside.argmax()), inside.shape)
    return (PromptPoint(frame=best, x=float(x), y=float(y), label=1),)


def record_of(item: SceneObject) -> ObjectRecord:
    """As the evaluation reads it."""
    joints = tuple(
        JointRecord(
            name=joint.name,
            type=joint.type,
            axis=item.world_from_object.turn(joint.axis_object[None])[0],
            origin=item.world_from_object.apply(joint.origin_object[None])[0],
            lower=joint.lower,
            upper=joint.upper,
            limit_source="",
        )
        for joint in item.joints
    )
    return ObjectRecord(
        name=item.name,
        category=item.category,
        dimensions_m=item.dimensions_m,
        world_from_object=item.world_from_object,
        joints=joints,
    )
