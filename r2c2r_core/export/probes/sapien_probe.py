"""Load a URDF in SAPIEN and write out its values: `python sapien_probe.py scene.urdf answer.json`.

Runs in SAPIEN's own environment, so it imports nothing from r2c2r but its neighbouring script. Every joint is released along
its travel, with the pairs of scene.srdf disabled. Visuals are stripped first: SAPIEN 3 needs a Vulkan GPU for
them even to load. Its URDF loader drops joint friction, effort and velocity (3.0.3: `articulation_builder.py` sets limits and
damping only, every joint keeps PhysX's default friction of 0.05), so those are not read.
"""

import json
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
from releasing import STEP_S, STEPS, release_everywhere  # type: ignore[import-not-found]  # the file beside this one


def read_back(urdf: Path) -> dict[str, Any]:
    """Joints and bodies as stored by SAPIEN."""
    import sapien  # type: ignore[import-not-found]  # lives in an environment of its own
    from sapien import physx

    scene = sapien.Scene([physx.PhysxCpuSystem()])
    scene.set_timestep(STEP_S)
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    with tempfile.TemporaryDirectory() as scratch:
        robot = loader.load(str(without_visuals(urdf, Path(scratch))))
    robot.set_qpos(np.zeros(robot.dof))  # poses of links are only computed then
    return {
        "version": f"SAPIEN {sapien.__version__}",
        "joints": {joint.name: _joint(joint) for joint in robot.get_active_joints()},
        "bodies": {link.name: _body(link) for link in robot.get_links() if link.name != "world"},
        "problem": _swept(scene, robot),
    }


def _swept(scene: Any, robot: Any) -> str:
    """Description of the first joint that fails the release sweep; empty where none does."""
    joints = robot.get_active_joints()
    number = {joint.name: k for k, joint in enumerate(joints)}

    def released(name: str, position: float) -> float:
        qpos = np.zeros(robot.dof)
        qpos[number[name]] = position
        robot.set_qpos(qpos)
        robot.set_qvel(np.zeros(robot.dof))
        for _ in range(STEPS):
            scene.step()
        qpos = robot.get_qpos()
        return float(qpos[number[name]]) if np.isfinite(qpos).all() else np.nan

    return str(release_everywhere({joint.name: tuple(map(float, joint.get_limits()[0])) for joint in joints}, released))


def _joint(joint: Any) -> dict[str, Any]:
    lower, upper = joint.get_limits()[0]
    pose = joint.get_global_pose().to_transformation_matrix()
    return {
        "type": joint.type.removesuffix("_unwrapped"),
        "axis_world": pose[:3, 0].tolist(),  # PhysX moves joints about and along x
        "origin_world": pose[:3, 3].tolist(),
        "lower": float(lower),
        "upper": float(upper),
        "damping": float(joint.damping),
    }


def _body(link: Any) -> dict[str, Any]:
    world_from_link = link.entity_pose.to_transformation_matrix()
    principal = world_from_link @ link.cmass_local_pose.to_transformation_matrix()
    return {
        "mass_kg": float(link.mass),
        "com_world": principal[:3, 3].tolist(),
        "inertia_world": (principal[:3, :3] @ np.diag(link.inertia) @ principal[:3, :3].T).tolist(),
        "rotation_world": world_from_link[:3, :3].tolist(),
        "origin_world": world_from_link[:3, 3].tolist(),
        "colliders": len(link.collision_shapes),
    }


def without_visuals(urdf: Path, scratch: Path) -> Path:
    """A copy of the URDF without <visual>, its mesh paths made absolute, beside a copy of its SRDF."""
    document = ET.parse(urdf)
    for link in document.getroot().iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for mesh in document.getroot().iter("mesh"):
        mesh.set("filename", str(urdf.parent / mesh.get("filename", "")))
    stripped = scratch / "stripped.urdf"
    document.write(stripped)
    if urdf.with_suffix(".srdf").is_file():
        shutil.copy(urdf.with_suffix(".srdf"), stripped.with_suffix(".srdf"))  # SAPIEN looks for it beside the URDF
    return stripped


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]).resolve())))
