"""Load scene.xml in Genesis, on the CPU, and write out its values: `python genesis_probe.py scene.xml answer.json`.

Runs in Genesis' own environment, so it imports nothing from r2c2r but its neighbouring script. Every joint is released along
its travel. Genesis has no maximum joint velocity. It would decompose and simplify colliders, which here are convex already.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from releasing import STEP_S, STEPS, release_everywhere  # type: ignore[import-not-found]  # the file beside this one


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by Genesis, joints closed."""
    import genesis  # type: ignore[import-not-found]  # lives in an environment of its own

    genesis.init(backend=genesis.cpu, precision="64", logging_level="error")
    world = genesis.Scene(show_viewer=False, sim_options=genesis.options.SimOptions(dt=STEP_S))
    whole = {"decompose_object_error_threshold": float("inf"), "decompose_robot_error_threshold": float("inf")}
    kitchen = world.add_entity(genesis.morphs.MJCF(file=str(scene), decimate=False, align=False, **whole))
    world.build()
    closed = _array(kitchen.get_qpos())
    moving = [joint for joint in kitchen.joints if joint.type.name.lower() in _KINDS]
    return {
        "version": f"Genesis {version('genesis-world')}",
        "joints": {joint.name: _joint(kitchen, joint) for joint in moving},
        "bodies": {link.name: _body(kitchen, link) for link in kitchen.links if link.name != "world"},
        "problem": _swept(world, kitchen, moving, closed),
    }


_KINDS = {"revolute", "prismatic"}


def _joint(kitchen: Any, joint: Any) -> dict[str, Any]:
    own = list(joint.dofs_idx_local)
    lower, upper = (float(_array(limit)[0]) for limit in kitchen.get_dofs_limit(own))
    return {
        "type": joint.type.name.lower(),
        "axis_world": _array(joint.get_anchor_axis()).tolist(),
        "origin_world": _array(joint.get_anchor_pos()).tolist(),
        "lower": lower,
        "upper": upper,
        "damping": float(_array(kitchen.get_dofs_damping(own))[0]),
        "friction": float(_array(kitchen.get_dofs_frictionloss(own))[0]),
        "effort": float(_array(kitchen.get_dofs_force_range(own)[1])[0]),
    }


def _body(kitchen: Any, link: Any) -> dict[str, Any]:
    from genesis.utils.geom import quat_to_R  # type: ignore[import-not-found]

    own = [link.idx_local]
    turn = quat_to_R(_array(link.get_quat()))
    position = _array(link.get_pos())
    principal = turn @ quat_to_R(np.asarray(link.desc.inertial_quat))
    return {
        "mass_kg": float(_array(kitchen.get_links_mass(own))[0]),
        "com_world": (position + turn @ _array(kitchen.get_links_COM(own))[0]).tolist(),
        "inertia_world": (principal @ _array(kitchen.get_links_inertia(own))[0] @ principal.T).tolist(),
        "rotation_world": turn.tolist(),
        "origin_world": position.tolist(),
        "colliders": link.n_geoms,
    }


def _swept(world: Any, kitchen: Any, moving: list[Any], closed: np.ndarray) -> str:
    """Description of the first joint that fails the release sweep; empty where none does."""
    number = {joint.name: joint.qs_idx_local[0] for joint in moving}

    def released(name: str, position: float) -> float:
        qpos = closed.copy()
        qpos[number[name]] = position
        kitchen.set_qpos(qpos, zero_velocity=True)
        for _ in range(STEPS):
            world.step()
        qpos = _array(kitchen.get_qpos())
        return float(qpos[number[name]]) if np.isfinite(qpos).all() else np.nan

    limits = {joint.name: tuple(_joint(kitchen, joint)[end] for end in ("lower", "upper")) for joint in moving}
    return str(release_everywhere(limits, released))


def _array(tensor: Any) -> np.ndarray:
    return np.asarray(tensor.cpu(), dtype=np.float64)


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]))))
