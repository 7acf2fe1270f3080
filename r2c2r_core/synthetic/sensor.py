"""Simulated LiDAR depth of a phone, as from ARKit: smooth, mixed at edges, unsure on dark and grazing surfaces."""

from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.atlas import LitScene
from r2c2r_core.synthetic.render import facing_faces

_OVERSAMPLE = 3


class LidarFrame(NamedTuple):
    """Depth in metres (NaN: no return) and confidence 0 low, 1 medium, 2 high."""

    depth_m: np.ndarray
    confidence: np.ndarray


def scan_depth(scene: LitScene, camera: Intrinsics, camera_from_kitchen: Rigid3, rng: np.random.Generator) -> LidarFrame:
    """One depth frame at `camera`'s own size (256x192 on current phones)."""
    large = camera.resized(camera.width * _OVERSAMPLE, camera.height * _OVERSAMPLE)
    raster = rasterize(scene.vertices, facing_faces(scene, camera_from_kitchen), scene.attributes, large, camera_from_kitchen)
    fine = raster.depth_m.astype(np.float32)
    centre = slice(_OVERSAMPLE // 2, None, _OVERSAMPLE)
    truth, patch = fine[centre, centre], np.rint(raster.attributes[centre, centre, 2]).astype(int)
    footprint = _OVERSAMPLE * 1.5  # a beam covers more than one pixel: edges mix and thin objects recede
    mixed = cv2.GaussianBlur(fine, (0, 0), footprint / 2)[centre, centre]
    near, far = cv2.erode(fine, np.ones((5, 5))), cv2.dilate(fine, np.ones((5, 5)))
    jump = (far - near)[centre, centre]
    edge = jump > 0.025 + 0.035 * truth
    cosine = _cosine(scene, patch, truth, camera, camera_from_kitchen)

    noise = _noise(truth.shape, truth, rng)
    grazing_gain = np.clip(0.5 / np.maximum(cosine, 0.15), 1.0, 3.0)
    depth = np.where(edge, mixed, 0.5 * (truth + mixed)) + noise * grazing_gain
    depth = np.where(edge, depth + rng.standard_normal(truth.shape) * 0.15 * jump, depth)

    speckle = 0.04 * cv2.GaussianBlur(rng.standard_normal(truth.shape).astype(np.float32), (0, 0), 2)
    unsure = _returned_light(scene, patch, cosine) + speckle
    confidence = np.full(truth.shape, 2, np.uint8)
    confidence[(unsure < 0.045) | (cosine < 0.22) | (truth > 4.5) | edge] = 1
    confidence[(unsure < 0.018) | (cosine < 0.12) | (cv2.erode(edge.astype(np.uint8), np.ones((2, 2))) > 0)] = 0
    hole = (unsure < 0.006) | (cosine < 0.05) | (truth <= 0) | (truth > 5.5)
    depth = np.where(hole, np.nan, depth)
    confidence[hole] = 0
    return LidarFrame(depth.astype(np.float32), confidence)


def _returned_light(scene: LitScene, patch: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """Fraction of a pulse that returns, averaged over the beam's footprint: little from dark, shiny and grazing surfaces."""
    back = scene.reflectance_of_patch[patch] * np.clip(cosine, 0.05, 1) * (1 - 0.6 * scene.gloss_of_patch[patch])
    return np.asarray(cv2.GaussianBlur(back.astype(np.float32), (0, 0), 0.8))


def _noise(shape: tuple[int, ...], depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """3 mm at 1 m growing to 6 mm at 2 m and more beyond: half of it correlated over about 6 pixels, a little per pixel."""
    field = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), 4)
    field /= max(float(field.std()), 1e-6)
    sigma = 0.003 * np.maximum(depth, 0.3)
    return np.asarray(sigma * (0.7 * field + 0.45 * rng.standard_normal(shape) + 0.25 * rng.standard_normal()))


def _cosine(
    scene: LitScene, patch: np.ndarray, depth: np.ndarray, camera: Intrinsics, camera_from_kitchen: Rigid3
) -> np.ndarray:
    """Cosine between the viewing ray and the surface, from the patch where it is flat; 0.7 on curved ones."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + 0.5
    ray = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    normal = (scene.normal_of_patch @ camera_from_kitchen.rotation.T)[patch]
    cosine = np.abs((ray * normal).sum(axis=-1))
    single = np.where(scene.flat_patch[patch], cosine, 0.7).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(single, (0, 0), 0.8))  # the beam is wider than the side of a gap
