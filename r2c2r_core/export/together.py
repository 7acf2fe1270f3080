"""Joints whose parts meet when both are open: true of many real kitchens, and worth knowing before a robot finds out."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, joint_names, subtree, touches
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding

_POSITIONS = 6  # of each of the two joints: every 15 to 20 degrees


def meetings(model: Any) -> Iterator[Finding]:
    """A warning for every pair of joints that cannot both stand open everywhere, with the deepest overlap found."""
    names = joint_names(model)
    reach = {name: _swept_box(model, name) for name in names}
    for first, second in combinations(names, 2):
        (low_a, high_a), (low_b, high_b) = reach[first], reach[second]
        if (low_a > high_b).any() or (low_b > high_a).any():
            continue
        depth_m = max(_overlaps(model, first, second), default=0.0)
        if depth_m > ALLOWED_PENETRATION_M:
            message = f"meets {second} when both are open (by up to {1000 * depth_m:.0f} mm): open one at a time"
            yield finding("together", first, message)


def _overlaps(model: Any, first: str, second: str) -> Iterator[float]:
    movers = [subtree(model, int(model.joint(name).bodyid[0])) for name in (first, second)]
    for a in _positions(model, first)[1:]:
        for b in _positions(model, second)[1:]:
            for touch in touches(model, {first: float(a), second: float(b)}):
                if any(one in movers[0] and other in movers[1] for one, other in (touch.bodies, touch.bodies[::-1])):
                    yield touch.depth_m


def _positions(model: Any, name: str) -> np.ndarray:
    lower, upper = (float(value) for value in model.joint(name).range)
    return np.linspace(lower, upper, _POSITIONS)


def _swept_box(model: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner (world) of all that a joint's part passes through, by its geoms' bounding spheres."""
    import mujoco

    data = mujoco.MjData(model)
    movers = subtree(model, int(model.joint(name).bodyid[0]))
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in movers]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for position in _positions(model, name):
        data.qpos[model.joint(name).qposadr[0]] = position
        mujoco.mj_kinematics(model, data)
        radius = model.geom_rbound[geoms, None]
        low = np.minimum(low, (data.geom_xpos[geoms] - radius).min(axis=0, initial=np.inf))
        high = np.maximum(high, (data.geom_xpos[geoms] + radius).max(axis=0, initial=-np.inf))
    return low, high
