"""Rendering of one frame: colour of a phone camera, and the instance of every pixel."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Image
from r2c2r_core.geometry.camera import Intrinsics, unproject
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.atlas import Emitter, LitScene

_OVERSAMPLE = 2
_SHINE_STEP = 4
_PANE_PASSES = 0.86  # transmittance through 4 mm of clear glass and back


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """A sharp, noise-free frame."""

    colour: Image
    patch: np.ndarray  # (h, w) int32 patch index, -1 where nothing
    depth_m: np.ndarray  # (h, w) z-depth


def render_view(scene: LitScene, camera: Intrinsics, camera_from_kitchen: Rigid3) -> View:
    """Antialiased colour, and the patch and depth at the pixel centres (to a quarter pixel)."""
    large = camera.resized(camera.width * _OVERSAMPLE, camera.height * _OVERSAMPLE)
    raster = rasterize(scene.vertices, facing_faces(scene, camera_from_kitchen), scene.attributes, large, camera_from_kitchen)
    fine = np.asarray(
        cv2.remap(
            scene.atlas,
            np.ascontiguousarray(raster.attributes[..., 0]) - 0.5,
            np.ascontiguousarray(raster.attributes[..., 1]) - 0.5,
            cv2.INTER_LINEAR,
        )
    )
    colour = cv2.resize(fine, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    at = slice(1, None, _OVERSAMPLE)
    depth = raster.depth_m[at, at]
    patch = np.where(depth > 0, np.rint(raster.attributes[at, at, 2]), -1).astype(np.int32)
    if scene.pane_faces.any():
        colour, patch, depth = _through_panes(scene, colour, patch, depth, camera, camera_from_kitchen)
    shine = reflections(scene, patch, depth, camera, camera_from_kitchen)
    return View(colour=np.asarray(cv2.add(colour, shine), dtype=np.uint8), patch=patch, depth_m=depth)


def facing_faces(scene: LitScene, camera_from_kitchen: Rigid3, *, panes: bool = False) -> Faces:
    """Faces turned towards the camera, either of clear glass or of everything else (back-face culling: all is closed)."""
    eye = camera_from_kitchen.inverse.translation
    return scene.faces[(scene.face_normals @ eye > scene.face_offsets) & (scene.pane_faces == panes)]


def _through_panes(
    scene: LitScene, colour: Image, patch: np.ndarray, depth_m: np.ndarray, camera: Intrinsics, camera_from_kitchen: Rigid3
) -> tuple[Image, np.ndarray, np.ndarray]:
    """Colour, patch and depth with clear glass in front: dimmed colour, the pane's patch and depth."""
    facing = facing_faces(scene, camera_from_kitchen, panes=True)
    panes = rasterize(scene.vertices, facing, scene.attributes, camera, camera_from_kitchen)
    before = (panes.depth_m > 0) & ((panes.depth_m < depth_m) | (depth_m <= 0))
    dimmed = np.where(before[..., None], (colour * _PANE_PASSES).astype(np.uint8), colour)
    owner = np.where(before, np.rint(panes.attributes[..., 2]), patch).astype(np.int32)
    return dimmed, owner, np.where(before, panes.depth_m, depth_m)


def reflections(
    scene: LitScene, patch: np.ndarray, depth_m: np.ndarray, camera: Intrinsics, camera_from_kitchen: Rigid3
) -> Image:
    """Reflections of the window and the lamp on glossy flat surfaces, blurred by their roughness.

    Computed at a quarter of the size, where it is smooth; the surfaces' own gloss keeps its edges at full size.
    """
    small = camera.resized(camera.width // _SHINE_STEP, camera.height // _SHINE_STEP)
    rows, columns = np.mgrid[0 : small.height, 0 : small.width] * _SHINE_STEP + _SHINE_STEP // 2
    gloss = np.where((patch >= 0) & scene.flat_patch[patch], scene.gloss_of_patch[patch], np.float32(0))
    index = patch[rows, columns]
    v, u = np.nonzero(gloss[rows, columns] > 0.1)
    added = np.zeros((small.height, small.width, 3), np.float32)
    if len(u):
        kitchen_from_camera = camera_from_kitchen.inverse
        points = unproject(np.column_stack([u, v]) + 0.5, depth_m[rows, columns][v, u].astype(float), small)
        ray = kitchen_from_camera.turn(points / np.linalg.norm(points, axis=1, keepdims=True))
        normal = scene.normal_of_patch[index[v, u]]
        cosine = np.einsum("ij,ij->i", ray, normal)
        mirrored = ray - 2 * cosine[:, None] * normal
        fresnel = 0.10 + 0.9 * (1 - np.abs(cosine)) ** 4
        roughness = 0.08 + 0.7 * (1 - gloss[rows, columns][v, u]) ** 2
        for emitter in scene.emitters:
            seen = _seen_share(emitter, kitchen_from_camera.apply(points), mirrored, roughness)
            added[v, u] += (255 * fresnel * seen)[:, None] * emitter.colour
    spread = cv2.resize(added, (camera.width, camera.height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.minimum(spread * gloss[..., None], 160).astype(np.uint8))


def _seen_share(emitter: Emitter, points: np.ndarray, directions: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """Visible fraction of the emitter in a rough mirror at `points` along `directions`, fading across its edges from 1."""
    right, down = np.linalg.norm(emitter.right), np.linalg.norm(emitter.down)
    facing = np.cross(emitter.down, emitter.right) / (right * down)
    approach = directions @ facing
    reach = ((emitter.corner - points) @ facing) / np.where(approach < -1e-3, approach, -1e-3)
    offset = points + directions * reach[:, None] - emitter.corner
    across, along = offset @ emitter.right / right, offset @ emitter.down / down
    outside = np.hypot(
        np.maximum(np.abs(across - right / 2) - right / 2, 0), np.maximum(np.abs(along - down / 2) - down / 2, 0)
    )
    spread = roughness * np.maximum(reach, 0.1)
    share = np.exp(-((outside / spread) ** 2)) * np.minimum(1.0, right * down / (spread**2 + 1e-9))
    return np.where((approach < -1e-3) & (reach > 0), share, 0.0)


def photograph(
    colour: Image, *, gain: float, blur_px: float, white: tuple[float, float, float], rng: np.random.Generator
) -> Image:
    """The frame as stored by a phone: motion blur, exposure, white balance, vignetting, noise."""
    image = colour
    if blur_px > 1:
        image = np.asarray(cv2.filter2D(image, -1, streak(blur_px, float(rng.uniform(0, np.pi)))), dtype=np.uint8)
    height, width = image.shape[:2]
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j].astype(np.float32)
    fall = (1 - 0.07 * (x * x + y * y)).astype(np.float32) * np.float32(gain)
    bright = image.astype(np.float32) * fall[..., None] * np.array(white, np.float32)
    grain = rng.standard_normal((height // 2 + 1, width // 2 + 1, 3)).astype(np.float32)
    grain = cv2.resize(grain, (width, height), interpolation=cv2.INTER_LINEAR)
    noisy = bright + grain * (1.2 + 1.5 * np.sqrt(np.maximum(bright, 0) / 255)).astype(np.float32)
    return np.asarray(np.clip(noisy, 0, 255).astype(np.uint8))


def streak(length_px: float, angle_rad: float) -> np.ndarray:
    """Convolution kernel of straight motion blur."""
    half = int(np.ceil(length_px / 2))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    dx, dy = np.cos(angle_rad) * length_px / 2, np.sin(angle_rad) * length_px / 2
    cv2.line(kernel, (round(half - dx), round(half - dy)), (round(half + dx), round(half + dy)), 1.0, 1)
    return kernel / kernel.sum()
