"""A mesh placed in a sample kitchen and filmed: photos, a phone's depth, imperfect masks, a partial occlusion."""

from functools import cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from stock import Article

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.raster import rasterize, render_textured, subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.synthetic.atlas import LitScene, light_scene
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.render import facing_faces, render_view

VIEWS = 10
ARC = np.radians(120.0)
RGB = Intrinsics(fx=720.0, fy=720.0, cx=482.0, cy=357.0, width=960, height=720)
DEPTH = RGB.resized(256, 192)
FINE = 3  # rays per depth pixel, along each axis
OUTLINE_PX = 5.0  # maximum error of a mask's outline


class Stage(NamedTuple):
    """A place in a kitchen, and the camera poses around it."""

    key: tuple[int, bool, float]  # kitchen, on its worktop or on its floor, distance in metres
    spot: np.ndarray  # where the object stands
    poses: tuple[Rigid3, ...]  # world_from_camera


class Images:
    """Pixels in memory."""

    def __init__(self) -> None:
        self.colours: dict[int, np.ndarray] = {}
        self.depths: dict[int, Depth] = {}

    def rgb(self, frame_index: int) -> np.ndarray:
        """The photo."""
        return self.colours[frame_index]

    def depth(self, frame_index: int) -> Depth:
        """The depth frame."""
        return self.depths[frame_index]


def place_for(article: Article, number: int) -> Stage:
    """Small articles on the worktop, others on the floor before it; seen from a distance at which a person would stand."""
    small = article.size_m < 0.45
    reach = 0.75 if small else 1.5 if article.size_m < 0.9 else 2.1 if article.size_m < 1.4 else 2.8
    return _stage(number % 2, small, reach)


@cache
def _stage(seed: int, on_worktop: bool, reach: float) -> Stage:
    kitchen, _ = _kitchen(seed)
    x = sum(kitchen.runs[0].ends) / 2
    z = kitchen.worktop_top_m if on_worktop else 0.0
    spot = np.array([x, -0.25 if on_worktop else -kitchen.base_depth_m - 0.5, z])
    height = z + (0.45 if on_worktop else 0.5 + 0.4 * reach)
    eyes = []
    for k, angle in enumerate(np.linspace(-ARC / 2, ARC / 2, VIEWS)):
        away = reach * (1.0 + 0.12 * np.sin(2.0 * k + seed))
        up = height - z + 0.15 * reach * np.cos(3.0 * k)
        eyes.append(spot + np.array([away * np.sin(angle), -away * np.cos(angle), up]))
    look = spot + np.array([0.0, 0.0, 0.08 if on_worktop else 0.25 * reach])
    return Stage((seed, on_worktop, reach), spot, tuple(_look(eye, look) for eye in eyes))


@cache
def _kitchen(seed: int) -> tuple[Kitchen, LitScene]:
    kitchen = plan_kitchen(seed)
    return kitchen, light_scene(build_kitchen(kitchen), np.random.default_rng([seed, 2]))


@cache
def _backdrop(key: tuple[int, bool, float], view: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Colour and depth of the kitchen without the object, and its depth along the depth camera's rays."""
    pose, scene = _stage(*key).poses[view], _kitchen(key[0])[1]
    shown = render_view(scene, RGB, pose.inverse)
    large = DEPTH.resized(DEPTH.width * FINE, DEPTH.height * FINE)
    fine = rasterize(scene.vertices, facing_faces(scene, pose.inverse), scene.attributes, large, pose.inverse).depth_m
    return shown.colour, shown.depth_m, fine


def film(stage: Stage, mesh: TexturedMesh, rng: np.random.Generator) -> tuple[Similarity3, Capture, MaskTrack]:
    """The mesh's true pose (world_from_article), and a phone's recording and masks of it."""
    turn = float(np.radians(rng.uniform(-75.0, 75.0)))  # its front is visible in some of the frames
    world = Similarity3(1.0, rotation_about_z(turn), stage.spot + np.append(rng.uniform(-0.05, 0.05, 2), 0.0))
    thing = subdivided(world.apply(mesh.vertices), mesh)
    plank = _plank(stage, mesh, rng)
    images, frames, masks = Images(), [], {}
    for index, pose in enumerate(stage.poses):
        colour, depth, fine = _backdrop(stage.key, index)
        photo, mask = _photo(thing, plank, colour, depth, pose, rng)
        images.colours[index], images.depths[index] = photo, _depth(thing, plank, fine, pose, rng)
        frames.append(
            Frame(index=index, timestamp_s=None, rgb_camera=RGB, depth_camera=DEPTH, world_from_camera=pose, sharpness=1.0)
        )
        mask = wrong_outline(mask, rng)
        if mask.sum() > 300:
            masks[index] = pack_mask(mask)
    return world, _capture(tuple(frames), images), _track(masks)


def wrong_outline(mask: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The mask with its outline displaced smoothly by up to `OUTLINE_PX`, in and out."""
    near = window(mask, 20)
    part = mask[near]
    inside = cv2.distanceTransform(part.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~part).astype(np.uint8), cv2.DIST_L2, 5)
    coarse = rng.standard_normal((part.shape[0] // 4 + 12, part.shape[1] // 4 + 12)).astype(np.float32)
    field = cv2.GaussianBlur(coarse, (0, 0), 5)[6:-5, 6:-5]
    field = cv2.resize(5.0 * np.sqrt(np.pi) * 2.0 * field, part.shape[::-1], interpolation=cv2.INTER_LINEAR)  # of unit sigma
    moved = np.zeros_like(mask)
    moved[near] = (inside - outside) > np.clip(0.5 * OUTLINE_PX * field, -OUTLINE_PX, OUTLINE_PX)
    return moved if moved.sum() > 50 else mask


def outlines(
    path: Path, capture: Capture, mesh: TexturedMesh, found: Similarity3, truth: Similarity3, track: MaskTrack
) -> None:
    """Three photos with the mask (white), the truth (green) and the estimate (red)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = []
    for index in sorted(track.masks)[:: max(len(track.masks) // 3, 1)][:3]:
        picture = capture.images.rgb(index).copy()
        pose = capture.frame(index).world_from_camera
        _draw(picture, unpack_mask(track.masks[index]), (255, 255, 255))
        for similarity, colour in ((truth, (0, 255, 0)), (found, (255, 0, 0))):
            depth = rasterize(
                similarity.apply(mesh.vertices), mesh.faces, np.ones((len(mesh.vertices), 3)), RGB, pose.inverse
            ).depth_m
            edges = cv2.morphologyEx(depth, cv2.MORPH_GRADIENT, np.ones((3, 3))) > 0.02
            picture[edges] = colour
        shown.append(picture)
    cv2.imwrite(str(path), cv2.cvtColor(cv2.resize(np.hstack(shown), None, fx=0.5, fy=0.5), cv2.COLOR_RGB2BGR))


def _draw(picture: np.ndarray, mask: np.ndarray, colour: tuple[int, int, int]) -> None:
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, found, -1, colour, 1)


def subdivided(vertices_world: np.ndarray, mesh: TexturedMesh) -> TexturedMesh:
    """The mesh in world coordinates, without triangles the rasteriser would tear at the near plane."""
    if len(mesh.faces) > 2000:
        return TexturedMesh(vertices=vertices_world, faces=mesh.faces, uv=mesh.uv, texture=mesh.texture)
    vertices, faces, uv = subdivide_long_edges(vertices_world, mesh.faces, mesh.uv, 0.25)
    return TexturedMesh(vertices=vertices, faces=faces, uv=uv, texture=mesh.texture)


def _plank(stage: Stage, mesh: TexturedMesh, rng: np.random.Generator) -> TexturedMesh:
    """An upright plank in front of the object, a fifth to a third as wide."""
    size = np.ptp(mesh.vertices, axis=0)
    wide, high, away = rng.uniform(0.2, 0.33) * size[:2].max(), rng.uniform(0.5, 1.1) * size[2], 0.75 * np.hypot(*size[:2])
    side = rng.uniform(-0.5, 0.5) * size[0]
    half = np.array([wide / 2, 0.01, high / 2])
    vertices, faces = box_mesh(np.array([side, -away, high / 2]) - half, np.array([side, -away, high / 2]) + half)
    colour = np.full((4, 4, 3), 0, np.uint8) + rng.integers(60, 220, 3).astype(np.uint8)
    return TexturedMesh(vertices=vertices + stage.spot, faces=faces, uv=np.full((len(vertices), 2), 0.5), texture=colour)


def _photo(
    thing: TexturedMesh, plank: TexturedMesh, colour: np.ndarray, depth: np.ndarray, pose: Rigid3, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """The photo, and the object's visible pixels."""
    colour, nearest, mask = colour.copy(), np.where(depth > 0, depth, np.float32(np.inf)), np.zeros(depth.shape, dtype=bool)
    for mesh, is_thing in ((thing, True), (plank, False)):
        image, own = render_textured(mesh.vertices, mesh.faces, mesh.uv, mesh.texture, RGB, pose.inverse)
        nearer = (own > 0) & (own < nearest)
        colour[nearer] = image[nearer]
        nearest = np.where(nearer, own, nearest)
        mask = np.where(nearer, is_thing, mask)
    near = window(nearest < np.where(depth > 0, depth, np.inf), 40)  # sensor grain is only needed near the object
    soft = cv2.GaussianBlur(colour[near], (0, 0), 0.7).astype(np.float32) * np.float32(rng.uniform(0.92, 1.08))
    soft += 2.5 * rng.standard_normal(soft.shape, dtype=np.float32)
    colour[near] = soft.clip(0, 255).astype(np.uint8)
    return colour, mask


def window(mask: np.ndarray, margin_px: int) -> tuple[slice, slice]:
    """Rows and columns of a mask's bounding box with a margin; the whole image if the mask is empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return slice(None), slice(None)
    top, left = max(rows[0] - margin_px, 0), max(columns[0] - margin_px, 0)
    return slice(top, rows[-1] + margin_px), slice(left, columns[-1] + margin_px)


def _depth(thing: TexturedMesh, plank: TexturedMesh, fine: np.ndarray, pose: Rigid3, rng: np.random.Generator) -> Depth:
    """A phone's LiDAR depth: edges and noise as in synthetic/sensor.py, with holes at grazing angles."""
    large = DEPTH.resized(DEPTH.width * FINE, DEPTH.height * FINE)
    nearest = np.where(fine > 0, fine, np.inf)
    for mesh in (thing, plank):
        own = rasterize(mesh.vertices, mesh.faces, np.ones((len(mesh.vertices), 3)), large, pose.inverse).depth_m
        nearest = np.where((own > 0) & (own < nearest), own, nearest)
    full = np.where(np.isfinite(nearest), nearest, 0.0).astype(np.float32)
    centre = slice(FINE // 2, None, FINE)
    truth, mixed = full[centre, centre], cv2.GaussianBlur(full, (0, 0), 0.75 * FINE)[centre, centre]
    jump = (cv2.dilate(full, np.ones((5, 5))) - cv2.erode(full, np.ones((5, 5))))[centre, centre]
    edge = jump > 0.025 + 0.035 * truth
    field = cv2.GaussianBlur(rng.standard_normal(truth.shape).astype(np.float32), (0, 0), 4)
    noise = 0.7 * field / field.std() + 0.45 * rng.standard_normal(truth.shape) + 0.25 * rng.standard_normal()
    measured = np.where(edge, mixed, 0.5 * (truth + mixed)) + 0.003 * np.maximum(truth, 0.3) * noise
    valid = (truth > 0) & (truth < 5.0) & ~edge
    return Depth(np.where(valid, measured, 0.0).astype(np.float32), valid)


def _capture(frames: tuple[Frame, ...], images: Images) -> Capture:
    return Capture(
        name="benchmark",
        sha256="",
        format="synthetic",
        frames=frames,
        world_from_capture=Rigid3(),
        room=Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=()),
        surface=SceneSurface(
            vertices_world=np.zeros((0, 3)),
            faces=np.zeros((0, 3), np.int64),
            colours=np.zeros((0, 3), np.uint8),
            voxel_m=0.01,
        ),
        images=images,
        notices=(),
    )


def _track(masks: dict[int, object]) -> MaskTrack:
    """Mask track without a measured front or box, so that neither helps the alignment."""
    return MaskTrack(
        name="thing",
        category="object",
        masks=masks,  # type: ignore[arg-type]
        confidence=dict.fromkeys(masks, 1.0),
        front=None,
        box=None,
        kind="thing",
        backend="benchmark",
        prompt_count=1,
        warnings=(),
    )


def _look(eye: np.ndarray, target: np.ndarray) -> Rigid3:
    """world_from_camera of an upright camera that looks at a point."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(forward, right), forward]), eye)
