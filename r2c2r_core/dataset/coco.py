"""Masks as COCO annotations (cocodataset.org, "object detection"); segmentations are uncompressed run lengths."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.track import MaskTrack


def coco_document(frames: Sequence[Frame], tracks: Sequence[MaskTrack], picture: str) -> dict[str, Any]:
    """All masks of all objects. `picture` is the pattern of the pictures' names, such as "images/{:06d}.jpg".

    An image's id is its frame's number; an annotation has its object's name and the mask's confidence in addition to COCO's
    fields. Categories are numbered from 1 in the order of their names.
    """
    categories = sorted({track.category for track in tracks})
    annotations: list[dict[str, Any]] = []
    for track in tracks:
        for index, packed in sorted(track.masks.items()):
            if not packed.area_px:
                continue
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": index,
                    "category_id": 1 + categories.index(track.category),
                    "segmentation": {"size": [packed.height, packed.width], "counts": run_lengths(unpack_mask(packed))},
                    "area": packed.area_px,
                    "bbox": [packed.left, packed.top, packed.box_width, packed.box_height],
                    "iscrowd": 0,
                    "object": track.name,
                    "confidence": round(track.confidence.get(index, 1.0), 4),
                }
            )
    return {
        "images": [
            {
                "id": frame.index,
                "file_name": picture.format(frame.index),
                "width": frame.rgb_camera.width,
                "height": frame.rgb_camera.height,
            }
            for frame in frames
        ],
        "annotations": annotations,
        "categories": [{"id": k + 1, "name": name} for k, name in enumerate(categories)],
    }


def run_lengths(mask: Mask) -> list[int]:
    """Run lengths of equal pixels, column by column, the first of zeros (it may be 0)."""
    flat = mask.T.reshape(-1)
    ends = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    lengths = np.diff(np.concatenate([[0], ends, [len(flat)]]))
    return [0, *lengths.tolist()] if flat[0] else lengths.tolist()
