"""Consensus ranking of candidates: medoid of shape, combined with agreement with masks and depth.

The paper (§4.2) takes the mesh whose bounding box and volume are closest to their mean. Two departures, both measured in
backends.md §2.6: the candidates come in frames and units of their own, so the measures are scale-free (box sides over the
longest, filled share of the box); and the mean follows outliers (solid IoU 0.734, no better than a random pick), so the default
is the medoid (0.780), joined with the candidates' own consistency with masks and depth (0.783).

A candidate with a stated hypothesis differs from the others on purpose: its oddness is not penalised, only its disagreement
with the scan; for an unobserved side that is the wall behind it, the worktop on it or the usual size.

Metrics read here (MeshAsset.metrics): extent_middle, extent_short, volume_ratio, mask_iou, depth_residual_m, unseen_error_m,
stands, carved, faces. Masks and depth are unknown for a mesh whose generator does not know its pose, until it is placed
(pipeline.py does that); without them it is judged by its shape alone. A mesh that would tip over, is open, or has more faces
than a simulator handles well, must fit better to win.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from r2c2r_core.errors import GenerationFailed, OverrideError
from r2c2r_core.generate.consistency import Params as ConsistencyParams
from r2c2r_core.generate.consistency import disagreement
from r2c2r_core.model.mesh import CandidateSet, MeshAsset
from r2c2r_core.tuning import param, tuned

Rule = Literal["medoid", "mean"]

_SHAPE_METRICS = ("extent_middle", "extent_short", "volume_ratio")
_BUT = {
    "oddness": "its proportions differ {oddness:.1f} %",
    "unseen": "its unseen side is {unseen:.0f} cm from its most likely place",
    "heavy": "it has {faces:.0f} faces",
    "falls": "it would tip over",
    "copied": "it copies the masks with their errors",
    "open": "it is not closed",
}
"""Explanation of each cost other than the fit, for the candidate that bears it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned costs of a candidate's faults, in units of mask IoU."""

    unseen_weight: float = param(
        1.0,
        "score",
        "Cost per metre between an unobserved side and its most likely position",
        source="half the cost of an observed error",
    )
    open_cost: float = param(0.1, "score", "Cost of an open mesh, which has no inside, volume or mass")
    falls_cost: float = param(0.1, "score", "Cost of a shape that would tip over, since objects were scanned standing")
    most_faces: int = param(20_000, "count", "Number of triangles above which a mesh is penalised")
    heavy_cost: float = param(0.02, "score", "Cost per doubling of the number of triangles above most_faces")
    by_chance: float = param(
        0.02,
        "score",
        "Maximum cost difference attributed to chance between draws of one hypothesis",
        source="the drawn frames may or may not be among the judging frames",
    )
    fits_alike: float = param(0.005, "score", "Maximum cost difference at which two candidates fit equally well")


def choose_candidate(candidates: Sequence[MeshAsset], *, rejected: Sequence[str] = (), rule: Rule = "medoid") -> CandidateSet:
    """Rank all candidates, best first, and choose the best that was not rejected; raises GenerationFailed without one."""
    allowed = [i for i, c in enumerate(candidates) if c.candidate_id not in rejected]
    if not allowed:
        name = candidates[0].object_name if candidates else "object"
        raise GenerationFailed(
            f"{name}: every candidate was rejected", hint="accept one again, upload a mesh or change the seed"
        )
    costs = _costs(candidates, allowed, rule)
    cost = sum(costs.values(), np.zeros(len(candidates)))
    order = sorted(range(len(candidates)), key=lambda i: (i not in allowed, round(float(cost[i]), 12), i))
    best = _of_most_frames(candidates, [i for i in order if i in allowed], cost)
    order.insert(0, order.pop(order.index(best)))
    return CandidateSet(
        object_name=candidates[best].object_name,
        candidates=tuple(candidates),
        chosen_id=candidates[best].candidate_id,
        chosen_by="consensus",
        reason=_reason(candidates, best, allowed, costs, rule),
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


def _of_most_frames(candidates: Sequence[MeshAsset], order: Sequence[int], cost: np.ndarray) -> int:
    """Index of the best candidate, or of the draw from most frames with the same hypothesis and a cost within chance."""
    params = tuned(Params)
    best = order[0]
    said = candidates[best].assumes
    alike = [i for i in order if said and candidates[i].assumes == said and cost[i] <= cost[best] + params.by_chance]
    return max(alike, key=lambda i: len(candidates[i].frames), default=best)


def _oddness(candidates: Sequence[MeshAsset], allowed: Sequence[int], rule: Rule) -> np.ndarray:
    """Mean relative difference of each candidate's shape from the allowed others (medoid) or from their mean (paper)."""
    shapes = np.log(np.maximum([[c.metrics[name] for name in _SHAPE_METRICS] for c in candidates], 1e-6))
    if rule == "mean":
        return np.asarray(np.abs(shapes - np.log(np.exp(shapes[list(allowed)]).mean(axis=0))).mean(axis=1))
    others = [[j for j in allowed if j != i] or [i] for i in range(len(candidates))]
    return np.array([np.abs(shapes[i] - shapes[j]).mean() for i, j in enumerate(others)])


def _costs(candidates: Sequence[MeshAsset], allowed: Sequence[int], rule: Rule) -> dict[str, np.ndarray]:
    """Costs by kind, one array over the candidates each, in units of IoU."""
    consistency_params = tuned(ConsistencyParams)
    params = tuned(Params)
    by_chance = np.array([not c.assumes or rule == "mean" for c in candidates])
    known = np.array(["mask_iou" in c.metrics for c in candidates])
    fit = np.array([disagreement(c.metrics) if "mask_iou" in c.metrics else 0.0 for c in candidates])
    unseen = np.where(known, params.unseen_weight * np.array([c.metrics.get("unseen_error_m", 0.0) for c in candidates]), 0.0)
    usual = float(np.median((fit + unseen)[known])) if known.any() else 0.0  # for one whose fit is unknown
    faces = np.array([c.metrics.get("faces", 0.0) for c in candidates])
    return {
        "oddness": np.where(by_chance, _oddness(candidates, allowed, rule), 0.0),
        "fit": np.where(known, fit, usual),
        "unseen": unseen,
        "heavy": params.heavy_cost * np.log2(np.maximum(faces / params.most_faces, 1.0)),
        "falls": np.array([params.falls_cost if c.metrics.get("stands", 1.0) == 0.0 else 0.0 for c in candidates]),
        "copied": np.array([consistency_params.copied_cost * c.metrics.get("carved", 0.0) for c in candidates]),
        "open": np.array([0.0 if c.watertight else params.open_cost for c in candidates]),
    }


def _papers_choice(candidates: Sequence[MeshAsset], best: int, allowed: Sequence[int], rule: Rule) -> str:
    """Choice of the published rule (nearest to the mean box and volume), as a sentence after another; empty without one."""
    if len(allowed) < 3 or rule == "mean":
        return ""
    from_mean = _oddness(candidates, allowed, "mean")
    theirs = min(allowed, key=lambda i: (round(float(from_mean[i]), 12), i))
    taken = "takes it too" if theirs == best else f"would take {candidates[theirs].candidate_id}"
    return f" The paper's rule (nearest to the mean box and volume) {taken}."


def _reason(
    candidates: Sequence[MeshAsset], best: int, allowed: Sequence[int], costs: dict[str, np.ndarray], rule: Rule
) -> str:
    """How well the candidate fits, why its rival lost, its figures, and what the paper's rule takes."""
    chosen, count = candidates[best], len(allowed)
    skipped = f" ({len(candidates) - count} rejected)" if len(candidates) > count else ""
    if count == 1:
        return f"{chosen.candidate_id} is the only candidate left{skipped}."
    name = f"{chosen.candidate_id} ({chosen.assumes})" if chosen.assumes else chosen.candidate_id
    middle = "mean" if rule == "mean" else "others"
    counted = not chosen.assumes or rule == "mean"  # candidates with a stated hypothesis are odd on purpose
    shape = f"its proportions differ {100 * costs['oddness'][best]:.1f} % from the {middle}; " if counted else ""
    beside = _papers_choice(candidates, best, allowed, rule)
    if "mask_iou" not in chosen.metrics:
        return f"{name}: {shape}one of {count}{skipped}, its fit to masks and depth is known only after alignment.{beside}"
    place = 1 + sum(1 for i in allowed if costs["fit"][i] < costs["fit"][best] - 1e-12)
    depth = chosen.metrics.get("depth_residual_m")
    but = _passed_over(candidates, best, allowed, costs)
    fit = f"its fit to masks and depth is {'the best' if place == 1 else f'number {place}'} of {count}{skipped}{but}"
    outline = f"Its outline agrees {100 * chosen.metrics['mask_iou']:.0f} % with the masks"
    residual = f", its surface is within {1000 * depth:.0f} mm of the measured depth" if depth is not None else ""
    return f"{name}: {shape}{fit}. {outline}{residual}.{beside}"


def _passed_over(candidates: Sequence[MeshAsset], best: int, allowed: Sequence[int], costs: dict[str, np.ndarray]) -> str:
    """Why the best-fitting rival lost, if its fit does not explain it; begins with "; "."""
    params = tuned(Params)
    fit = costs["fit"]
    rival = min((i for i in allowed if i != best and "mask_iou" in candidates[i].metrics), key=lambda i: fit[i], default=None)
    if rival is None or fit[rival] > fit[best] + params.fits_alike:
        return ""
    decided = max(_BUT, key=lambda term: costs[term][rival] - costs[term][best])
    if costs[decided][rival] - costs[decided][best] <= max(fit[best] - fit[rival], 1e-3):
        return ""
    said = _BUT[decided].format(
        oddness=100 * costs["oddness"][rival],
        unseen=100 * candidates[rival].metrics.get("unseen_error_m", 0.0),
        faces=candidates[rival].metrics.get("faces", 0.0),
    )
    fits = "fits better" if fit[rival] < fit[best] - params.fits_alike else "fits as well"
    return f"; {candidates[rival].candidate_id} {fits}, but {said}"
