"""Per-joint tests: overlap over the sweep, travel under a push, and obstacles."""

from typing import Any

import numpy as np

from r2c2r_core.export.cavities import cavity_open
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, body_name, carried_by, free_bodies, movers_of, touches
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Blocker, Finding, JointResult
from r2c2r_core.robot.rig import corners_of

_POSITIONS = 21
DRIVE_FORCE_N = 30.0  # about what one hand gives a drawer, or a door at its free edge
DRIVE_SECONDS = 6.0
NEEDED_TRAVEL = 0.98
NEEDED_CAVITY = 0.9  # without walls: shelves and linings fill the rest


def examine_joint(strict: Any, solid: Any, name: str) -> tuple[JointResult, list[Finding]]:
    """Sweep and push one joint, all others closed; `solid` is the `strict` model with free-standing objects."""
    deepest, notes = _swept(strict, name)
    blockers = things_in_the_way(solid, name)
    notes += [finding("blocked-by", name, f"{blocker.name} blocks it") for blocker in blockers]
    travel = push_open(strict, name)
    if travel < NEEDED_TRAVEL:
        notes.append(finding("travel", name, f"opens {100 * travel:.0f} % of its range under {DRIVE_FORCE_N:.0f} N"))
    inside = cavity_open(strict, name)
    if inside is not None and inside < NEEDED_CAVITY:
        notes.append(finding("cavity", name, f"only {100 * inside:.0f} % of the space it opens is free"))
    result = JointResult(
        joint=name, deepest_penetration_m=deepest, travel_reached=travel, cavity_open=inside, blocked_by=tuple(blockers)
    )
    return result, notes


def push_open(model: Any, joint: str) -> float:
    """Fraction of its range that a joint reaches, pushed steadily from closed by DRIVE_FORCE_N; a door at its free edge."""
    import mujoco

    data = mujoco.MjData(model)
    entry = model.joint(joint)
    address, dof, upper = int(entry.qposadr[0]), int(entry.dofadr[0]), float(entry.range[1])
    force = DRIVE_FORCE_N * (1.0 if entry.type[0] == mujoco.mjtJoint.mjJNT_SLIDE else _free_edge_m(model, joint))
    reached = 0.0
    for _ in range(int(DRIVE_SECONDS / model.opt.timestep)):
        data.qfrc_applied[dof] = force
        mujoco.mj_step(model, data)
        reached = max(reached, float(data.qpos[address]) / upper)
        if reached >= 1.0 or not np.isfinite(data.qpos[address]):
            break
    return min(reached, 1.0)


def _free_edge_m(model: Any, joint: str) -> float:
    """Distance of a door's farthest point from its hinge axis."""
    import mujoco

    data, number, movers = mujoco.MjData(model), int(model.joint(joint).id), movers_of(model, joint)
    mujoco.mj_kinematics(model, data)
    corners = [corners_of(model, data, g) for g in range(model.ngeom) if int(model.geom_bodyid[g]) in movers]
    arms = np.cross(np.concatenate(corners) - data.xanchor[number], data.xaxis[number])
    return float(np.linalg.norm(arms, axis=1).max())


def things_in_the_way(solid: Any, name: str) -> list[Blocker]:
    """Free-standing objects that the joint's part hits, with the position of first contact; not what lies in it."""
    import mujoco

    movers, scratch = movers_of(solid, name), mujoco.MjData(solid)
    free = free_bodies(solid) - carried_by(solid, movers)
    first: dict[str, float] = {}
    for position in sweep_of(solid, name) if free else ():
        for touch in touches(solid, {name: position}, scratch):
            if touch.depth_m > ALLOWED_PENETRATION_M and touch.between(movers, free):
                thing = body_name(solid, next(body for body in touch.bodies if body in free))
                first.setdefault(thing, position)
    return [Blocker(name=thing, kind="thing", position=position) for thing, position in sorted(first.items())]


def _swept(strict: Any, name: str) -> tuple[float, list[Finding]]:
    """The deepest overlap over the joint's sweep, and a finding where it is too deep."""
    import mujoco

    movers, scratch = movers_of(strict, name), mujoco.MjData(strict)
    deepest, at, worst = 0.0, 0.0, ""
    for position in sweep_of(strict, name):
        for touch in touches(strict, {name: position}, scratch):
            if movers & set(touch.bodies) and touch.depth_m > deepest:
                deepest, at, worst = touch.depth_m, position, touch.names
    if deepest <= ALLOWED_PENETRATION_M:
        return deepest, []
    return deepest, [finding("penetration-sweep", name, f"{worst} overlap by {1000 * deepest:.1f} mm at {at:.3g}")]


def sweep_of(model: Any, name: str) -> list[float]:
    """Positions at which a joint is tested, from closed to open."""
    lower, upper = (float(value) for value in model.joint(name).range)
    return [float(position) for position in np.linspace(lower, upper, _POSITIONS)]
