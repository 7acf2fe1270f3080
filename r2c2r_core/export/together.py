"""Collisions between parts of two open joints, as in many real kitchens."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from r2c2r_core.export.contacts import (
    ALLOWED_PENETRATION_M,
    body_name,
    carried_by,
    free_bodies,
    joint_names,
    movers_of,
    overlapping,
    touches,
)
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.states import SHARES
from r2c2r_core.model.report import Blocker, Finding

_POSITIONS = 6  # per joint: every 15 to 20 degrees
_ALL_POSITIONS = 21


@dataclass(frozen=True, slots=True, kw_only=True)
class Meeting:
    """Two joints whose parts collide at some open positions."""

    joints: tuple[str, str]
    depth_m: float  # deepest overlap
    first_at: tuple[float, float]  # for each joint, the smallest position at which they meet

    @property
    def finding(self) -> Finding:
        """The collision as a finding."""
        first, second = self.joints
        message = f"collides with {second} when both are open (by up to {1000 * self.depth_m:.0f} mm): open one at a time"
        return finding("together", first, message)

    def blocker_of(self, joint: str) -> Blocker | None:
        """The other joint as an obstacle of `joint`; None if the collision does not involve it."""
        if joint not in self.joints:
            return None
        own = self.joints.index(joint)
        return Blocker(name=self.joints[1 - own], kind="joint", position=self.first_at[own])


def meetings(model: Any) -> list[Meeting]:
    """All pairs of joints whose parts overlap at some pair of open positions."""
    names = joint_names(model)
    reach = {name: _swept_box(model, name) for name in names}
    found = []
    for first, second in combinations(names, 2):
        (low_a, high_a), (low_b, high_b) = reach[first], reach[second]
        if (low_a > high_b).any() or (low_b > high_a).any():
            continue
        overlaps = [hit for hit in _overlaps(model, first, second) if hit[2] > ALLOWED_PENETRATION_M]
        if overlaps:
            a, b, depth = zip(*overlaps, strict=True)
            found.append(Meeting(joints=(first, second), depth_m=max(depth), first_at=(min(a), min(b))))
    return found


def conflicts(model: Any) -> dict[str, tuple[tuple[str, str], ...]]:
    """By state: pairs of joints, or of a joint and a free body, that overlap in its keyframe, with what they carry."""
    import mujoco

    movers = {name: movers_of(model, name) for name in joint_names(model)}
    movers = {name: bodies | carried_by(model, bodies) for name, bodies in movers.items()}
    free = free_bodies(model).difference(*movers.values())

    def names_of(body: int) -> set[str]:
        return {body_name(model, body)} if body in free else {name for name, bodies in movers.items() if body in bodies}

    found, data = {}, mujoco.MjData(model)
    for state in SHARES if movers else ():
        mujoco.mj_resetDataKeyframe(model, data, model.key(state).id)
        deep = [touch.bodies for touch in overlapping(model, data) if touch.depth_m > ALLOWED_PENETRATION_M]
        ends = [(names_of(a), names_of(b)) for a, b in deep if not free >= {a, b}]
        pairs = {(min(pair), max(pair)) for some, others in ends for pair in product(some - others, others - some)}
        found[state] = tuple(sorted(pairs))
    return found


def all_together(model: Any) -> float:
    """Deepest overlap in metres while all joints open by the same fraction of their range."""
    import mujoco

    ranges = {name: model.joint(name).range for name in joint_names(model)}
    deepest, scratch = 0.0, mujoco.MjData(model)
    for share in np.linspace(0.0, 1.0, _ALL_POSITIONS):
        positions = {name: float(lower + share * (upper - lower)) for name, (lower, upper) in ranges.items()}
        deepest = max([deepest, *(touch.depth_m for touch in touches(model, positions, scratch))])
    return deepest


def _overlaps(model: Any, first: str, second: str) -> Iterator[tuple[float, float, float]]:
    """Positions of both joints and the overlap there, in metres."""
    import mujoco

    some, others, scratch = movers_of(model, first), movers_of(model, second), mujoco.MjData(model)
    for a in _positions(model, first)[1:]:
        for b in _positions(model, second)[1:]:
            for touch in touches(model, {first: float(a), second: float(b)}, scratch):
                if touch.between(some, others):
                    yield float(a), float(b), touch.depth_m


def _positions(model: Any, name: str) -> np.ndarray:
    lower, upper = (float(value) for value in model.joint(name).range)
    return np.linspace(lower, upper, _POSITIONS)


def _swept_box(model: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner (world) of the swept volume of a joint's part, by its geoms' bounding spheres."""
    import mujoco

    data = mujoco.MjData(model)
    movers = movers_of(model, name)
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in movers]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for position in _positions(model, name):
        data.qpos[model.joint(name).qposadr[0]] = position
        mujoco.mj_kinematics(model, data)
        radius = model.geom_rbound[geoms, None]
        low = np.minimum(low, (data.geom_xpos[geoms] - radius).min(axis=0, initial=np.inf))
        high = np.maximum(high, (data.geom_xpos[geoms] + radius).max(axis=0, initial=-np.inf))
    return low, high
