"""Which candidate to take: the one most like the others that also agrees best with masks and depth.

The paper (§4.2) takes the mesh whose bounding box and volume are closest to their mean. Two departures, both measured in
backends.md §2.6: the candidates come in frames and units of their own, so the measures are scale-free (box sides over the
longest, filled share of the box); and the mean follows outliers (solid IoU 0.734, no better than a random pick), so the
default is the medoid (0.780), joined with the candidates' own consistency with masks and depth (0.783).

A candidate that says what it assumes differs from the others on purpose: being odd does not count against it, only what the
scan says does; of a side that nobody saw that is the wall behind it, the worktop on it or what is usual.

Metrics read here (MeshAsset.metrics): extent_middle, extent_short, volume_ratio, mask_iou, depth_residual_m, unseen_error_m,
stands, carved, faces. Masks and depth are unknown for a mesh whose generator does not know its place, until it was placed
(pipeline.py does that); without them it is judged by its shape alone. What would fall over, an open mesh, or one with more
faces than a simulator likes, has to fit better to win.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from r2c2r_core.errors import GenerationFailed, OverrideError
from r2c2r_core.model.mesh import CandidateSet, MeshAsset

Rule = Literal["medoid", "mean"]

_SHAPE_METRICS = ("extent_middle", "extent_short", "volume_ratio")
_DEPTH_WEIGHT = 2.0  # per metre, against 1 per unit of IoU (backends.md §2.7)
_UNSEEN_WEIGHT = 1.0  # per metre: half of an error that was seen
_OPEN_COST = 0.1  # of IoU: what is not closed has no inside, volume or mass
_COPIED_COST = 0.05  # carving copies the masks' errors: it has to agree with them better than a clean shape
_FALLS_COST = 0.1  # what would tip over was not found standing
_MOST_FACES, _HEAVY_COST = 20_000, 0.02  # per doubling beyond them


def choose_candidate(candidates: Sequence[MeshAsset], *, rejected: Sequence[str] = (), rule: Rule = "medoid") -> CandidateSet:
    """Rank all candidates, best first, and choose the best that nobody rejected; raises GenerationFailed without one."""
    allowed = [i for i, c in enumerate(candidates) if c.candidate_id not in rejected]
    if not allowed:
        name = candidates[0].object_name if candidates else "object"
        raise GenerationFailed(f"{name}: every candidate was rejected", hint="take one back, upload a mesh or change the seed")
    oddness = _oddness(candidates, allowed, rule)
    doubt = _doubt(candidates)
    by_chance = np.array([not c.assumes or rule == "mean" for c in candidates])
    cost = np.where(by_chance, oddness, 0.0) + doubt + _flaws(candidates)
    order = sorted(range(len(candidates)), key=lambda i: (i not in allowed, round(float(cost[i]), 12), i))
    best = order[0]
    return CandidateSet(
        object_name=candidates[best].object_name,
        candidates=tuple(candidates),
        chosen_id=candidates[best].candidate_id,
        chosen_by="consensus",
        reason=_reason(candidates, best, allowed, oddness, doubt, rule),
        ranking=tuple(candidates[i].candidate_id for i in order),
    )


def chosen_by_person(candidates: CandidateSet, candidate_id: str) -> CandidateSet:
    """The same candidates with a person's choice; raises OverrideError when there is no such candidate."""
    known = [c.candidate_id for c in candidates.candidates]
    if candidate_id not in known:
        raise OverrideError(
            f"{candidates.object_name}: no candidate '{candidate_id}'",
            hint=f"choose one of: {', '.join(known)}, or a mesh file",
        )
    return replace(candidates, chosen_id=candidate_id, chosen_by="person", reason="A person chose it.")


def _oddness(candidates: Sequence[MeshAsset], allowed: Sequence[int], rule: Rule) -> np.ndarray:
    """Mean relative difference of each candidate's shape from the allowed others (medoid) or from their mean (paper)."""
    shapes = np.log(np.maximum([[c.metrics[name] for name in _SHAPE_METRICS] for c in candidates], 1e-6))
    if rule == "mean":
        return np.asarray(np.abs(shapes - np.log(np.exp(shapes[list(allowed)]).mean(axis=0))).mean(axis=1))
    others = [[j for j in allowed if j != i] or [i] for i in range(len(candidates))]
    return np.array([np.abs(shapes[i] - shapes[j]).mean() for i, j in enumerate(others)])


def _doubt(candidates: Sequence[MeshAsset]) -> np.ndarray:
    """Disagreement with masks and depth; where unknown, the median of the candidates that know theirs."""
    known = [
        1.0
        - c.metrics["mask_iou"]
        + _DEPTH_WEIGHT * c.metrics.get("depth_residual_m", 0.0)
        + _UNSEEN_WEIGHT * c.metrics.get("unseen_error_m", 0.0)
        if "mask_iou" in c.metrics
        else np.nan
        for c in candidates
    ]
    values = np.array(known, dtype=np.float64)
    missing = np.isnan(values)
    return np.where(missing, np.median(values[~missing]) if (~missing).any() else 0.0, values)


def _flaws(candidates: Sequence[MeshAsset]) -> np.ndarray:
    """What a mesh costs that cannot be as it is, or that later stages can use less well."""
    faces = np.array([c.metrics.get("faces", 0.0) for c in candidates])
    heavy = _HEAVY_COST * np.log2(np.maximum(faces / _MOST_FACES, 1.0))
    falls = np.array([_FALLS_COST if c.metrics.get("stands", 1.0) == 0.0 else 0.0 for c in candidates])
    copied = np.array([_COPIED_COST * c.metrics.get("carved", 0.0) for c in candidates])
    return np.asarray(heavy + falls + copied + [0.0 if c.watertight else _OPEN_COST for c in candidates])


def _papers_choice(candidates: Sequence[MeshAsset], best: int, allowed: Sequence[int], rule: Rule) -> str:
    """What the published rule (nearest to the mean box and volume) takes, to end the sentence; empty without a choice."""
    if len(allowed) < 3 or rule == "mean":
        return ""
    from_mean = _oddness(candidates, allowed, "mean")
    theirs = min(allowed, key=lambda i: (round(float(from_mean[i]), 12), i))
    taken = "takes it too" if theirs == best else f"would take {candidates[theirs].candidate_id}"
    return f"; the paper's rule, nearest to the mean box and volume, {taken}"


def _reason(
    candidates: Sequence[MeshAsset], best: int, allowed: Sequence[int], oddness: np.ndarray, doubt: np.ndarray, rule: Rule
) -> str:
    """One sentence for the reviewer."""
    chosen, count = candidates[best], len(allowed)
    passed_over = len(candidates) - count
    skipped = f" ({passed_over} rejected)" if passed_over else ""
    if count == 1:
        return f"{chosen.candidate_id} is the only candidate left{skipped}."
    beside = _papers_choice(candidates, best, allowed, rule)
    middle = "mean" if rule == "mean" else "others"
    shape = f"its proportions differ {100 * oddness[best]:.1f} % from the {middle} of {count}{skipped}"
    name = f"{chosen.candidate_id} ({chosen.assumes})" if chosen.assumes else chosen.candidate_id
    if "mask_iou" not in chosen.metrics:
        return f"{name}: {shape}; its fit to masks and depth is known only after alignment{beside}."
    place = 1 + sum(1 for i in allowed if doubt[i] < doubt[best] - 1e-12)
    depth = chosen.metrics.get("depth_residual_m")
    residual = f" and depth within {1000 * depth:.0f} mm" if depth is not None else ""
    fit = f"mask IoU {chosen.metrics['mask_iou']:.2f}{residual} (rank {place} of {count})"
    return f"{name}: {shape}, with {fit}{beside}."
