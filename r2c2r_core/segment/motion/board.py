"""Masks of open leaves: the board, and for a drawer also the box and contents behind its front."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from r2c2r_core.arrays import Mask, Vector3
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, unproject
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.leaf import OpenLeaf
from r2c2r_core.segment.occlusion import Facet, Tolerance, at_size, visible_mask
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of occlusion of an open leaf, whose pose is fitted and which a hand may hide."""

    before_m: float = param(0.025, "m", "Minimum distance in front of the leaf of an occluder")
    in_plane_m: float = param(
        0.012,
        "m",
        "Minimum distance in front of a leaf that slides past others, of an occluder",
        source="tracks lie 2-4 cm apart",
    )
    behind_m: float = param(0.04, "m", "Minimum distance of depth behind the leaf to look past it")
    rear_m: float = param(0.03, "m", "Margin behind the face of a drawer's rear board within which the drawer ends")
    shade: float = param(
        2.2, "ratio", "Factor of lightness to the leaf's median beyond which a pixel is not a shaded part of it", gt=1
    )
    hue_lab: float = param(18.0, "grey", "Maximum hue difference from the leaf's colour in that shade")
    touches_m: float = param(
        0.015, "m", "Maximum distance in front of its face of depth on the leaf: more may be a hand on its handle"
    )
    hole_px: float = param(3.0, "px", "Maximum distance from a hole in the depth image to the surface that fills it", gt=0)
    hand_m: float = param(0.03, "m", "Minimum width of what may be a hand or a sleeve: handles are narrower")
    told_share: float = param(
        0.1, "share", "Minimum fraction of a leaf's pixels with depth on it for its usual colour to be known"
    )
    hand_share: float = param(
        0.5, "share", "Maximum fraction of a leaf that a hand covers: black glass has depth on its rim alone"
    )


def open_mask(opened: OpenLeaf, scene: Scene, frame: Frame) -> tuple[Mask, float]:
    """Visible pixels of an open leaf in a frame, and the visible fraction of its projection."""
    params = tuned(Params)
    near = Tolerance(
        front_m=params.in_plane_m if opened.movement == "along" else params.before_m, behind_m=params.behind_m, fused=False
    )  # a sliding leaf passes others one track away
    mask, share = visible_mask(_faces(opened, frame), scene, frame, near)
    seen = _seen(opened, scene, frame)
    mask = mask & ~_hand_before(mask, opened, seen, scene, frame)
    return (mask | _drawn_out(opened, seen, frame) if opened.movement == "out" else mask), share


def _seen(opened: OpenLeaf, scene: Scene, frame: Frame) -> np.ndarray:
    """Depth points in the leaf's frame (h, w, 3); NaN where nothing was measured nearby.

    Depth has a thin line of holes between two surfaces: each of its pixels takes the nearest measured depth.
    """
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    away, nearest = distance_transform_edt(depth == 0, return_indices=True)
    filled = np.where(away <= tuned(Params).hole_px, depth[tuple(nearest)], np.nan)
    leaf_from_camera: Rigid3 = opened.leaf.world_from_front.inverse @ frame.world_from_camera
    return leaf_from_camera.apply(unproject(pixel_centres(camera), filled, camera).reshape(-1, 3)).reshape(*depth.shape, 3)


def _hand_before(mask: Mask, opened: OpenLeaf, seen: np.ndarray, scene: Scene, frame: Frame) -> Mask:
    """Pixels of an occluding hand: off the leaf by depth, and in a patch of another colour than the leaf's."""
    params = tuned(Params)
    from_behind = float(opened.leaf.world_from_front.inverse.apply(frame.world_from_camera.translation)[1]) > 0
    before = seen[..., 1] - opened.leaf.thickness_m if from_behind else -seen[..., 1]
    told = mask & at_size((scene.depth(frame.index) > 0) & (before < params.touches_m), mask)
    if np.count_nonzero(told) < max(params.told_share * np.count_nonzero(mask), 1):
        return np.zeros_like(mask)
    usual_lab = np.median(cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB)[told], axis=0)
    hand = patches_unlike(usual_lab, ~told, opened.leaf.centre, scene, frame)
    covers = np.count_nonzero(hand & mask) < params.hand_share * np.count_nonzero(mask)
    return hand if covers else np.zeros_like(mask)


def patches_unlike(usual_lab: np.ndarray, untold: Mask, place: Vector3, scene: Scene, frame: Frame) -> Mask:
    """Patches of untold pixels, as wide as a hand at a place, that are no shade of a surface's colour (3,) or (h, w, 3) there.

    A hand on a handle is close in front of a front, and shaded skin, gloves, sleeves and black glass return no light to a
    phone's LiDAR: depth alone does not separate them from it.
    """
    params, usual = tuned(Params), usual_lab.astype(np.float32)
    lab = cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB).astype(np.float32)
    light = np.maximum(lab[..., 0], 1.0) / np.maximum(usual[..., 0], 1.0)
    hue = np.abs((lab[..., 1:] - 128.0) - (usual[..., 1:] - 128.0) * light[..., None]).max(axis=2)
    unlike = (np.abs(np.log(light)) > np.log(params.shade)) | (hue > params.hue_lab)
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (hand_px(place, frame, frame.rgb_camera),) * 2)
    patch = cv2.morphologyEx((unlike & untold).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return np.asarray(cv2.morphologyEx(patch, cv2.MORPH_OPEN, element) > 0)


def hand_px(place: Vector3, frame: Frame, camera: Intrinsics) -> int:
    """Width of a hand at a place (world) in a frame's image."""
    away = float(frame.world_from_camera.inverse.apply(place)[2])
    return max(int(tuned(Params).hand_m * camera.fx / max(away, 0.3)), 3)


def _faces(opened: OpenLeaf, frame: Frame) -> list[Facet]:
    """Sides of the board that face the camera."""
    face = opened.leaf.corners_front
    back = face + opened.leaf.behind
    quads = [face, back[::-1], *(np.stack([face[k], back[k], back[k - 1], face[k - 1]]) for k in range(4))]
    facets = [Facet(opened.leaf.world_from_front.apply(quad)) for quad in quads]
    camera = frame.world_from_camera.translation
    middle = opened.leaf.world_from_front.apply((face + back).mean(axis=0)[None] / 2)[0]
    return [f for f in facets if _side(f, camera) * _side(f, middle) < 0]


def _side(facet: Facet, point: np.ndarray) -> float:
    return float((point - facet.corners_world[0]) @ facet.normal)


def _drawn_out(opened: OpenLeaf, seen: np.ndarray, frame: Frame) -> Mask:
    """Pixels whose depth lies behind a drawer's front: its box and contents.

    For a box whose rear was not observed, only as far as the drawer has come out.
    """
    out = opened.out_m if opened.rear_m is None else max(opened.out_m, opened.rear_m + tuned(Params).rear_m)
    inside = opened.leaf.covers(seen) & (seen[..., 1] > 0) & (seen[..., 1] < out)
    size = (frame.rgb_camera.width, frame.rgb_camera.height)
    return np.asarray(cv2.resize(inside.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.5)
