"""Fusion of learned masks with depth: the paper's intersection with a depth-image mask, and multi-view evidence.

`depth-mask` (paper 4.1): the same clicks are tracked a second time through depth images, and both masks are intersected;
where less than 40 % of the colour mask is left, the colour mask stays and the frame is counted as a disagreement.
`evidence` (default): all frames vote on the fused surface; a frame loses the pixels whose depth lies off the agreed surface
(leaks over a depth edge), and gets that surface's outline where the model lost an object in plain view.
The intersection also deletes what a depth image cannot show, such as handles and flush gaps (method.md row 13).
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Mask
from r2c2r_core.geometry.camera import unproject
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.learned.voting import Body
from r2c2r_core.segment.occlusion import refine_border
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.thing import Thing, thing_mask
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the fusion."""

    least_overlap: float = param(0.4, "share", "Minimum fraction of the colour mask that the paper's intersection must keep")
    off_body_m: float = param(0.04, "m", "Maximum distance of an object pixel from the agreed surface", source="handles: 4 cm")
    off_body_share: float = param(0.01, "share", "Additional tolerance per metre of depth")
    leak_share: float = param(
        0.01, "share", "Minimum fraction of the mask off the surface for a leak: fewer pixels are depth noise"
    )
    lost_share: float = param(
        0.25, "share", "Fraction of the agreed surface's visible pixels below which a mask has lost the object"
    )
    in_plain_view: float = param(
        0.5, "share", "Minimum visible fraction of the agreed surface's projection for it to fill in a mask"
    )
    filled_confidence: float = param(0.3, "score", "Confidence, 0 to 1, of a filled-in mask")


@dataclass(frozen=True, slots=True, eq=False)
class Fused:
    """Masks and their confidence by frame number, and warnings to the user."""

    masks: Mapping[int, PackedMask]
    confidence: Mapping[int, float]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class DepthPictures:
    """Depth as 8-bit images, with one brightness per distance over the whole recording (near is bright)."""

    scene: Scene
    near_m: float
    far_m: float

    @classmethod
    def over(cls, scene: Scene) -> "DepthPictures":
        """Depth images scaled from the 2nd to the 98th percentile of the recording's depth."""
        step = max(1, len(scene.frames) // 16)
        seen = [depth[depth > 0][::7] for frame in scene.frames[::step] if (depth := scene.depth(frame.index)).any()]
        near, far = np.percentile(np.concatenate(seen), [2, 98]) if seen else (0.0, 1.0)
        return cls(scene, float(near), max(float(far), float(near) + 0.1))

    def picture(self, position: int) -> Image:
        """Depth image of the frame at a position of the recording; holes take the nearest known pixel."""
        depth = nearest_filled(self.scene.filled_depth(self.scene.frames[position].index))
        share = np.clip((self.far_m - depth) / (self.far_m - self.near_m), 0, 1)
        return np.repeat((share * 255).astype(np.uint8)[..., None], 3, axis=2)


def nearest_filled(depth_m: np.ndarray) -> np.ndarray:
    """Depth with holes filled by their nearest known pixel (the paper's fill); zeros when none is known."""
    known = depth_m > 0
    if known.all() or not known.any():
        return depth_m
    _, labels = cv2.distanceTransformWithLabels((~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    values = np.zeros(int(labels.max()) + 1, depth_m.dtype)
    values[labels[known]] = depth_m[known]
    return np.asarray(values[labels])


def both_masks(colour: Mask, depth: Mask) -> tuple[Mask, bool]:
    """Intersection (paper 4.1), or the colour mask and False where the intersection keeps less than 40 % of it.

    `depth` may have another resolution, that of the depth image.
    """
    if depth.shape != colour.shape:
        size = (colour.shape[1], colour.shape[0])
        depth = cv2.resize(depth.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    both = colour & depth
    agreed = np.count_nonzero(both) >= tuned(Params).least_overlap * np.count_nonzero(colour)
    return (both, True) if agreed else (colour, False)


def with_evidence(scene: Scene, found: Fused, body: Body, least_area_px: int, opened: Set[int] = frozenset()) -> Fused:
    """Masks without leaks over depth edges, and filled in where the model lost the object; unchanged without a surface.

    Masks of `opened` frames stay as they are: the object is not where its surface is.
    """
    params = tuned(Params)
    if not body.exists:
        return found
    from scipy.spatial import cKDTree

    near = cKDTree(body.vertices)
    thing = Thing(body.vertices, body.faces, None, scene.capture.surface.voxel_m)
    masks = {index: mask for index, mask in found.masks.items() if index in opened}
    confidence = {index: found.confidence[index] for index in masks}
    filled = 0
    for frame in (frame for frame in scene.frames if frame.index not in opened):
        mask, trust = None, found.confidence.get(frame.index, 0.0)
        if frame.index in found.masks:
            mask = without_leaks(unpack_mask(found.masks[frame.index]), scene, frame, near)
        outline, share = thing_mask(thing, scene, frame, refine=False)
        lost = np.count_nonzero(mask) if mask is not None else 0
        if share > params.in_plain_view and lost < params.lost_share * np.count_nonzero(outline):
            mask, trust, filled = _snapped(outline, scene, frame), params.filled_confidence, filled + 1
        if mask is not None and np.count_nonzero(mask) >= least_area_px:
            masks[frame.index], confidence[frame.index] = pack_mask(mask), trust
    if not masks:
        return found
    said = (f"the model lost it in {filled} frames: filled in from the other frames",) if filled else ()
    return Fused(masks, confidence, found.warnings + said)


def without_leaks(mask: Mask, scene: Scene, frame: Frame, near: object) -> Mask:
    """Mask without pixels whose measured depth lies off the agreed surface (`near` is its cKDTree)."""
    params = tuned(Params)
    depth = scene.depth(frame.index)
    small = cv2.resize(mask.astype(np.uint8), (depth.shape[1], depth.shape[0]), interpolation=cv2.INTER_NEAREST) > 0
    row, column = np.nonzero(small & (depth > 0))
    if not len(row):
        return mask
    metres = depth[row, column].astype(np.float64)
    points = unproject(np.stack([column + 0.5, row + 0.5], axis=1), metres, frame.depth_camera)
    limit = params.off_body_m + params.off_body_share * metres
    away, _ = near.query(frame.world_from_camera.apply(points), distance_upper_bound=float(limit.max()))  # type: ignore[attr-defined]  # scipy has no types
    off = np.zeros(depth.shape, np.uint8)
    off[row, column] = away > limit
    off = cv2.morphologyEx(off, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))  # single pixels of mixed depth
    if off.sum() < params.leak_share * small.sum():
        return mask
    wide = cv2.resize(off, (mask.shape[1], mask.shape[0]), interpolation=cv2.INTER_LINEAR) > 0
    kept = mask & ~wide
    band = max(2, round(1.5 * mask.shape[1] / depth.shape[1]))
    return refine_border(scene.rgb(frame.index), kept, band, within=mask) if kept.any() else kept


def _snapped(outline: Mask, scene: Scene, frame: Frame) -> Mask:
    return refine_border(scene.rgb(frame.index), outline, max(2, frame.rgb_camera.width // 160)) if outline.any() else outline
