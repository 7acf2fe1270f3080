"""The four stages after the alignment, run and timed on a finished reconstruction's placements (scene.py and galley.py)."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from r2c2r_core.config import ReconstructConfig
from r2c2r_core.export.stage import write_bundle
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, Prompts
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.overrides import NO_OVERRIDES
from r2c2r_core.synthesize.stage import build_scene
from r2c2r_core.warp.stage import fit_meshes
from r2c2r_core.workspace import Workspace


class Placed(NamedTuple):
    """Inputs of the synthesis; the lists are parallel."""

    capture: Capture
    tracks: list[MaskTrack]
    placements: list[Placement]
    assets: list[MeshAsset]  # the chosen candidates


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proof:
    """Results of the four stages, and their cost."""

    primitives: ArticulatedScene  # before the warp
    scene: ArticulatedScene
    certificate: Certificate
    bundle: Path
    seconds: dict[str, float]  # wall clock, by stage
    cpu_seconds: float


def placed_by(work: Workspace) -> Placed:
    """Placements of a finished run, with their capture, tracks and meshes."""
    names = work.names("align")
    return Placed(
        capture=work.load_latest("ingest", "scene"),
        tracks=[work.load_latest("segment", name) for name in names],
        placements=[work.load_latest("align", name) for name in names],
        assets=[work.load_latest("generate", name).chosen for name in names],
    )


def prove(placed: Placed, bundle: Path) -> Proof:
    """Synthesis, warp, export and certificate with the default settings."""
    config, seconds, started = ReconstructConfig(), dict[str, float](), _cpu_seconds()
    capture, tracks, placements, assets = placed

    def timed(name: str, compute: Callable[[], Any]) -> Any:
        begun = time.monotonic()
        value = compute()
        seconds[name] = time.monotonic() - begun
        return value

    primitives = timed("synthesize", lambda: build_scene(capture, tracks, placements, assets, NO_OVERRIDES, config.synthesize))
    scene = timed("warp", lambda: fit_meshes(primitives, tracks, placements, assets, config.warp))
    certificate = timed("export", lambda: write_bundle(_reconstruction(placed, scene), bundle, config.export))
    return Proof(
        primitives=primitives,
        scene=scene,
        certificate=certificate,
        bundle=bundle,
        seconds=seconds,
        cpu_seconds=_cpu_seconds() - started,
    )


def certificate_figures(certificate: Certificate) -> dict[str, Any]:
    """The certificate's figures, the worst over joints and objects."""
    joints = certificate.joints
    openings = [thing.opening_free for thing in certificate.things if thing.opening_free is not None]
    cavities = [joint.cavity_open for joint in joints if joint.cavity_open is not None]
    return {
        "passed": certificate.passed,
        "rest_mm": mm(certificate.rest_penetration_m),
        "sweep_mm": mm(max(joint.deepest_penetration_m for joint in joints)),
        "together_mm": mm(certificate.together_penetration_m),
        "travel_percent": round(100 * min(joint.travel_reached for joint in joints), 1),
        "drift_mm": mm(certificate.drift_m),
        "cavity_percent": round(100 * min(cavities), 1),
        "opening_percent": round(100 * min(openings), 1) if openings else None,
        "loaders": sum(loader.state == "passed" for loader in certificate.loaders),
        "errors": sum(finding.severity == "error" for finding in certificate.findings),
        "realtime_factor": round(certificate.realtime_factor, 1),
    }


def mm(metres: float) -> float:
    """Millimetres, rounded to a thousandth."""
    return round(1000 * metres, 3)


def _reconstruction(placed: Placed, scene: ArticulatedScene) -> Reconstruction:
    prompts = tuple(ObjectPrompt(name=track.name, category=track.category, points=()) for track in placed.tracks)
    return Reconstruction(
        capture=placed.capture,
        prompts=Prompts(objects=prompts),
        overrides=NO_OVERRIDES,
        tracks=tuple(placed.tracks),
        candidates=(),
        placements=tuple(placed.placements),
        scene=scene,
        stages=(),
        failures={},
    )


def _cpu_seconds() -> float:
    """CPU time of this process and of the child processes it waited for (the loaders)."""
    return sum(os.times()[:4])
