"""The certificate: linter, every installed loader, sweep and push of every joint, and drift at rest."""

import math
from pathlib import Path
from typing import Any

from r2c2r_core.export.collider_fit import collider_fits
from r2c2r_core.export.lint import lint
from r2c2r_core.export.loaders import EVERY_LOADER, try_loaders
from r2c2r_core.export.openings import NEEDED_OPENING, opening_free
from r2c2r_core.export.reading import Urdf, read_urdf
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.export.rules.likeness import judge_likeness
from r2c2r_core.export.rules.table import UNSAFE, finding
from r2c2r_core.export.simulate import Simulation, simulate
from r2c2r_core.model.report import Blocker, Certificate, ColliderFit, Finding, Gap, LoaderResult, ThingResult
from r2c2r_core.progress import SILENT, Progress

CERTIFICATE_VERSION = 1
FAR_COLLIDER_M = 0.02  # own choice: a grasp planned on the visual misses by as much

_NOT_SIMULATED = Simulation()


def certify(folder: Path, *, sapien_python: str | None = None, progress: Progress = SILENT) -> Certificate:
    """Test a bundle's folder; raises BundleError when it has no readable scene.urdf.

    `sapien_python` is the interpreter of a separate environment for SAPIEN (it overwrites the headless OpenCV); None
    reads R2C2R_SAPIEN_PYTHON. A loader that is not installed is reported as not tried.
    """
    progress.at(0.0, "reading the bundle")
    findings = lint(folder)
    things, colliders = tuple[ThingResult, ...](), tuple[ColliderFit, ...]()
    if any(finding.rule in UNSAFE for finding in findings):
        refused = "not loaded: the bundle refers to files outside itself"
        loaders = tuple(LoaderResult(loader=name, state="not tried", detail=refused) for name in EVERY_LOADER)
        simulation = _NOT_SIMULATED
    else:
        urdf = read_urdf(folder / "scene.urdf")
        loaders = try_loaders(folder, urdf, sapien_python, progress=progress.part(0.05, 0.4))
        mjcf = folder / "scene.xml"
        simulation = simulate(mjcf, progress=progress.part(0.4, 1.0)) if mjcf.is_file() else _NOT_SIMULATED
        files = BundleFiles(folder=folder)
        things, colliders = _things(urdf, files, simulation), collider_fits(urdf, files)
    findings = (*findings, *simulation.findings, *_closed_openings(things), *_far_colliders(colliders))
    failed = any(f.severity == "error" for f in findings) or any(loader.state == "failed" for loader in loaders)
    progress.at(1.0, "certificate passed" if not failed else "certificate failed")
    return Certificate(
        passed=not failed and simulation is not _NOT_SIMULATED,
        likeness=judge_likeness(findings),
        findings=tuple(sorted(findings, key=lambda f: f.severity)),
        loaders=loaders,
        joints=simulation.joints,
        rest_penetration_m=simulation.rest_penetration_m,
        drift_m=simulation.most_drift_m,
        realtime_factor=simulation.realtime_factor,
        things=things,
        together_penetration_m=simulation.together_penetration_m,
        colliders=colliders,
    )


def certificate_to_json(certificate: Certificate) -> dict[str, Any]:
    """The certificate as a versioned JSON document; what was not measured is null."""
    return {
        "version": CERTIFICATE_VERSION,
        "passed": certificate.passed,
        "likeness": {
            "state": certificate.likeness.state,
            "doubts": [{"object": name, "why": why} for name, why in certificate.likeness.doubts],
        },
        "findings": [
            {"rule": f.rule, "severity": f.severity, "where": f.where, "message": f.message} for f in certificate.findings
        ],
        "loaders": [
            {
                "loader": r.loader,
                "state": r.state,
                "detail": r.detail,
                "steps_per_s": {str(worlds): round(speed, 1) for worlds, speed in r.steps_per_s},
            }
            for r in certificate.loaders
        ],
        "joints": [
            {
                "joint": j.joint,
                "deepest_penetration_m": _number(j.deepest_penetration_m),
                "travel_reached": _number(j.travel_reached),
                "cavity_open": _optional(j.cavity_open),
                "blocked_by": [blocker_to_json(blocker) for blocker in j.blocked_by],
            }
            for j in certificate.joints
        ],
        "things": [
            {"name": t.name, "drift_m": _number(t.drift_m), "opening_free": _optional(t.opening_free)}
            for t in certificate.things
        ],
        "colliders": [
            {
                "link": fit.link,
                "drawn_to_collider": _gap_to_json(fit.drawn_to_collider),
                "collider_to_drawn": _gap_to_json(fit.collider_to_drawn),
            }
            for fit in certificate.colliders
        ],
        "rest_penetration_m": _number(certificate.rest_penetration_m),
        "together_penetration_m": _number(certificate.together_penetration_m),
        "drift_m": _number(certificate.drift_m),
        "realtime_factor": _number(certificate.realtime_factor, digits=1),
    }


def blocker_to_json(blocker: Blocker) -> dict[str, Any]:
    """An obstacle of a joint as JSON."""
    return {"name": blocker.name, "kind": blocker.kind, "position": _number(blocker.position)}


def _things(urdf: Urdf, files: BundleFiles, simulation: Simulation) -> tuple[ThingResult, ...]:
    """Every free-standing body that was simulated."""
    links = {link.name: link for link in urdf.links}
    return tuple(
        ThingResult(
            name=name,
            drift_m=simulation.drift_m.get(name, math.nan),
            opening_free=opening_free(links[name], files) if name in links else None,
        )
        for name in simulation.free
    )


def _closed_openings(things: tuple[ThingResult, ...]) -> tuple[Finding, ...]:
    return tuple(
        finding("opening", thing.name, f"{100 * thing.opening_free:.0f} % of its cavity is free of colliders")
        for thing in things
        if thing.opening_free is not None and thing.opening_free < NEEDED_OPENING
    )


def _far_colliders(fits: tuple[ColliderFit, ...]) -> tuple[Finding, ...]:
    return tuple(
        finding("collider-far", fit.link, f"5 % of {what} is more than {1000 * gap.p95_m:.0f} mm from {other}")
        for fit in fits
        for what, gap, other in (
            ("its visible surface", fit.drawn_to_collider, "every collider's: a hand passes through it or stops before it"),
            ("its colliders' surface", fit.collider_to_drawn, "all that is visible: a hand stops before it"),
        )
        if gap.p95_m > FAR_COLLIDER_M
    )


def _gap_to_json(gap: Gap) -> dict[str, Any]:
    return {"median_m": _number(gap.median_m), "p95_m": _number(gap.p95_m), "most_m": _number(gap.most_m)}


def _optional(value: float | None) -> float | None:
    return None if value is None else _number(value)


def _number(value: float, digits: int = 6) -> float | None:
    return round(value, digits) + 0.0 if math.isfinite(value) else None
