"""MuJoCo as the oracle: penetration at rest and over every joint's sweep, travel under a hand's force, drift.

Sweep and drive use a stricter model than the bundle ships: no contact exclusions and no parent filter, so that a bundle
which passes also opens in engines that know neither. Free-standing things are taken out of it: one that stands in a door's
way is named, it is not the door's defect.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.export.cavities import cavity_open
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, Touch, body_name, joint_names, subtree, touches
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.together import meetings
from r2c2r_core.model.report import Finding, JointResult
from r2c2r_core.progress import SILENT, Progress

POSITIONS = 21
DRIVE_FORCE_N, DRIVE_TORQUE_NM = 30.0, 10.0  # about what one hand gives a drawer or a door
DRIVE_SECONDS = 6.0
NEEDED_TRAVEL = 0.98
NEEDED_CAVITY = 0.5  # a microwave with its electronics beside the oven keeps about two thirds
REST_SECONDS = 5.0
ALLOWED_DRIFT_M = 0.02  # LRA's gate (sim-ready.md)
ALLOWED_OVERLAP_M = 0.005  # of fixed parts, which no engine moves apart; LRA's gate


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """What MuJoCo said."""

    findings: tuple[Finding, ...]
    joints: tuple[JointResult, ...]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float


def simulate(mjcf: Path, *, progress: Progress = SILENT) -> Simulation:
    """Run every test on a scene.xml."""
    try:
        shipped, strict = _compiled(mjcf), _compiled(mjcf, strict=True)
        solid, loose = _compiled(mjcf, strict=True, keep_free=True), _compiled(mjcf, strict=True, keep_free=True, loosen=True)
    except ValueError as error:
        nan = float("nan")
        failure = finding("mjcf-compile", "scene.xml", str(error).partition("\n")[0])
        return Simulation(findings=(failure,), joints=(), rest_penetration_m=nan, drift_m=nan, realtime_factor=nan)
    findings: list[Finding] = []
    rest = touches(solid, {})
    for touch in rest:
        if touch.depth_m > ALLOWED_PENETRATION_M:
            message = f"{touch.names} overlap by {1000 * touch.depth_m:.1f} mm while closed"
            findings.append(finding("penetration-rest", touch.names.partition(" ")[0], message))
    findings += _fixed_overlaps(loose, rest)
    joints = []
    for name in progress.part(0.0, 0.7).each(joint_names(strict), "joint"):
        result, notes = _examine_joint(strict, solid, name)
        joints.append(result)
        findings += notes
    progress.at(0.7, "opening joints together")
    findings += meetings(strict)
    progress.at(0.8, "leaving everything alone")
    drift_m, realtime, notes = leave_alone(shipped)
    return Simulation(
        findings=(*findings, *notes),
        joints=tuple(joints),
        rest_penetration_m=max([0.0, *(touch.depth_m for touch in rest)]),
        drift_m=drift_m,
        realtime_factor=realtime,
    )


def push_open(model: Any, joint: str) -> float:
    """Fraction of its range that a joint reaches, pushed steadily from closed by DRIVE_FORCE_N or DRIVE_TORQUE_NM."""
    import mujoco

    data = mujoco.MjData(model)
    entry = model.joint(joint)
    address, dof, upper = int(entry.qposadr[0]), int(entry.dofadr[0]), float(entry.range[1])
    force = DRIVE_FORCE_N if entry.type[0] == mujoco.mjtJoint.mjJNT_SLIDE else DRIVE_TORQUE_NM
    reached = 0.0
    for _ in range(int(DRIVE_SECONDS / model.opt.timestep)):
        data.qfrc_applied[dof] = force
        mujoco.mj_step(model, data)
        reached = max(reached, float(data.qpos[address]) / upper)
        if reached >= 1.0 or not np.isfinite(data.qpos[address]):
            break
    return min(reached, 1.0)


def leave_alone(model: Any) -> tuple[float, float, list[Finding]]:
    """How far anything moves in REST_SECONDS, simulated seconds per second, and findings."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start = data.geom_xpos.copy()
    moved = np.zeros(model.ngeom)
    steps = int(REST_SECONDS / model.opt.timestep)
    started = time.perf_counter()
    for step in range(steps):
        mujoco.mj_step(model, data)
        if step % 50 == 49:
            moved = np.maximum(moved, np.linalg.norm(data.geom_xpos - start, axis=1))
    seconds = max(time.perf_counter() - started, 1e-9)
    notes = _drift_findings(model, moved)
    if any(data.warning[int(w)].number for w in _divergences()):
        notes.append(finding("unstable", "scene.xml", f"MuJoCo reset the state within {REST_SECONDS:.0f} s"))
    return float(moved.max(initial=0.0)), REST_SECONDS / seconds, notes


def _examine_joint(strict: Any, solid: Any, name: str) -> tuple[JointResult, list[Finding]]:
    """Sweep and push one joint, all others closed."""
    upper, lower = float(strict.joint(name).range[1]), float(strict.joint(name).range[0])
    movers = subtree(strict, int(strict.joint(name).bodyid[0]))
    deepest, at, worst = 0.0, 0.0, ""
    blockers: set[str] = set()
    for position in np.linspace(lower, upper, POSITIONS):
        for touch in touches(strict, {name: position}):
            if movers & set(touch.bodies) and touch.depth_m > deepest:
                deepest, at, worst = touch.depth_m, float(position), touch.names
        blockers |= _blocked_by(solid, name, float(position))
    notes = [finding("blocked-by", name, f"{thing} stands in its way") for thing in sorted(blockers)]
    if deepest > ALLOWED_PENETRATION_M:
        notes.append(finding("penetration-sweep", name, f"{worst} overlap by {1000 * deepest:.1f} mm at {at:.3g}"))
    travel = push_open(strict, name)
    if travel < NEEDED_TRAVEL:
        unit = f"{DRIVE_FORCE_N:.0f} N" if strict.joint(name).type[0] == 2 else f"{DRIVE_TORQUE_NM:.0f} N m"
        notes.append(finding("travel", name, f"opens {100 * travel:.0f} % of its range under {unit}"))
    inside = cavity_open(strict, name)
    if inside is not None and inside < NEEDED_CAVITY:
        notes.append(finding("cavity", name, f"only {100 * inside:.0f} % of the space it opens is free"))
    return JointResult(joint=name, deepest_penetration_m=deepest, travel_reached=travel, cavity_open=inside), notes


def _blocked_by(solid: Any, name: str, position: float) -> set[str]:
    """Free-standing things that the joint's part runs into."""
    movers = subtree(solid, int(solid.joint(name).bodyid[0]))
    free = _free_bodies(solid)
    if not free:
        return set()
    return {
        body_name(solid, next(iter(set(touch.bodies) & free)))
        for touch in touches(solid, {name: position})
        if touch.depth_m > ALLOWED_PENETRATION_M and movers & set(touch.bodies) and free & set(touch.bodies)
    }


def _fixed_overlaps(loose: Any, rest: list[Touch]) -> Iterator[Finding]:
    """Overlaps between fixed parts of different objects, which the engine itself never reports."""
    known = {touch.names for touch in rest}
    for touch in touches(loose, {}):
        if touch.depth_m > ALLOWED_OVERLAP_M and touch.names not in known and 0 not in touch.bodies:
            yield finding("overlap", touch.names.partition(" ")[0], f"{touch.names} overlap by {1000 * touch.depth_m:.1f} mm")


def _compiled(mjcf: Path, *, strict: bool = False, keep_free: bool = False, loosen: bool = False) -> Any:
    """The scene without what cannot touch; `strict` without exclusions, `loosen` with every fixed body let go."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(mjcf))
    for geom in [g for g in spec.geoms if g.contype == 0 and g.conaffinity == 0]:
        spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for part in [m for m in spec.meshes if m.name not in used]:
        spec.delete(part)
    for geom in spec.geoms:
        geom.material = ""
    for part in [*spec.materials, *spec.textures]:
        spec.delete(part)
    if strict:
        for exclude in list(spec.excludes):
            spec.delete(exclude)
    tops = list(spec.worldbody.bodies)
    for body in tops:
        free = any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints)
        if free and strict and not keep_free:
            spec.delete(body)
        elif loosen and not len(body.joints):
            body.add_freejoint()
    model = spec.compile()
    if strict:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    return model


def _free_bodies(model: Any) -> set[int]:
    roots = {int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == 0}
    return {body for body in range(model.nbody) if int(model.body_rootid[body]) in roots}


def _drift_findings(model: Any, moved: np.ndarray) -> list[Finding]:
    worst: dict[str, float] = {}
    for geom, distance in enumerate(moved):
        name = body_name(model, int(model.geom_bodyid[geom]))
        worst[name] = max(worst.get(name, 0.0), float(distance))
    return [
        finding("drift", name, f"moves {1000 * distance:.0f} mm in {REST_SECONDS:.0f} s with nobody touching it")
        for name, distance in worst.items()
        if not distance <= ALLOWED_DRIFT_M
    ]


def _divergences() -> tuple[Any, ...]:
    import mujoco

    kinds = mujoco.mjtWarning
    return kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC
