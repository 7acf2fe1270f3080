"""The visible pixels of a leaf that stands open: its board, and what a drawer brings out behind it."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.camera import pixel_centres, unproject
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.leaf import OpenLeaf, behind, corners
from r2c2r_core.segment.occlusion import Facet, Tolerance, visible_mask
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What hides a leaf that stands open: its pose is fitted, and a hand may be on it."""

    before_m: float = param(0.025, "m", "before it, from where something hides it")
    in_plane_m: float = param(0.012, "m", "the same of one that slides past others", source="tracks lie 2-4 cm apart")
    behind_m: float = param(0.04, "m", "behind it, from where depth looks past it")
    rear_m: float = param(0.03, "m", "behind the face of a drawer's rear board, within which it ends")
    shade: float = param(2.2, "ratio", "darker or lighter than the leaf usually is, from where it is no shade on it", gt=1)
    hue_lab: float = param(18.0, "grey", "off the leaf's hue in that shade, from where it is no part of it")
    hand_m: float = param(0.03, "m", "width of what may be a hand or a sleeve: handles are narrower")
    told_share: float = param(0.25, "share", "of a leaf's pixels that need depth, for its usual colour to be known")


def open_mask(opened: OpenLeaf, scene: Scene, frame: Frame) -> tuple[Mask, float]:
    """Its visible pixels in a frame, and the share of its projection that is visible."""
    params = tuned(Params)
    near = Tolerance(
        front_m=params.in_plane_m if opened.way == "along" else params.before_m, behind_m=params.behind_m, fused=False
    )  # a leaf that slides passes others a track away
    mask, share = visible_mask(_faces(opened, frame), scene, frame, near)
    mask = mask & ~_dark_before(mask, opened, scene, frame)
    return (mask | _drawn_out(opened, scene, frame) if opened.way == "out" else mask), share


def _dark_before(mask: Mask, opened: OpenLeaf, scene: Scene, frame: Frame) -> Mask:
    """Pixels of the mask without depth, in a patch as wide as a hand that is coloured as the leaf is not.

    Skin in shade, gloves and sleeves return no light to a phone's LiDAR: depth alone does not tell them from the leaf.
    """
    params = tuned(Params)
    size = (mask.shape[1], mask.shape[0])
    known = cv2.resize((scene.depth(frame.index) > 0).astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    told = mask & known
    if np.count_nonzero(told) < max(params.told_share * np.count_nonzero(mask), 1):
        return np.zeros_like(mask)
    lab = cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB).astype(np.float32)
    usual = np.median(lab[told], axis=0)
    light = np.maximum(lab[..., 0], 1.0) / max(float(usual[0]), 1.0)
    hue = np.abs((lab[..., 1:] - 128.0) - (usual[1:] - 128.0) * light[..., None]).max(axis=2)
    unlike = (np.abs(np.log(light)) > np.log(params.shade)) | (hue > params.hue_lab)
    away = float(frame.world_from_camera.inverse.apply(opened.world_from_leaf.translation[None])[0, 2])
    width = max(int(params.hand_m * frame.rgb_camera.fx / max(away, 0.3)), 3)
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    patch = cv2.morphologyEx((unlike & ~told).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return cv2.morphologyEx(patch, cv2.MORPH_OPEN, element) > 0


def _faces(opened: OpenLeaf, frame: Frame) -> list[Facet]:
    """The sides of the board that face the camera."""
    face = corners(opened.leaf)
    back = face + behind()
    quads = [face, back[::-1], *(np.stack([face[k], back[k], back[k - 1], face[k - 1]]) for k in range(4))]
    facets = [Facet(opened.world_from_leaf.apply(quad)) for quad in quads]
    camera = frame.world_from_camera.translation
    middle = opened.world_from_leaf.apply((face + back).mean(axis=0)[None] / 2)[0]
    return [f for f in facets if _side(f, camera) * _side(f, middle) < 0]


def _side(facet: Facet, point: np.ndarray) -> float:
    return float((point - facet.corners_world[0]) @ facet.normal)


def _drawn_out(opened: OpenLeaf, scene: Scene, frame: Frame) -> Mask:
    """Pixels whose depth lies behind a drawer's front: its box, and what is in it.

    Of a box whose rear was not seen, what has come out of the unit.
    """
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    leaf_from_camera: Rigid3 = opened.world_from_leaf.inverse @ frame.world_from_camera
    local = leaf_from_camera.apply(unproject(pixel_centres(camera), depth, camera).reshape(-1, 3)).reshape(*depth.shape, 3)
    out = float(np.linalg.norm(opened.world_from_leaf.translation - opened.leaf.world_from_front.translation))
    if opened.rear_m is not None:
        out = max(out, opened.rear_m + tuned(Params).rear_m)
    half_w, half_h = opened.leaf.half_m
    inside = (depth > 0) & (np.abs(local[..., 0]) < half_w) & (np.abs(local[..., 2]) < half_h)
    inside &= (local[..., 1] > 0) & (local[..., 1] < out)
    size = (frame.rgb_camera.width, frame.rgb_camera.height)
    return np.asarray(cv2.resize(inside.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.5)
