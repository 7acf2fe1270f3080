"""MuJoCo model of a synthetic kitchen's true fronts and handles, to determine which joints really do not collide."""

from typing import Any

import numpy as np

from r2c2r_core.export.together import Meeting, meetings
from r2c2r_core.synthetic.kitchen import Appliance, Furniture, Handle, Kitchen, Leaf
from r2c2r_core.synthetic.layout import plan_kitchen

_SEAT_M = 0.003  # gap between a closed front and the block behind it; the true ones touch

Pair = frozenset[str]


def true_limits(seed: int) -> dict[str, float]:
    """Upper limit of every true joint, under this project's name for it."""
    model = true_model(seed)
    return {model.joint(j).name: float(model.jnt_range[j][1]) for j in range(model.njnt)}


def true_meetings(seed: int) -> dict[Pair, Meeting]:
    """Pairs of joints whose true parts collide when both are open."""
    return {frozenset(one.joints): one for one in meetings(true_model(seed))}


def true_model(seed: int) -> Any:
    """The compiled model, in the kitchen's frame."""
    import mujoco

    kitchen = plan_kitchen(seed)
    bodies = [text for unit in (*kitchen.base, *kitchen.upper) for text in _furniture(unit, kitchen)]
    bodies += [text for thing in (kitchen.fridge, kitchen.microwave) for text in _appliance(thing)]
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><worldbody>{"".join(bodies)}</worldbody></mujoco>'
    )
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    return model


def _furniture(unit: Furniture, kitchen: Kitchen) -> list[str]:
    thick, first, last = kitchen.style.front_thickness_m, unit.leaves[0], unit.leaves[-1]
    low = np.array([first.x, -unit.depth_m + thick + _SEAT_M, first.z])
    high = np.array([last.x + last.width_m, 0.0, first.z + first.height_m])
    leaves = [_leaf(unit, leaf, thick) for leaf in unit.leaves]
    return [f"<body>{_box(low, high)}</body>", *leaves]


def _leaf(unit: Furniture, leaf: Leaf, thick_m: float) -> str:
    part = "drawer" if leaf.hinge is None else "door" if len(unit.leaves) == 1 else f"{leaf.hinge}_door"
    corner = np.array([leaf.x, -unit.depth_m, leaf.z])
    size = np.array([leaf.width_m, thick_m, leaf.height_m])
    return _mover(f"{unit.name}_{part}_joint", corner, size, leaf.hinge, leaf.open_limit, leaf.handle)


def _appliance(thing: Appliance) -> list[str]:
    width, depth, height = thing.size_m
    low = np.array([-width / 2, -depth / 2, -height / 2])
    block = _box(low + np.array([0.0, thing.door_thickness_m + _SEAT_M, 0.0]), -low)
    corner = low + np.array([0.0 if thing.hinge == "left" else width - thing.door_width_m, 0.0, 0.0])
    size = np.array([thing.door_width_m, thing.door_thickness_m, height])
    door = _mover(f"{thing.name}_door_joint", corner, size, thing.hinge, thing.open_limit, thing.handle)
    pose = f'pos="{_text(thing.centre)}" euler="0 0 {thing.yaw_rad}"'
    return [f"<body {pose}>{block}{door}</body>"]


def _mover(joint: str, corner: np.ndarray, size: np.ndarray, hinge: str | None, upper: float, handle: Handle) -> str:
    """MJCF of a front with its handle; `corner` is the lower left corner of its outer face."""
    pivot = corner + np.array([size[0] if hinge == "right" else 0.0, 0.0, 0.0])
    kind, axis = ("slide", "0 -1 0") if hinge is None else ("hinge", "0 0 -1" if hinge == "left" else "0 0 1")
    own = corner - pivot
    along = np.array([handle.thickness_m, handle.thickness_m, handle.length_m])
    half = (along if handle.vertical else along[[2, 1, 0]]) / 2
    middle = own + np.array([handle.x, 0.0, handle.z])
    side = np.array([half[0], 0.0, half[2]])
    grip = _box(middle - side - np.array([0.0, handle.reach_m, 0.0]), middle + side)
    return (
        f'<body pos="{_text(pivot)}"><joint name="{joint}" type="{kind}" axis="{axis}" range="0 {upper}"/>'
        f"{_box(own, own + size)}{grip}</body>"
    )


def _box(low: np.ndarray, high: np.ndarray) -> str:
    return f'<geom type="box" pos="{_text((low + high) / 2)}" size="{_text(np.abs(high - low) / 2)}"/>'


def _text(values: Any) -> str:
    return " ".join(f"{float(value):.6f}" for value in values)
