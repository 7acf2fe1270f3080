"""Load a URDF in yourdfpy: its values, and the errors of its own validation."""

import logging
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by yourdfpy, with all meshes loaded."""
    import yourdfpy

    logger = logging.getLogger("yourdfpy.urdf")
    level = logger.level
    try:
        logger.setLevel(logging.CRITICAL)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            robot = yourdfpy.URDF.load(str(scene), load_meshes=True, build_scene_graph=True)
            valid = robot.validate()
            robot.update_cfg(robot.zero_cfg)
    finally:
        logger.setLevel(level)
    problem = "" if valid else f"validate() says {[str(e) for e in robot.errors][:2]}"
    visuals = sum(len(link.visuals) for link in robot.robot.links)
    if len(robot.scene.geometry) < visuals:
        problem = f"{len(robot.scene.geometry)} of {visuals} visuals loaded"
    return {
        "version": f"yourdfpy {version('yourdfpy')}",
        "joints": {j.name: _joint(j, robot) for j in robot.robot.joints if j.type in ("revolute", "prismatic")},
        "bodies": {x.name: _body(x, robot) for x in robot.robot.links if x.inertial is not None and x.name != "world"},
        "problem": problem,
    }


def _joint(joint: Any, robot: Any) -> dict[str, Any]:
    pose = robot.get_transform(joint.child)
    dynamics, limit = joint.dynamics, joint.limit
    return {
        "type": joint.type,
        "axis_world": pose[:3, :3] @ joint.axis,
        "origin_world": pose[:3, 3],
        "lower": _number(limit and limit.lower),
        "upper": _number(limit and limit.upper),
        "damping": _number(dynamics and dynamics.damping),
        "friction": _number(dynamics and dynamics.friction),
        "effort": _number(limit and limit.effort),
        "velocity": _number(limit and limit.velocity),
    }


def _body(link: Any, robot: Any) -> dict[str, Any]:
    pose = robot.get_transform(link.name)
    origin = np.eye(4) if link.inertial.origin is None else link.inertial.origin
    inertia = np.full((3, 3), np.nan) if link.inertial.inertia is None else link.inertial.inertia
    principal = pose @ origin
    return {
        "mass_kg": _number(link.inertial.mass),
        "com_world": principal[:3, 3],
        "inertia_world": principal[:3, :3] @ inertia @ principal[:3, :3].T,
        "rotation_world": pose[:3, :3],
        "origin_world": pose[:3, 3],
        "colliders": len(link.collisions),
    }


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
