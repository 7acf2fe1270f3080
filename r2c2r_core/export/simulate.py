"""Simulation tests in MuJoCo: penetration at rest and over every joint's sweep, travel under a hand's force, drift.

Sweep and drive use a stricter model than the bundle's: no contact exclusions and no parent filter, so that a bundle which
passes also opens in engines that support neither. Free-standing objects are removed from it: one in a door's way is
reported by name, but is not a defect of the door.
"""

import logging
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.export.alone import Left, leave_alone
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, Touch, body_name, free_bodies, joint_names, touches
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.sweeps import examine_joint
from r2c2r_core.export.together import Meeting, all_together, meetings
from r2c2r_core.failing import apart
from r2c2r_core.model.report import Finding, JointResult
from r2c2r_core.progress import SILENT, Progress

_LOG = logging.getLogger(__name__)

ALLOWED_OVERLAP_M = 0.005  # of fixed parts, which no engine separates; LRA's threshold

_NAN = float("nan")


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """Results of the simulation tests."""

    findings: tuple[Finding, ...] = ()
    joints: tuple[JointResult, ...] = ()
    rest_penetration_m: float = _NAN
    together_penetration_m: float = _NAN
    drift_m: dict[str, float] = field(default_factory=dict)  # by body; empty when nothing was simulated
    realtime_factor: float = _NAN
    free: tuple[str, ...] = ()  # free-standing bodies

    @property
    def most_drift_m(self) -> float:
        """Maximum drift over all bodies, in metres."""
        return float(np.max([*self.drift_m.values()] or _NAN))


def simulate(mjcf: Path, *, progress: Progress = SILENT) -> Simulation:
    """Run every test on a scene.xml."""
    try:
        shipped, strict = compiled(mjcf), compiled(mjcf, strict=True)
        solid, loose = compiled(mjcf, strict=True, keep_free=True), compiled(mjcf, strict=True, keep_free=True, loosen=True)
    except (ET.ParseError, ValueError) as error:
        return Simulation(findings=(finding("mjcf-compile", "scene.xml", str(error).partition("\n")[0]),))
    findings: list[Finding] = []
    deepest_m, met, together, left = _NAN, list[Meeting](), _NAN, Left({}, _NAN, [])
    with _apart("scene.xml", findings):
        rest = touches(solid, {})
        deepest_m = max([0.0, *(touch.depth_m for touch in rest)])
        findings += [*_rest_findings(rest), *_fixed_overlaps(loose, rest)]
    joints = []
    for name in progress.part(0.0, 0.7).each(joint_names(strict), "joint"):
        with _apart(name, findings):
            result, notes = examine_joint(strict, solid, name)
            joints.append(result)
            findings += notes
    progress.at(0.7, "opening joints together")
    with _apart("joints together", findings):
        met = meetings(strict)
        together = all_together(strict)
    progress.at(0.8, "simulating at rest")
    with _apart("left alone", findings):
        left = leave_alone(shipped)
    return Simulation(
        findings=(*findings, *(one.finding for one in met), *left.findings),
        joints=tuple(_with_meetings(result, met) for result in joints),
        rest_penetration_m=deepest_m,
        together_penetration_m=together,
        drift_m=left.drift_m,
        realtime_factor=left.realtime_factor,
        free=tuple(body_name(shipped, body) for body in sorted(free_bodies(shipped))),
    )


@contextmanager
def _apart(where: str, findings: list[Finding]) -> Iterator[None]:
    """Context of one test: an exception becomes a finding and does not stop the other tests."""
    failed: dict[str, str] = {}
    with apart("certificate", where, failed):
        yield
    findings += [finding("untested", where, message) for message in failed.values()]


def _rest_findings(rest: list[Touch]) -> Iterator[Finding]:
    for touch in rest:
        if touch.depth_m > ALLOWED_PENETRATION_M:
            message = f"{touch.names} overlap by {1000 * touch.depth_m:.1f} mm while closed"
            yield finding("penetration-rest", touch.names.partition(" ")[0], message)


def _with_meetings(result: JointResult, met: list[Meeting]) -> JointResult:
    """The joint's result with the joints that block it when open."""
    more = [blocker for one in met if (blocker := one.blocker_of(result.joint)) is not None]
    return replace(result, blocked_by=(*result.blocked_by, *more))


def _fixed_overlaps(loose: Any, rest: list[Touch]) -> Iterator[Finding]:
    """Findings on overlaps between fixed parts of different objects, which the engine never reports."""
    known = {touch.names for touch in rest}
    for touch in touches(loose, {}):
        if touch.depth_m > ALLOWED_OVERLAP_M and touch.names not in known and 0 not in touch.bodies:
            yield finding("overlap", touch.names.partition(" ")[0], f"{touch.names} overlap by {1000 * touch.depth_m:.1f} mm")


def without_visuals(spec: Any) -> None:
    """Remove the visuals from an MjSpec, as they take seconds to load."""
    spec.compiler.discardvisual = True


def compiled(mjcf: Path, *, strict: bool = False, keep_free: bool = False, loosen: bool = False) -> Any:
    """The compiled scene without visuals; `strict` without exclusions, `loosen` with every fixed body made free.

    Raises ValueError or ET.ParseError where scene.xml is invalid.
    """
    import mujoco

    mujoco.set_mju_user_warning(_LOG.debug)  # else a diverging scene leaves MUJOCO_LOG.TXT in the working directory
    ET.fromstring(mjcf.read_text(encoding="utf-8"))  # MuJoCo accepts names that are not valid text, and cannot print them
    spec = mujoco.MjSpec.from_file(str(mjcf))
    without_visuals(spec)
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
