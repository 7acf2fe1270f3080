"""preview.png: the scene closed and open, drawn on the CPU with a sun, its shadow and a floor."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Points, Vector3
from r2c2r_core.export.plan import WORLD, Body, Plan, facing
from r2c2r_core.export.states import states_of
from r2c2r_core.export.writers.meshes import boxes_mesh, png_bytes
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.texels import texture_colours
from r2c2r_core.geometry.transforms import Rigid3, joint_transform, rotation_between
from r2c2r_core.threads import in_threads

OPEN_FRACTION = 0.75
"""How far joints stand open in the picture: doors at full travel hide behind their own edge."""

_SUPERSAMPLE = 1.5
_LONG = 1.9  # aspect ratio above which the two pictures are stacked vertically
_SUN_FROM = np.array([-0.45, -0.35, 1.0])  # in the view's axes right, back, up
_BACKGROUND = np.array([244.0, 245.0, 247.0], np.float32)
_FLOOR = np.array([222.0, 221.0, 218.0], np.float32)
_UP = np.array([0.0, 0.0, 1.0], np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Soup:
    """Triangle soup of the scene (unshared corners), in the world."""

    corners: Points  # (3 m, 3)
    uv: np.ndarray  # (3 m, 2)
    normals: np.ndarray  # (3 m, 3), flat
    ids: np.ndarray  # (3 m,), body number + 1
    textures: tuple[Image | None, ...]  # by body; None: its colour
    colours: np.ndarray  # (bodies, 3), 0..255


def preview_png(plan: Plan, seen_from: Vector3 | None, width_px: int = 1600) -> bytes:
    """PNG of the scene closed and open, side by side or, for a long kitchen, one above the other.

    `seen_from` is a world position from which the scan was filmed.
    """
    closed, opened = scene_soup(plan, 0.0), scene_soup(plan, OPEN_FRACTION, states_of(plan)["open"].joints)
    points, direction = np.concatenate([closed.corners, opened.corners]), _view_from(plan, seen_from)
    across, high = np.ptp(points @ _view_axes(direction).T, axis=0)[:2]
    stacked = across > _LONG * high
    size = (width_px * 3 // 4, round(width_px * 0.32)) if stacked else (width_px // 2, round(width_px * 0.4))
    camera, camera_from_world = framing(points, direction, size)

    def picture(of: tuple[Soup, str]) -> Image:
        return _captioned(draw(of[0], plan.floor_z_m, camera, camera_from_world), of[1])

    pictures = list(in_threads(picture, ((closed, "closed"), (opened, "open"))))
    return png_bytes(np.concatenate(pictures, axis=0 if stacked else 1))


def scene_soup(plan: Plan, fraction: float, joints: Collection[str] | None = None) -> Soup:
    """The triangles of the scene with these joints (None: all) at `fraction` of their range, the others closed."""
    corners, uvs, ids, textures = [], [], [], []
    poses = poses_at(plan, fraction, joints)
    for number, body in enumerate(plan.bodies, start=1):
        visual = body.link.visual
        vertices, faces = (visual.vertices, visual.faces) if visual is not None else boxes_mesh(body)
        corners.append(poses[body.name].apply(vertices[faces].reshape(-1, 3)))
        uvs.append(visual.uv[faces].reshape(-1, 2) if visual is not None else np.zeros((3 * len(faces), 2)))
        ids.append(np.full(3 * len(faces), float(number)))
        textures.append(None if visual is None else np.ascontiguousarray(visual.texture))
    all_corners = np.concatenate(corners)
    a, b, c = all_corners[0::3], all_corners[1::3], all_corners[2::3]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return Soup(
        corners=all_corners,
        uv=np.concatenate(uvs),
        normals=np.repeat(normal, 3, axis=0),
        ids=np.concatenate(ids),
        textures=tuple(textures),
        colours=np.array([[255.0 * c for c in body.link.colour] for body in plan.bodies], np.float32),
    )


def poses_at(plan: Plan, fraction: float, joints: Collection[str] | None = None) -> dict[str, Rigid3]:
    """world_from_body of every body with these joints (None: all) at `fraction` of their range, the others closed."""
    poses = {WORLD: Rigid3()}
    for body in plan.bodies:
        share = fraction if joints is None or body.joint_name in joints else 0.0
        poses[body.name] = poses[body.parent] @ body.parent_from_body @ _motion(body, share)
    return poses


def framing(points_world: Points, direction: Vector3, size: tuple[int, int]) -> tuple[Intrinsics, Rigid3]:
    """A camera looking along -`direction` that frames all points with a margin, and camera_from_world."""
    width, height = size
    focal = 1.35 * height
    camera = Intrinsics(fx=focal, fy=focal, cx=width / 2, cy=height / 2, width=width, height=height)
    rotation = _view_axes(direction)
    seen = points_world @ rotation.T
    centre = (seen.min(axis=0) + seen.max(axis=0)) / 2
    distance = 0.0
    for _ in range(4):  # perspective shifts the image centre: re-centre and fit again
        x, y, z = (seen - centre).T
        reach = np.maximum(np.abs(x) / (width / 2 * 0.94), np.abs(y) / (height / 2 * 0.9)) * focal
        distance = float(max((reach - z).max(), 0.4 - z.min()))
        for axis, values in ((0, x), (1, y)):
            slopes = values / (z + distance)
            centre[axis] += (slopes.min() + slopes.max()) / 2 * distance
    return camera, Rigid3(rotation, np.array([-centre[0], -centre[1], distance - centre[2]]))


def _view_axes(direction: Vector3) -> np.ndarray:
    """Rotation camera_from_world (rows: right, down, forward) of an upright camera that looks along -`direction`."""
    backward = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    return np.stack([right, -np.cross(backward, right), -backward])


def draw(soup: Soup, floor_z_m: float, camera: Intrinsics, camera_from_world: Rigid3) -> Image:
    """The lit scene on its floor."""
    large = camera.resized(round(camera.width * _SUPERSAMPLE), round(camera.height * _SUPERSAMPLE))
    marks = rasterize(soup.corners, soup_faces(soup), np.column_stack([soup.uv, soup.ids]), large, camera_from_world)
    normals = rasterize(soup.corners, soup_faces(soup), soup.normals, large, camera_from_world).attributes
    points, depth = _floor_behind(marks.depth_m, floor_z_m, large, camera_from_world)
    on_floor = (marks.depth_m == 0) & (depth > 0)
    colour = albedo(soup, marks.attributes)
    colour[on_floor] = _FLOOR
    normals = np.where(on_floor[..., None], _UP, _facing(normals, points, camera_from_world))
    sun = _sun_direction(camera_from_world)
    light = _light(normals, sun, _sunlit(soup, points, depth > 0, sun)) * _contact_shade(depth, large)
    lit = np.where((depth > 0)[..., None], colour * light[..., None], _BACKGROUND)
    fade = _floor_fade(points, soup, on_floor)[..., None]
    lit = lit * (1 - fade) + _BACKGROUND * fade
    image = np.asarray(lit.clip(0, 255), dtype=np.uint8)
    return np.asarray(cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def alone(soup: Soup, bodies: Collection[int]) -> Soup:
    """The triangles of these bodies (numbers from 1) only."""
    own = np.isin(np.rint(soup.ids), [*bodies])
    return replace(soup, corners=soup.corners[own], uv=soup.uv[own], normals=soup.normals[own], ids=soup.ids[own])


def soup_faces(soup: Soup) -> np.ndarray:
    """Triangles over the soup's corners."""
    return np.arange(len(soup.corners)).reshape(-1, 3)


def _motion(body: Body, fraction: float) -> Rigid3:
    joint, axis = body.joint, body.axis_body
    if joint is None or axis is None:
        return Rigid3()
    return joint_transform(axis, np.zeros(3), fraction * joint.upper, turns=joint.type == "revolute")


def _view_from(plan: Plan, seen_from: Vector3 | None) -> Vector3:
    """Direction from the scene to the camera: the fronts' facing direction, turned towards the filming position."""
    fronts = facing(plan)
    towards = np.zeros(3)
    if seen_from is not None:
        centre = np.mean([body.world_from_body.translation for body in plan.bodies], axis=0)
        away = np.asarray(seen_from, dtype=np.float64) - centre
        away[2] = 0.0
        towards = away / np.linalg.norm(away) if np.linalg.norm(away) > 0.2 else towards
    front = towards + (np.zeros(3) if fronts is None else fronts * (0.5 if towards.any() else 1.0))
    front = front / np.linalg.norm(front) if np.linalg.norm(front) > 1e-3 else np.array([0.0, -1.0, 0.0])
    side = np.cross([0.0, 0.0, 1.0], front)
    return front + 0.35 * side + np.array([0.0, 0.0, 0.5])  # three quarters view: depth shows


def albedo(soup: Soup, marks: np.ndarray) -> np.ndarray:
    """Unlit colours (h, w, 3) of the pixels marked with uv and body id."""
    ids = np.rint(marks[..., 2]).astype(np.int32)
    colour = np.concatenate([_BACKGROUND[None], soup.colours])[ids.clip(0, len(soup.colours))]
    shown = np.flatnonzero(ids)
    shown = shown[np.argsort(ids.ravel()[shown], kind="stable")]
    ends = np.searchsorted(ids.ravel()[shown], np.arange(len(soup.textures) + 1), side="right")
    for texture, start, end in zip(soup.textures, ends[:-1], ends[1:], strict=True):
        if texture is not None and end > start:
            pixels = shown[start:end]
            colour.reshape(-1, 3)[pixels] = texture_colours(texture, marks.reshape(-1, 3)[pixels, :2])
    return colour


def shaded(colour: np.ndarray, normals: np.ndarray, camera_from_world: Rigid3) -> np.ndarray:
    """Colours with headlight shading and without shadows, for small pictures."""
    length = np.maximum(np.linalg.norm(normals, axis=-1), 1e-6)
    towards_eye = np.abs(normals @ camera_from_world.rotation[2]) / length
    return np.asarray(colour * (0.8 + 0.2 * towards_eye)[..., None])  # textures of a scan already contain its light


def _floor_behind(
    depth: np.ndarray, floor_z_m: float, camera: Intrinsics, camera_from_world: Rigid3
) -> tuple[np.ndarray, np.ndarray]:
    """World points (h, w, 3) and depth with the floor plane filled in where nothing else is visible; 0 is the sky."""
    world_from_camera = camera_from_world.inverse
    rays = pixel_rays(pixel_centres(camera), camera).astype(np.float32) @ camera_from_world.rotation.astype(np.float32)
    slopes = rays[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        to_floor = (floor_z_m - world_from_camera.translation[2]) / slopes
    seen_floor = (depth == 0) & (to_floor > 0) & (to_floor < 60)
    filled = np.where(seen_floor, to_floor, depth).astype(np.float32)
    return rays * filled[..., None] + world_from_camera.translation.astype(np.float32), filled


def _facing(normals: np.ndarray, points: np.ndarray, camera_from_world: Rigid3) -> np.ndarray:
    """Unit normals turned towards the camera, as fitted meshes may be open."""
    towards = camera_from_world.inverse.translation.astype(np.float32) - points
    away = np.einsum("hwi,hwi->hw", normals, towards) < 0
    length = np.maximum(np.sqrt(np.einsum("hwi,hwi->hw", normals, normals)), np.float32(1e-6))
    return np.asarray(normals * (np.where(away, np.float32(-1), np.float32(1)) / length)[..., None])


def _sun_direction(camera_from_world: Rigid3) -> Vector3:
    """Direction to the sun, in the world: over the viewer's left shoulder."""
    right, backward = camera_from_world.rotation[0], -camera_from_world.rotation[2]
    backward = np.array([backward[0], backward[1], 0.0]) / np.linalg.norm(backward[:2])
    sun = _SUN_FROM[0] * right - _SUN_FROM[1] * 2.2 * backward + _SUN_FROM[2] * np.array([0.0, 0.0, 1.0])
    return np.asarray(sun / np.linalg.norm(sun))


def _sunlit(soup: Soup, points: np.ndarray, valid: np.ndarray, sun: Vector3) -> np.ndarray:
    """Sun visibility of each point, 0..1, by a shadow map with soft edges."""
    low, high = soup.corners.min(axis=0), soup.corners.max(axis=0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2 + 0.05
    distance = min(6.0 * radius, 19.5 - radius) if radius < 9.0 else 2.0 * radius
    size = 1400
    focal = size / 2 * np.sqrt(max(distance**2 - radius**2, 1e-3)) / radius
    camera = Intrinsics(fx=focal, fy=focal, cx=size / 2, cy=size / 2, width=size, height=size)
    rotation = rotation_between(-sun, np.array([0.0, 0.0, 1.0]))
    sun_from_world = Rigid3(rotation, np.array([0.0, 0.0, distance]) - rotation @ centre)
    depth = rasterize(soup.corners, soup_faces(soup), soup.normals, camera, sun_from_world).depth_m
    turn, shift = rotation.astype(np.float32), sun_from_world.translation.astype(np.float32)
    across, along, z = (
        points[..., 0] * a[0] + points[..., 1] * a[1] + points[..., 2] * a[2] + b for a, b in zip(turn, shift, strict=True)
    )
    z = np.where(valid, z, np.float32(1.0))
    x, y = np.float32(focal) * across / z + size / 2 - 0.5, np.float32(focal) * along / z + size / 2 - 0.5
    lit = np.zeros(valid.shape, np.float32)
    offsets = [(dx, dy) for dx in (-2.0, 0.0, 2.0) for dy in (-2.0, 0.0, 2.0)]
    for dx, dy in offsets:
        nearest = cv2.remap(depth, x + np.float32(dx), y + np.float32(dy), cv2.INTER_NEAREST)
        lit += (nearest == 0) | (nearest > z - 0.015)
    return lit / len(offsets)


def _light(normals: np.ndarray, sun: Vector3, sunlit: np.ndarray) -> np.ndarray:
    diffuse = np.maximum(normals @ sun.astype(np.float32), np.float32(0)) * sunlit
    sky = 0.5 + 0.5 * normals[..., 2]
    return np.asarray(0.52 + 0.14 * sky + 0.46 * diffuse)


def _contact_shade(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Ambient-occlusion factor 0.78..1 where pixels a few centimetres around are nearer, to show gaps and corners."""
    shade = np.ones_like(depth)
    near = np.where(depth > 0, depth, depth.max())
    middle = float(np.median(depth[depth > 0])) if (depth > 0).any() else 1.0
    for width_m, strength in ((0.008, 0.16), (0.03, 0.06)):
        sigma = max(width_m * camera.fx / middle, 0.8)
        gap = near - cv2.GaussianBlur(near.astype(np.float32), (0, 0), sigma)
        shade -= strength * (gap / width_m).clip(0.0, 1.0)
    return shade


def _floor_fade(points: np.ndarray, soup: Soup, on_floor: np.ndarray) -> np.ndarray:
    """Fading of the floor into the background, 0..1, by distance from the scene."""
    low, high = soup.corners.min(axis=0)[:2], soup.corners.max(axis=0)[:2]
    floor = points[on_floor][:, :2]
    outside = np.linalg.norm(np.maximum(np.maximum(low - floor, floor - high), 0.0), axis=1)
    reach = max(float(np.linalg.norm(high - low)) * 0.5, 0.5)
    fade = np.zeros(on_floor.shape, np.float32)
    fade[on_floor] = (outside / reach).clip(0, 1)
    return fade


def _captioned(image: Image, caption: str) -> Image:
    picture = image.copy()
    cv2.putText(picture, caption, (22, 40), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (90, 94, 102), 1, cv2.LINE_AA)
    return picture
