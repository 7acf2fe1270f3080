"""Drift test: simulation of the scene at rest, measuring motion and speed."""

import time
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.export.contacts import body_name, free_bodies
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding

REST_SECONDS = 5.0
ALLOWED_DRIFT_M = 0.001  # objects at rest neither sink, slide nor roll
_HANG_REACH_M = 0.3  # distance within which a surface below a hanging object is named


class Left(NamedTuple):
    """Result of simulating a scene at rest."""

    drift_m: dict[str, float]  # by body
    realtime_factor: float  # simulated seconds per second of one core
    findings: list[Finding]


def leave_alone(model: Any) -> Left:
    """Simulate REST_SECONDS without external forces."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start = data.geom_xpos.copy()
    moved = np.zeros(model.ngeom)
    started = time.thread_time()  # CPU time of this thread: load by other processes must not count
    for step in range(int(REST_SECONDS / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if step % 50 == 49:
            moved = np.maximum(moved, np.linalg.norm(data.geom_xpos - start, axis=1))
    seconds = max(time.thread_time() - started, 1e-9)
    drift_m = _by_body(model, moved)
    unquiet = {name: distance for name, distance in drift_m.items() if not distance <= ALLOWED_DRIFT_M}
    hanging = hovering(model)
    notes = [finding("hover", name, f"hangs {where}") for name, where in hanging.items() if name in unquiet]
    notes += [
        finding("drift", name, f"moves {1000 * distance:.1f} mm in {REST_SECONDS:.0f} s without being touched")
        for name, distance in unquiet.items()
        if name not in hanging
    ]
    if any(data.warning[int(w)].number for w in _divergences()):
        notes.append(finding("unstable", "scene.xml", f"MuJoCo reset the state within {REST_SECONDS:.0f} s"))
    return Left(drift_m, REST_SECONDS / seconds, notes)


def hovering(model: Any) -> dict[str, str]:
    """Free bodies that touch nothing in the initial state, each with the gap below it and what lies there."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touching = {int(model.geom_bodyid[geom]) for contact in data.contact[: data.ncon] for geom in contact.geom}
    found: dict[str, str] = {}
    solid, ends = [geom for geom in range(model.ngeom) if model.geom_contype[geom]], np.zeros(6)
    for body in sorted(free_bodies(model) - touching):
        below = []
        for own, other in product(solid, solid):
            if model.geom_bodyid[own] == body != model.geom_bodyid[other]:
                gap = float(mujoco.mj_geomDistance(model, data, own, other, _HANG_REACH_M, ends))
                if 0.0 < gap < _HANG_REACH_M and ends[2] - ends[5] > 0.7 * gap:
                    below.append((gap, body_name(model, int(model.geom_bodyid[other]))))
        gap, carrier = min(below, default=(0.0, ""))
        if gap > ALLOWED_DRIFT_M:
            found[body_name(model, body)] = f"{1000 * gap:.0f} mm over {carrier}"
    return found


def _by_body(model: Any, moved: np.ndarray) -> dict[str, float]:
    worst: dict[str, float] = {}
    for geom, distance in enumerate(moved):
        name = body_name(model, int(model.geom_bodyid[geom]))
        worst[name] = float(np.maximum(worst.get(name, 0.0), distance))  # unlike max, it keeps NaN: the body diverged
    return worst


def _divergences() -> tuple[Any, ...]:
    import mujoco

    kinds = mujoco.mjtWarning
    return kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC
