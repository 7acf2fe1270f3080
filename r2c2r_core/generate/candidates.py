"""Candidate set of one object: generated, merged with existing ones and uploads, placed, scored and ranked."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np

from r2c2r_core.errors import PlacementFailed
from r2c2r_core.generate.consensus import Rule, choose_candidate, chosen_by_person
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, generate_candidates, marked, with_uploads
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned

Place = Callable[..., Placement]
"""(capture, track, asset, progress=…) to a placement; raises PlacementFailed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of candidate evaluation."""

    most_weighed: int = param(
        5,
        "count",
        "Maximum number of candidates that are placed for their evidence",
        source="about 4 s each on one core",
        ge=1,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Settings for generating one object's candidates."""

    generator: str
    config: GenerateConfig
    seed: int = 0
    batch: int = 0  # number of further batches that a reviewer requested
    excuse: str = ""  # why this generator replaces the chosen one

    @property
    def places(self) -> bool:
        """Whether its meshes must be placed before they can be compared; the default generator measures its own."""
        return self.generator != GENERATORS.default

    def steps(self, uploads: bool) -> tuple["Plan", ...]:
        """Plans whose candidates this one (perhaps with uploads) only extends, nearest first."""
        return (*([self] if uploads else []), *([replace(self, batch=self.batch - 1)] if self.batch else []))

    def stand_in(self, why: str) -> "Plan | None":
        """Plan of the weight-free default generator as fallback, with the reason; None if this is already it."""
        if self.generator == GENERATORS.default:
            return None
        excuse = f"{self.generator} made no mesh, {GENERATORS.default} was used instead: {why}"
        return replace(self, generator=GENERATORS.default, excuse=excuse)


def make_candidates(
    capture: Capture,
    track: MaskTrack,
    plan: Plan,
    uploads: tuple[Path, ...],
    place: Place | None,
    earlier: tuple[Plan, CandidateSet] | None,
    *,
    progress: Progress = SILENT,
) -> CandidateSet:
    """An object's candidates, ranked; those of `earlier`, a step of the plan, are reused and not generated again."""
    step, found = earlier or (None, None)
    if found is not None and step == plan:
        found = with_uploads(found, uploads, plan.config.rule)
        return found if place is None else weighed(capture, track, found, place, plan.config.rule, progress)
    found = generate_candidates(
        capture,
        track,
        plan.generator,
        plan.config,
        uploads=uploads,
        seed=plan.seed,
        batch=plan.batch,
        earlier=found,
        progress=progress,
    )
    if place is not None:
        found = weighed(capture, track, found, place, plan.config.rule, progress)
    return marked(found, plan.excuse) if plan.excuse else found


def weighed(
    capture: Capture, track: MaskTrack, found: CandidateSet, place: Place, rule: Rule, progress: Progress = SILENT
) -> CandidateSet:
    """The set with unplaced candidates placed, compared with masks and depth, and ranked again.

    Only the most likely few are placed; one that fails to place, or was not tried, is judged by its shape alone.
    """
    unknown = [c for c in found.candidates if "mask_iou" not in c.metrics]
    if not unknown or len(found.candidates) == 1:
        return found
    tried = sorted(unknown, key=lambda c: found.ranking.index(c.candidate_id))[: tuned(Params).most_weighed]
    fits: dict[str, dict[str, float]] = {}
    for k, asset in enumerate(tried):
        part = progress.part(k / len(tried), (k + 1) / len(tried))
        with suppress(PlacementFailed):
            placed = place(capture, track, asset, progress=part)
            depth = {"depth_residual_m": placed.rms_m} if isfinite(placed.rms_m) else {}
            size_m = float(np.ptp(placed.world_from_mesh.apply(asset.mesh.vertices), axis=0).max())
            fits[asset.candidate_id] = {"mask_iou": placed.mask_iou, "size_m": size_m, **depth}
    candidates = [replace(c, metrics={**c.metrics, **fits.get(c.candidate_id, {})}) for c in found.candidates]
    return choose_candidate(candidates, rule=rule)


def select_candidate(found: CandidateSet, override: ObjectOverride, rule: Rule) -> CandidateSet:
    """The candidate a person chose, else the consensus among those not rejected; generates no candidates."""
    if override.candidate is not None:
        uploaded = [c.candidate_id for c in found.candidates if c.candidate_id.startswith("upload")]
        return chosen_by_person(found, uploaded[0] if Path(override.candidate).is_file() else override.candidate)
    return choose_candidate(found.candidates, rejected=override.rejected, rule=rule) if override.rejected else found
