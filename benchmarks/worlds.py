"""Simulated hand-held phone recordings of third-party models: ray casting, lighting, sensor, camera path and ground truth.

A world is surfaces in metres with +z up and the objects among them. `record` writes scan.r3d, truth.json, prompts.json (random
clicks) and masks/NNNNNN.png (number of the object + 1, 0 = none). Renderer, light and sensor share no code with `r2c2r sample`
or with the second generator.
"""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import open3d as o3d
from recordings import random_clicks, write_prompts
from scipy.interpolate import Akima1DInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Faces, Image, Points
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.record3d import Record3DWriter
from r2c2r_core.synthetic.render import View
from r2c2r_core.synthetic.truth import Sightings, TrueJoint, TrueObject, truth_document

FPS = 10
DEPTH_SIZE = (256, 192)
_OVERSAMPLE = 2
_FOCAL = 0.76  # fraction of the image's width: a phone's main camera
_CAPTURE_FROM_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # ARKit's world is y-up


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """A mesh with one material."""

    vertices: Points  # (n, 3) world
    faces: Faces  # (m, 3)
    colour: np.ndarray  # (3,) linear, 0..1; times the texture
    texture: Image | None = None
    uv: np.ndarray | None = None  # (m, 3, 2) of the corners, repeating; v counts downwards
    gloss: float = 0.1
    thing: int = -1  # index in the world's objects, -1 for none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class World:
    """Surfaces to draw, ground truth, and the camera path."""

    surfaces: tuple[Surface, ...]
    things: tuple[TrueObject, ...]
    eyes: Points  # (k, 3) waypoints of the camera
    targets: Points  # (k, 3) looked at from there
    lights: Points  # (l, 3)


class Shot(NamedTuple):
    """One exposure at a multiple of the final resolution."""

    light: np.ndarray  # (h, w, 3) linear
    albedo: np.ndarray  # (h, w) grey
    depth_m: np.ndarray  # (h, w); 0 without a hit
    cosine: np.ndarray  # (h, w) between ray and surface
    thing: np.ndarray  # (h, w) index, -1 for none


def film(parser: argparse.ArgumentParser, world_of: Callable[[argparse.Namespace], World]) -> None:
    """Record the world that a command's options describe; adds the options of the film to those of the world."""
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    record(world_of(options), options.out, frames=options.frames, size=(width, height), seed=options.seed)


def record(world: World, out: Path, *, frames: int, size: tuple[int, int], seed: int) -> None:
    """Write the recording and its truth to the folder `out`."""
    (out / "masks").mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    poses = list(walk(world, frames, rng))
    capture_from_world = Rigid3(_CAPTURE_FROM_WORLD, -_CAPTURE_FROM_WORLD @ poses[0].translation)
    camera = Intrinsics(fx=_FOCAL * size[0], fy=_FOCAL * size[0], cx=size[0] / 2, cy=size[1] / 2, width=size[0], height=size[1])
    castable, sightings = _castable(world), Sightings(world.things)
    with Record3DWriter(path=out / "scan.r3d", fps=FPS) as writer:
        for number, pose in enumerate(poses):
            shot = expose(world, castable, camera.resized(size[0] * _OVERSAMPLE, size[1] * _OVERSAMPLE), pose)
            depth, confidence = sense(shot, rng)
            rgb = develop(shot, size, rng)
            writer.add(rgb, depth, confidence, camera, capture_from_world @ pose, number / FPS)
            ids = shot.thing[::_OVERSAMPLE, ::_OVERSAMPLE] + 1
            cv2.imwrite(str(out / "masks" / f"{number:06d}.png"), ids.astype(np.uint8))
            view = View(colour=rgb, patch=ids, depth_m=shot.depth_m[::_OVERSAMPLE, ::_OVERSAMPLE])
            sightings.add(number, view, ids, np.zeros(ids.shape, np.bool_), np.zeros(ids.shape, np.bool_), camera, pose, rng)
    truth = truth_document(world.things, capture_from_world, sightings)
    (out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    write_prompts(random_clicks(out, rng), out / "prompts.json")


def walk(world: World, frames: int, rng: np.random.Generator) -> Iterator[Rigid3]:
    """Poses (world_from_camera, OpenCV axes) along the path at constant speed, with tremor and tilt of the hand."""
    pace = np.linalg.norm(np.diff(world.eyes, axis=0), axis=1) + 0.5 * np.linalg.norm(np.diff(world.targets, axis=0), axis=1)
    knots = np.concatenate([[0.0], np.cumsum(pace + 0.1)])
    times = np.linspace(0.0, knots[-1], frames)
    shake = gaussian_filter1d(rng.standard_normal((frames, 7)), 1.5, axis=0, mode="wrap") * np.sqrt(3 * np.sqrt(np.pi))
    eyes = Akima1DInterpolator(knots, world.eyes, method="makima")(times) + 0.008 * shake[:, :3]
    targets = Akima1DInterpolator(knots, world.targets, method="makima")(times) + 0.02 * shake[:, 3:6]
    for eye, target, roll in zip(eyes, targets, np.radians(1.3) * shake[:, 6], strict=True):
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        level = np.column_stack([right, np.cross(forward, right), forward])
        yield Rigid3(level @ Rotation.from_euler("z", roll).as_matrix(), eye)


def expose(world: World, castable: Any, camera: Intrinsics, pose: Rigid3) -> Shot:
    """Ray-cast view, lit by a uniform sky of the room and by lamps that cast shadows."""
    rays = pose.turn(pixel_rays(pixel_centres(camera), camera).reshape(-1, 3))
    hit = castable.cast_rays(_rays(np.broadcast_to(pose.translation, rays.shape), rays), nthreads=1)
    depth = hit["t_hit"].numpy()  # rays of length 1 along z
    met = np.isfinite(depth)
    depth = np.where(met, depth, 0.0).astype(np.float32)
    surface = np.where(met, hit["geometry_ids"].numpy().astype(np.int64), -1)
    points = pose.translation + rays * depth[:, None]
    towards = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    normals = hit["primitive_normals"].numpy().astype(np.float64)
    normals *= np.where((normals * towards).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    albedo, gloss = _materials(world, surface, hit["primitive_ids"].numpy().astype(np.int64), hit["primitive_uvs"].numpy())
    light = albedo * (0.22 + 0.08 * normals[:, 2:3])
    for lamp in world.lights:
        lit, shine = _lamp(castable, lamp, points, normals, towards)
        light += albedo * lit[:, None] + (gloss * shine)[:, None]
    shape = (camera.height, camera.width)
    things = np.append([each.thing for each in world.surfaces], -1)
    return Shot(
        light=np.where(met[:, None], light, 0.4).reshape(*shape, 3),
        albedo=albedo.mean(axis=1).reshape(shape),
        depth_m=depth.reshape(shape),
        cosine=(normals * towards).sum(axis=1).reshape(shape),
        thing=things[surface].reshape(shape),
    )


def sense(shot: Shot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Depth (metres, NaN without a return) and confidence 0..2 as from a phone's LiDAR.

    A pixel averages its beam's footprint, which gives flying pixels at edges; noise grows with the square of the range and with
    the slant, and is mostly correlated over some ten pixels; returns from dark, slanted and far surfaces are weak.
    """
    there = (shot.depth_m > 0).astype(np.float32)
    mixed = _shrunk(shot.depth_m) / np.maximum(_shrunk(there), 1e-6)
    centre = cv2.resize(shot.depth_m, DEPTH_SIZE, interpolation=cv2.INTER_NEAREST)
    step = cv2.dilate(mixed, np.ones((3, 3))) - cv2.erode(mixed, np.ones((3, 3)))
    edge = step > 0.02 + 0.03 * mixed
    smooth = np.where(edge, mixed, cv2.bilateralFilter(0.5 * (mixed + centre), 5, 0.02, 1.2))
    cosine = np.clip(_shrunk(shot.cosine), 0.1, 1.0)
    even = cv2.resize(rng.standard_normal((20, 26)).astype(np.float32), DEPTH_SIZE, interpolation=cv2.INTER_CUBIC)
    sigma = (0.0015 + 0.0015 * smooth**2) / np.sqrt(cosine)
    depth = smooth + sigma * (0.8 * even + 0.5 * rng.standard_normal(smooth.shape)) + 0.001 * rng.standard_normal()
    answer = _shrunk(shot.albedo) * cosine / np.maximum(smooth, 0.5) ** 2 + 0.002 * rng.standard_normal(smooth.shape)
    lost = (_shrunk(there) < 0.5) | (smooth > 5.0) | (answer < 0.0)
    confidence = np.full(smooth.shape, 2, np.uint8)
    confidence[(answer < 0.012) | (cosine < 0.25) | edge] = 1
    confidence[lost | (answer < 0.003)] = 0
    return np.where(lost, np.nan, depth).astype(np.float32), confidence


def develop(shot: Shot, size: tuple[int, int], rng: np.random.Generator) -> Image:
    """The picture: random exposure, lens blur, noise, and encoding."""
    linear = cv2.resize(shot.light, size, interpolation=cv2.INTER_AREA) * (1 + 0.03 * rng.standard_normal())
    soft = cv2.GaussianBlur(linear, (0, 0), 0.5) + 0.006 * rng.standard_normal(linear.shape)
    return np.asarray(255 * np.clip(soft, 0, 1) ** (1 / 2.2) + 0.5, dtype=np.uint8)


def box_of(vertices: Points, front: Points, yaw_rad: float) -> tuple[np.ndarray, Rigid3]:
    """Size and pose of the bounding box of a front (its y) and what is behind it; the front faces -y after the yaw."""
    turn = Rotation.from_euler("z", yaw_rad).as_matrix()
    own, face = vertices @ turn, front @ turn
    low, high = own.min(axis=0), own.max(axis=0)
    low[1] = face[:, 1].min()
    return high - low, Rigid3(turn, turn @ (low + high) / 2)


def joint_of(
    name: str, kind: str, axis: np.ndarray, origin: np.ndarray, limits: tuple[float, float], pose: Rigid3
) -> TrueJoint:
    """A joint of a closed object, with its sign chosen so that it opens towards positive values."""
    opens = 1.0 if limits[1] > -limits[0] else -1.0
    side = pose.inverse.apply(np.asarray(origin))[0]
    return TrueJoint(
        name=f"{name}_joint",
        type=kind,
        axis=opens * np.asarray(axis, dtype=np.float64),
        origin=np.asarray(origin, dtype=np.float64),
        lower=0.0,
        upper=max(abs(limits[0]), abs(limits[1])),
        hinge=None if kind == "prismatic" else "left" if side < 0 else "right",
    )


def panel(corner: Sequence[float], across: Sequence[float], up: Sequence[float], colour: Sequence[float]) -> Surface:
    """A flat rectangle of the room."""
    start, a, b = np.asarray(corner, float), np.asarray(across, float), np.asarray(up, float)
    vertices = np.array([start, start + a, start + a + b, start + b])
    return Surface(vertices=vertices, faces=np.array([[0, 1, 2], [0, 2, 3]]), colour=np.asarray(colour, float))


def room(low: Sequence[float], high: Sequence[float], wall: Sequence[float], floor: Sequence[float]) -> tuple[Surface, ...]:
    """Floor and four walls of the box from `low` to `high`."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    wide, deep, tall = [x1 - x0, 0, 0], [0, y1 - y0, 0], [0, 0, z1 - z0]
    ground = panel((x0, y0, z0), wide, deep, floor)
    starts = (((x0, y1, z0), wide), ((x0, y0, z0), wide), ((x0, y0, z0), deep), ((x1, y0, z0), deep))
    return (ground, *(panel(corner, across, tall, wall) for corner, across in starts))


def _castable(world: World) -> Any:
    scene = o3d.t.geometry.RaycastingScene()
    for each in world.surfaces:
        scene.add_triangles(o3d.core.Tensor(each.vertices.astype(np.float32)), o3d.core.Tensor(each.faces.astype(np.uint32)))
    return scene


def _rays(origins: Points, directions: Points) -> Any:
    return o3d.core.Tensor(np.concatenate([origins, directions], axis=1).astype(np.float32))


def _materials(world: World, surface: np.ndarray, face: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Colour (n, 3) and gloss (n,) at ray hits: of the surface, at a face's barycentric coordinates."""
    colours, gloss = np.zeros((len(surface), 3)), np.zeros(len(surface))
    for index in np.unique(surface[surface >= 0]):
        each, at = world.surfaces[index], surface == index
        colours[at], gloss[at] = each.colour, each.gloss
        if each.texture is not None and each.uv is not None:
            corners, place = each.uv[face[at]], inside[at]
            share = np.column_stack([1 - place.sum(axis=1), place])
            colours[at] *= _sampled(each.texture, (corners * share[..., None]).sum(axis=1))
    return colours, gloss


def _sampled(texture: Image, uv: np.ndarray) -> np.ndarray:
    """Linear colour (n, 3) of a repeating texture."""
    height, width = texture.shape[:2]
    place = (uv % 1.0 * [width, height]).astype(np.float32)
    wide = 30_000  # cv2.remap takes images of at most 32767 columns
    rows = [
        cv2.remap(texture, part[None, :, 0], part[None, :, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)[0]
        for part in np.array_split(place, len(place) // wide + 1)
    ]
    return np.asarray((np.concatenate(rows) / 255.0) ** 2.2)


def _lamp(castable: Any, lamp: np.ndarray, points: Points, normals: Points, towards: Points) -> tuple[np.ndarray, np.ndarray]:
    """Diffuse light and highlight (n,) of one lamp, with shadows."""
    way = lamp - points
    far = np.linalg.norm(way, axis=1)
    unit = way / far[:, None]
    start = points + 0.002 * normals
    shadow = castable.test_occlusions(_rays(start, lamp - start), tnear=0.0, tfar=1.0, nthreads=1).numpy()
    falling = np.where(shadow, 0.0, np.clip((unit * normals).sum(axis=1), 0, 1)) / (0.9 + 0.3 * far**2)
    between = unit + towards
    between /= np.linalg.norm(between, axis=1, keepdims=True) + 1e-9
    return falling, np.where(shadow, 0.0, np.clip((between * normals).sum(axis=1), 0, 1) ** 60)


def _shrunk(image: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.resize(np.asarray(image, np.float32), DEPTH_SIZE, interpolation=cv2.INTER_AREA))
