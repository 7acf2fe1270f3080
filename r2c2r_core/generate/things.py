"""Hypotheses of free-standing objects: round or box-shaped where masks and depth support it, else carved from free space."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import chain, zip_longest
from math import inf

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.cartons import carton_family
from r2c2r_core.generate.consistency import Params as ConsistencyParams
from r2c2r_core.generate.consistency import disagreement, self_consistency
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.hulls import ON_LEGS, carved_family
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.rounded import round_family
from r2c2r_core.generate.seen import observe_thing
from r2c2r_core.generate.symmetry import fit_revolution, is_rounder_than_box
from r2c2r_core.generate.variation import Variation
from r2c2r_core.tuning import param, tuned

Family = tuple[Hypothesis, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters for accepting a simple shape."""

    lathe_fit: float = param(0.75, "score", "Score below which carving competes with a solid of revolution")
    cuboid_fit: float = param(0.8, "score", "Score below which a cuboid is rejected")


def thing_hypotheses(evidence: Evidence, everything: Variation) -> tuple[Hypothesis, ...]:
    """Hypotheses of an object's shape in a gravity-aligned frame: the best-fitting kind interleaved with the others."""
    seen = observe_thing(evidence, everything)
    revolution = fit_revolution(seen.points)
    is_rounder = revolution is not None and is_rounder_than_box(seen.points, revolution)
    lathe, is_certain = round_family(evidence, everything) if revolution is not None else ((), False)
    cuboid = carton_family(evidence, seen)
    carved = carved_family(evidence, everything, is_round=is_rounder and not lathe)
    if carved[0].assumes == ON_LEGS:  # its top alone would fit a cuboid well
        return carved
    first = _likeliest(lathe, is_certain, cuboid, carved, partial(_fit, evidence, everything))
    if first is cuboid or not is_certain:
        others = [family for family in (lathe, carved, cuboid) if family and family is not first]
    else:  # an object that is certainly round is no box
        others = [carved]
    turns = zip_longest(first, *others)
    return tuple(h for h in chain.from_iterable(turns) if h is not None)


def _likeliest(lathe: Family, is_certain: bool, cuboid: Family, carved: Family, fit: Callable[[Hypothesis], float]) -> Family:
    """The clean family that fits well enough, else the better of a lathe and carving; a cuboid if neither can be built."""
    params = tuned(Params)
    sure = [
        (fit(family[0]), family, least) for family, least in ((lathe, params.lathe_fit), (cuboid, params.cuboid_fit)) if family
    ]
    sure = [entry for entry in sure if entry[1] is cuboid or is_certain]
    if sure:
        best = max(sure, key=lambda entry: entry[0])
        if best[0] > best[2]:
            return best[1]
    left = [(fit(carved[0]) - tuned(ConsistencyParams).copied_cost, carved), *([(fit(lathe[0]), lathe)] if lathe else [])]
    if cuboid and all(found == -inf for found, _ in left):
        return cuboid
    return max(left, key=lambda entry: entry[0])[1]


def _fit(evidence: Evidence, everything: Variation, hypothesis: Hypothesis) -> float:
    """Agreement with masks and depth of the best frames, at most 1; -inf for a hypothesis that yields no shape."""
    try:
        shape = hypothesis.shape(everything)
    except GenerationFailed:
        return -inf
    return 1.0 - disagreement(
        self_consistency(shape.vertices_world, shape.faces, shape.maskable, evidence.pool[: tuned(ConsistencyParams).judges])
    )
