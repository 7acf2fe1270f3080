"""Mesh generation (§4.2): several candidate meshes of one object, and the choice of one."""

import logging
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import cv2

from r2c2r_core.errors import BackendUnavailable, Cancelled, GenerationFailed, R2C2RError
from r2c2r_core.generate.consensus import Rule, choose_candidate
from r2c2r_core.generate.evidence import Evidence, gather_evidence
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.upload import read_upload
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import CandidateSet, MeshAsset
from r2c2r_core.model.track import MaskTrack, at_rest
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.registry import Backend, Registry, Weights
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.tuning import Changes

log = logging.getLogger(__name__)

GENERATORS: Registry[MeshGenerator] = Registry(
    "generator",
    group="r2c2r.generators",
    protocol=MeshGenerator,
    own=(
        Backend(
            name="completion",
            target="r2c2r_core.generate.completion:Completion",
            summary="fused visible surface, completed by symmetry, to the wall or the category's depth; no weights",
        ),
        Backend(
            name="trellis",
            target="r2c2r_core.generate.trellis:Trellis",
            needs=("trellis", "torch"),
            install="github.com/microsoft/TRELLIS in an environment of its own and serve it to 'remote'",
            weights=Weights(
                usual="microsoft/TRELLIS-image-large",
                variable="R2C2R_TRELLIS_WEIGHTS",
                holds=("pipeline.json", "ckpts/*.safetensors"),
            ),
            licence="MIT (code and weights); its CUDA dependencies carry licences of their own, some non-commercial",
            summary="TRELLIS in this process: several photos in, a textured mesh out; an NVIDIA GPU with 16 GB",
        ),
        Backend(
            name="sam3d",
            target="r2c2r_core.generate.sam3d:Sam3dObjects",
            needs=("sam3d_objects", "torch", "hydra", "omegaconf"),
            install="github.com/facebookresearch/sam-3d-objects in an environment of its own and serve it to 'remote'",
            weights=Weights(
                usual="facebook/sam-3d-objects", variable="R2C2R_SAM3D_WEIGHTS", gated=True, holds=("**/pipeline.yaml",)
            ),
            licence="SAM License (gated weights; commercial use allowed, military use not)",
            licence_class="restricted",
            summary="SAM 3D Objects: one photo and its measured points in, a mesh with its place out; a GPU with 32 GB",
        ),
        Backend(
            name="remote",
            target="r2c2r_core.generate.remote:Remote",
            server="R2C2R_GENERATOR_URL",
            licence="as the remote generator's",
            summary="a generator on another machine: serve_worker.py, or TRELLIS as NVIDIA NIM",
        ),
    ),
    setting="generate.weights",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GenerateConfig:
    """Number of candidates, number of frames, and the rule of choice."""

    # the paper samples up to 10; 5 take about 4 s an object on one core
    count: int = setting(5, "number of candidates per object, 1 to 10", ge=1, le=10)
    pool_frames: int = setting(20, "frames to choose from, one per interval of the recording (paper, 4.2)", ge=1, le=1000)
    rule: Rule = setting("medoid", "medoid, or mean (as in the paper): how one candidate is chosen (consensus.py)")
    weights: str = setting(
        "", "learned generator's weights, folder or hub id; empty: R2C2R_<NAME>_WEIGHTS, else its default", max_length=4000
    )
    url: str = field(
        default_factory=lambda: os.environ.get("R2C2R_GENERATOR_URL", ""),
        metadata={"description": "address of the remote generator; default: R2C2R_GENERATOR_URL", "max_length": 4000},
    )
    params: Changes = tuned_numbers("generate")


def generate_candidates(
    capture: Capture,
    track: MaskTrack,
    generator: str,
    config: GenerateConfig,
    *,
    uploads: tuple[Path, ...] = (),
    seed: int = 0,
    batch: int = 0,
    earlier: CandidateSet | None = None,
    progress: Progress = SILENT,
) -> CandidateSet:
    """Candidates of one object, each in an arbitrary frame and unit, and their consensus.

    With `batch` n there are n more times as many: a candidate's draw (frames, settings, seed) follows from its id, and ids
    continue, so no draw repeats. `earlier` holds the results of the previous batches, which are generated again where it is
    missing.

    A candidate that fails is left out; raises GenerationFailed when none is left, OverrideError for an unusable upload, and
    BackendUnavailable when the generator cannot be used on this machine at all.
    """
    given = _read_all(uploads, track.name)
    backend = load_generator(generator, config, progress)
    progress.at(0.0, f"{track.name}: loading frames")
    evidence = gather_evidence(at_rest(capture, track), track, config.pool_frames)
    kept = [] if earlier is None else [c for c in earlier.candidates if c.generator != "upload"]
    numbers = range(0 if earlier is None else batch * config.count, (batch + 1) * config.count)
    made, failures = _make_all(backend, evidence, [f"c{k}" for k in numbers], seed, progress.part(0.1, 1.0))
    made = [*kept, *made]
    if not made and not given:
        raise GenerationFailed(
            f"{track.name}: {_count_of(failures)} failed: {failures[0]}",
            hint="add a click on a clearer frame, or upload a mesh",
        )
    if not made:  # only the uploads remain; the warning gives the reason
        given = [_warned(asset, f"{generator} made no mesh: {failures[0]}") for asset in given]
    return choose_candidate([*made, *given], rule=config.rule)


def _count_of(failures: list[str]) -> str:
    return "the candidate" if len(failures) == 1 else f"all {len(failures)} candidates"


def load_generator(name: str, config: GenerateConfig, progress: Progress = SILENT) -> MeshGenerator:
    """The generator of that name with its settings; raises BackendUnavailable with the next step."""
    served = {"url": config.url, "progress": progress} if name == "remote" else {}
    return GENERATORS.load(name, weights=config.weights, **served)


def with_uploads(found: CandidateSet, uploads: tuple[Path, ...], rule: Rule) -> CandidateSet:
    """The candidates and the uploaded meshes, and the consensus of all; raises OverrideError for an unusable upload."""
    return choose_candidate([*found.candidates, *_read_all(uploads, found.object_name)], rule=rule)


def _read_all(uploads: tuple[Path, ...], name: str) -> list[MeshAsset]:
    return [read_upload(path, name, f"upload{k}") for k, path in enumerate(uploads)]


def marked(found: CandidateSet, warning: str) -> CandidateSet:
    """The same candidates, each with an additional warning, shown wherever one of them is."""
    return replace(found, candidates=tuple(_warned(asset, warning) for asset in found.candidates))


def _warned(asset: MeshAsset, warning: str) -> MeshAsset:
    if warning in asset.warnings:
        return asset
    return replace(asset, warnings=(warning, *asset.warnings))


def _make_all(
    backend: MeshGenerator, evidence: Evidence, names: list[str], seed: int, progress: Progress
) -> tuple[list[MeshAsset], list[str]]:
    """The successful candidates, and the reasons of failures; an unavailable generator is not called again."""
    made: list[MeshAsset] = []
    failures: list[str] = []
    for k, name in enumerate(names):
        progress.at(k / len(names), f"{evidence.track.name}: candidate {k + 1} of {len(names)}")
        try:
            asset = _attempt(partial(backend.make, evidence, name, seed), failures)
        except BackendUnavailable as error:
            log.warning("%s: %s", evidence.track.name, error)
            failures.append(str(error))
            break
        if asset is not None:
            made.append(asset)
    progress.at(1.0, f"{evidence.track.name}: {len(made)} candidates")
    return made, failures


def _attempt(make: Callable[[], MeshAsset], failures: list[str]) -> MeshAsset | None:
    """The candidate, or None with the reason recorded: one bad draw must not fail the object."""
    try:
        return make()
    except (Cancelled, BackendUnavailable):
        raise
    except (R2C2RError, ValueError, RuntimeError, ArithmeticError, LookupError, cv2.error) as error:
        log.warning("candidate left out: %s", error, exc_info=not isinstance(error, R2C2RError))
        failures.append(str(error))
        return None
