"""Validity tests of a variant: it loads without collisions, joints sweep freely, and free objects are supported."""

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.export.alone import ALLOWED_DRIFT_M
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, free_bodies, joint_names, movers_of, touches
from r2c2r_core.export.sweeps import sweep_of
from r2c2r_core.robot.rig import corners_of
from r2c2r_core.variants.draw import Variation

_ABOVE_M = 0.02  # height above the base from which a support is sought


def colliders_of(root: ET.Element, folder: Path) -> Any:
    """The compiled variant without visuals; raises ValueError where MuJoCo cannot compile it.

    `folder` is the bundle's folder, from which the meshes are read.
    """
    import mujoco

    bare = copy.deepcopy(root)
    compiler = bare.find("compiler")
    assert compiler is not None
    compiler.set("meshdir", str(folder))
    compiler.set("discardvisual", "true")
    return mujoco.MjSpec.from_string(ET.tostring(bare, encoding="unicode")).compile()


def start_of(model: Any, variation: Variation) -> np.ndarray:
    """Initial joint positions (qpos), with the variation's joints ajar."""
    qpos = np.array(model.qpos0)
    for name, share in variation.ajar.items():
        joint = model.joint(name)
        qpos[joint.qposadr[0]] = share * float(joint.range[1])
    return qpos


def unfit(model: Any, start: Mapping[str, float]) -> str | None:
    """Reason why the variant is rejected; None if it is valid. `start` are the positions of joints that are ajar."""
    import mujoco

    scratch, free = mujoco.MjData(model), free_bodies(model)
    for touch in touches(model, start, scratch):
        if touch.depth_m > ALLOWED_PENETRATION_M:
            return "an object collides with something" if set(touch.bodies) & free else "parts overlap at the start"
    if not all(_stands(model, scratch, body) for body in free):
        return "an object hangs over an edge"
    for name in joint_names(model):
        movers = movers_of(model, name)
        for position in sweep_of(model, name):
            for touch in touches(model, {name: position}, scratch):
                if movers & set(touch.bodies) and not free & set(touch.bodies):  # however slightly: friction jams the joint
                    return "a joint collides with something"
    return None


def _stands(model: Any, data: Any, body: int) -> bool:
    """Whether something lies below the object's base, under its middle and a third of the way to its sides."""
    import mujoco

    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_contype[g]]
    centres = np.array([data.geom_xpos[g] for g in geoms])
    reach = max(float(np.linalg.norm(model.geom_aabb[g][3:5])) for g in geoms) / 2
    low = min(float(corners_of(model, data, g)[:, 2].min()) for g in geoms)
    middle, hit = centres.mean(axis=0), np.zeros(1, np.int32)
    for x, y in ((0, 0), (reach, 0), (-reach, 0), (0, reach), (0, -reach)):
        at = np.array([middle[0] + x, middle[1] + y, low + _ABOVE_M])
        away = mujoco.mj_ray(model, data, at, np.array([0.0, 0.0, -1.0]), None, 1, body, hit, None)
        if not 0 <= away < _ABOVE_M + ALLOWED_DRIFT_M / 2:  # it also sinks in when it lands
            return False
    return True
