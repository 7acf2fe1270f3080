"""Renderings of the fused scan from above and from the filming side, with the camera path, on a transparent background."""

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import UInt8

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture

Picture = UInt8[np.ndarray, "h w 4"]  # RGBA

_SUPERSAMPLE = 2
_FILL = 0.94  # of the picture
_FAR_M = 14.0  # from so far away a plan hardly shows perspective; the rasteriser sees 20 m
_PATH = ((33, 102, 214), (239, 120, 32))  # from the first frame to the last
_INK = (128, 136, 148)  # of the scale: to be read on white and on black


class ScanPictures(NamedTuple):
    """Two renderings of a scan."""

    plan: Picture
    view: Picture


def draw_scan(capture: Capture, size: tuple[int, int] = (960, 640)) -> ScanPictures:
    """Renderings of `size` (width, height) of the fused surface from above and from the side it was filmed from."""
    centres = np.array([f.world_from_camera.translation for f in capture.frames])
    points = capture.surface.vertices_world
    held = np.vstack([_bulk(points), centres]) if len(points) else centres
    toward = centres.mean(axis=0) - (np.median(points, axis=0) if len(points) else 0.0)
    yaw = capture.room.manhattan_yaw_rad
    away = toward * (1.0, 1.0, 0.0) if np.linalg.norm(toward[:2]) > 0.1 else np.array([-np.sin(yaw), -np.cos(yaw), 0.0])
    plan = _framing(held, np.array([0.0, 0.0, 1.0]), _plan_up(away, yaw), size, _FAR_M)
    view = _framing(held, away / np.linalg.norm(away) + (0.0, 0.0, 0.75), np.array([0.0, 0.0, 1.0]), size, None)
    return ScanPictures(
        plan=_scale(_drawn(capture, centres, *plan), plan[0], _FAR_M),
        view=_drawn(capture, centres, *view),
    )


def side_by_side(pictures: ScanPictures) -> UInt8[np.ndarray, "h w 3"]:
    """Both renderings side by side on white."""
    both = np.concatenate(pictures, axis=1)
    alpha = both[..., 3:].astype(np.float32) / 255
    return np.rint(both[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)


def _plan_up(away: Vector3, yaw: float) -> Vector3:
    """Direction that points up in the plan: away from the cameras, along the walls."""
    directions = [np.array([np.cos(yaw + k * np.pi / 2), np.sin(yaw + k * np.pi / 2), 0.0]) for k in range(4)]
    return min(directions, key=lambda d: float(d @ away))


def _bulk(points: Points) -> Points:
    """A subset of the points without outliers (0.5 % quantiles on both sides)."""
    some = points[:: max(1, len(points) // 20_000)]
    low, high = np.quantile(some, (0.005, 0.995), axis=0)
    return some[((some >= low) & (some <= high)).all(axis=1)]


def _framing(
    points: Points, backward: Vector3, up: Vector3, size: tuple[int, int], distance_m: float | None
) -> tuple[Intrinsics, Rigid3]:
    """A camera looking against `backward` that frames the points, and camera_from_world; at `distance_m`, or close."""
    back = backward / np.linalg.norm(backward)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, -np.cross(back, right), -back])
    seen = points @ rotation.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    reach = float(np.abs(seen - middle).max())
    distance = distance_m or min(2.0 * reach + 0.5, _FAR_M)
    z = np.maximum(seen[:, 2] - middle[2] + distance, 0.1)
    slopes = (seen - middle)[:, :2] / z[:, None]
    low, high = slopes.min(axis=0), slopes.max(axis=0)
    width, height = (side * _SUPERSAMPLE for side in size)
    focal = float((_FILL * np.array([width, height]) / np.maximum(high - low, 0.02)).min())
    cx, cy = np.array([width, height]) / 2 - focal * (low + high) / 2
    camera = Intrinsics(fx=focal, fy=focal, cx=float(cx), cy=float(cy), width=width, height=height)
    return camera, Rigid3(rotation, np.array([-middle[0], -middle[1], distance - middle[2]]))


def _drawn(capture: Capture, centres: Points, camera: Intrinsics, camera_from_world: Rigid3) -> Picture:
    """The surface without back faces, lit from the camera, with the camera path drawn on top."""
    vertices, faces = capture.surface.vertices_world, capture.surface.faces
    image = np.zeros((camera.height, camera.width, 4), np.uint8)
    if len(faces):
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        eye = camera_from_world.inverse.translation
        toward = eye - a
        facing = np.einsum("nd,nd->n", normals, toward / np.linalg.norm(toward, axis=1, keepdims=True))
        near = facing > 0.02
        light = np.ones(len(vertices))
        light[faces[near].ravel()] = np.repeat(0.72 + 0.33 * facing[near], 3)
        lit = np.clip(capture.surface.colours * light[:, None], 0, 255)
        raster = rasterize(vertices, faces[near], lit, camera, camera_from_world)
        image[..., :3] = np.rint(raster.attributes)
        image[..., 3] = np.where(raster.depth_m > 0, 255, 0)
    _draw_path(image, project(camera_from_world.apply(centres), camera))
    size = (camera.width // _SUPERSAMPLE, camera.height // _SUPERSAMPLE)
    # Colours are weighted by opacity while shrinking, so that the empty background does not darken the borders
    alpha = cv2.resize(image[..., 3].astype(np.float32), size, interpolation=cv2.INTER_AREA)
    weighed = cv2.resize(image[..., :3] * (image[..., 3:] / np.float32(255)), size, interpolation=cv2.INTER_AREA)
    colour = weighed / np.maximum(alpha[..., None] / 255, 1e-3)
    return np.dstack([np.clip(np.rint(colour), 0, 255), np.rint(alpha)]).astype(np.uint8)


def _draw_path(image: np.ndarray, path_px: np.ndarray) -> None:
    """Draw the path with a white outline and a colour gradient from start to end."""
    dots = np.rint(path_px * 16).astype(np.int32)
    share = np.linspace(0.0, 1.0, len(dots))[:, None]
    colours = np.rint((1 - share) * _PATH[0] + share * _PATH[1])
    for width, tinted in ((9, False), (5, True)):
        for k in range(len(dots) - 1):
            colour = (*colours[k].tolist(), 255) if tinted else (255, 255, 255, 255)
            cv2.line(image, dots[k].tolist(), dots[k + 1].tolist(), colour, width, cv2.LINE_AA, 4)
    for k in (0, len(dots) - 1):
        cv2.circle(image, dots[k].tolist(), 13 * 16, (255, 255, 255, 255), -1, cv2.LINE_AA, 4)
        cv2.circle(image, dots[k].tolist(), 10 * 16, (*colours[k].tolist(), 255), -1, cv2.LINE_AA, 4)


def _scale(image: Picture, camera: Intrinsics, distance_m: float) -> Picture:
    """The plan with a scale bar of one metre."""
    metre = round(camera.fx / _SUPERSAMPLE / distance_m)
    left, bottom = 16, image.shape[0] - 16
    ink = (*_INK, 255)
    cv2.line(image, (left, bottom), (left + metre, bottom), ink, 2)
    for x in (left, left + metre):
        cv2.line(image, (x, bottom - 5), (x, bottom + 5), ink, 2)
    cv2.putText(image, "1 m", (left + 8, bottom - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.55, ink, 1, cv2.LINE_AA)
    return image
