"""Light and camera, the same in scene.xml, scene.usda and scene.sdf; and scene.xml's own elements for them and the floor.

The camera is in front of the fronts, the sun over its left shoulder.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.export.plan import Plan, collider_corners_world, facing
from r2c2r_core.export.writers.text import numbers
from r2c2r_core.geometry.transforms import Rigid3

CAMERA, SUN = "front", "sun"
FOVY_DEG = 40.0
PICTURE = (1920, 1080)  # the largest picture that `mujoco.Renderer` renders unchanged; MuJoCo's default is 640 x 480
# textures of a scan contain the light they were taken in: strong ambient light keeps their colours
AMBIENT, SUNLIGHT = 0.5, 0.45

_NARROWEST, _FILLED = 1.3, 0.8  # narrowest aspect ratio that still shows everything, and the fraction of it filled
_SHADOW_PX = 8192  # 1 mm in a kitchen: the default gives stepped shadow edges


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """Light and camera of a scene, in the world."""

    centre: Vector3
    radius_m: float  # of a sphere about the scene
    sun: Vector3  # unit, towards the sun
    world_from_camera: Rigid3  # the camera's axes are right, up, backward


def view_of(plan: Plan) -> View:
    """The scene's light and camera."""
    corners, forward = _corners(plan), -_facing(plan)
    low, high = corners.min(axis=0), corners.max(axis=0)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    sun = -0.8 * forward - 0.5 * right + np.array([0.0, 0.0, 1.3])
    eye, axes = _eye(corners, -forward + 0.35 * right + np.array([0.0, 0.0, 0.45]))
    return View(
        centre=(low + high) / 2,
        radius_m=max(float(np.linalg.norm(high - low)) / 2, 0.2),
        sun=sun / np.linalg.norm(sun),
        world_from_camera=Rigid3(axes.T, eye),
    )


def add_view(root: ET.Element, plan: Plan) -> None:
    """Add <statistic> and <visual>: the viewer's framing and lighting."""
    view = view_of(plan)
    ET.SubElement(root, "statistic", center=numbers(view.centre), extent=numbers(view.radius_m))
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "headlight", ambient=numbers([AMBIENT] * 3), diffuse="0.25 0.25 0.25", specular="0 0 0")
    ET.SubElement(visual, "global", fovy=numbers(FOVY_DEG), offwidth=str(PICTURE[0]), offheight=str(PICTURE[1]))
    ET.SubElement(visual, "quality", shadowsize=str(_SHADOW_PX))
    ET.SubElement(visual, "map", shadowclip="2")


def add_surroundings(worldbody: ET.Element, plan: Plan, surface: dict[str, str]) -> None:
    """Add sun, camera and floor; `surface` are the floor's contact parameters."""
    view = view_of(plan)
    light = {"name": SUN, "type": "directional", "diffuse": numbers([SUNLIGHT] * 3), "specular": "0 0 0"}
    # a directional light casts shadows only around its position
    at = {"pos": numbers(view.centre + view.radius_m * view.sun), "dir": numbers(-view.sun)}
    ET.SubElement(worldbody, "light", light | at)
    eye, axes = view.world_from_camera.translation, view.world_from_camera.rotation.T
    ET.SubElement(worldbody, "camera", name=CAMERA, pos=numbers(eye), xyaxes=numbers(axes[:2]), fovy=numbers(FOVY_DEG))
    floor = {"name": "floor", "type": "plane", "size": "0 0 0.05", "pos": numbers([0, 0, plan.floor_z_m])}
    ET.SubElement(worldbody, "geom", {**surface, **floor, "group": "1", "material": "floor", "rgba": "1 1 1 1"})


def _facing(plan: Plan) -> np.ndarray:
    found = facing(plan)
    return np.array([0.0, -1.0, 0.0]) if found is None else found


def _eye(corners: np.ndarray, backward: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position of a camera that sees all corners, looking along -backward, and its axes: right, up, backward (rows)."""
    backward = backward / np.linalg.norm(backward)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(backward, right), backward])
    seen = corners @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    x, y, z = np.abs(seen - middle)[:, 0], np.abs(seen - middle)[:, 1], (seen - middle)[:, 2]
    slope = np.tan(np.radians(FOVY_DEG / 2)) * _FILLED
    away = float(np.max(np.maximum(x / (slope * _NARROWEST), y / slope) + z))
    return middle @ axes + away * backward, axes


def _corners(plan: Plan) -> np.ndarray:
    return np.concatenate([points for body in plan.bodies for points in collider_corners_world(body)] or [np.zeros((1, 3))])
