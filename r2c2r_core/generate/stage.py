"""§4.2: several candidate meshes of one object, and the one to take."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import cv2

from r2c2r_core.errors import Cancelled, GenerationFailed, InputError, R2C2RError
from r2c2r_core.generate.consensus import choose_candidate
from r2c2r_core.generate.evidence import Evidence, gather_evidence
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.upload import read_upload
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import CandidateSet, MeshAsset
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.registry import Backend, Registry

log = logging.getLogger(__name__)

GENERATORS = Registry(
    "generator",
    (
        Backend(
            name="completion",
            target="r2c2r_core.generate.completion:Completion",
            summary="fused visible surface, completed by symmetry, to the wall or the category's depth; no weights",
        ),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GenerateConfig:
    """How many candidates, from how many frames, and how one is chosen."""

    count: int = 5  # the paper samples up to 10; 5 take about 4 s an object on one core
    pool_frames: int = 20  # the paper divides the images into 20 intervals (§4.2)
    rule: Literal["medoid", "mean"] = "medoid"  # "mean" is the paper's; see consensus.py for why not

    def __post_init__(self) -> None:
        if not 1 <= self.count <= 10:
            raise InputError(f"generate.count is {self.count}", hint="choose 1 to 10")
        if self.pool_frames < 1:
            raise InputError(f"generate.pool_frames is {self.pool_frames}", hint="choose at least 1")


def generate_candidates(
    capture: Capture,
    track: MaskTrack,
    generator: str,
    config: GenerateConfig,
    *,
    uploads: tuple[Path, ...] = (),
    rejected: tuple[str, ...] = (),
    seed: int = 0,
    progress: Progress = SILENT,
) -> CandidateSet:
    """Candidates of one object, each in an arbitrary frame and unit, and the consensus among those nobody rejected.

    A candidate that fails is left out; raises GenerationFailed when none is left, and OverrideError for an unusable upload.
    """
    given = [read_upload(path, track.name, f"upload{k}") for k, path in enumerate(uploads)]
    backend: MeshGenerator = GENERATORS.load(generator)
    progress.at(0.0, f"{track.name}: loading frames")
    evidence = gather_evidence(capture, track, config.pool_frames)
    made, failures = _make_all(backend, evidence, config.count, seed, progress.part(0.1, 1.0))
    if not made and not given:
        raise GenerationFailed(
            f"{track.name}: all {config.count} candidates failed: {failures[0]}",
            hint="add a click on a clearer frame, or upload a mesh",
        )
    return choose_candidate([*made, *given], rejected=rejected, rule=config.rule)


def _make_all(
    backend: MeshGenerator, evidence: Evidence, count: int, seed: int, progress: Progress
) -> tuple[list[MeshAsset], list[str]]:
    """The candidates that could be made, and why the others could not."""
    made: list[MeshAsset] = []
    failures: list[str] = []
    for k in range(count):
        progress.at(k / count, f"{evidence.track.name}: candidate {k + 1} of {count}")
        asset = _attempt(partial(backend.make, evidence, f"c{k}", seed), failures)
        if asset is not None:
            made.append(asset)
    progress.at(1.0, f"{evidence.track.name}: {len(made)} candidates")
    return made, failures


def _attempt(make: Callable[[], MeshAsset], failures: list[str]) -> MeshAsset | None:
    """The candidate, or None with the reason noted: one bad draw must not cost the object."""
    try:
        return make()
    except Cancelled:
        raise
    except (R2C2RError, ValueError, RuntimeError, ArithmeticError, LookupError, cv2.error) as error:
        log.warning("candidate left out: %s", error, exc_info=not isinstance(error, R2C2RError))
        failures.append(str(error))
        return None
