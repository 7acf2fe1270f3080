"""Hypotheses of carved objects: unobserved space solid, mirrored, empty, or on legs."""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.bars import find_bars
from r2c2r_core.generate.carved import Carving, above, carve, emptied_height, sheet_field, solid_field, volume_below
from r2c2r_core.generate.carved import Params as CarvedParams
from r2c2r_core.generate.consistency import Params as ConsistencyParams
from r2c2r_core.generate.consistency import disagreement, self_consistency
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.legs import Support, find_support
from r2c2r_core.generate.level_set import best_level, surface_at
from r2c2r_core.generate.shape import Shape, thing_model
from r2c2r_core.generate.symmetry import fit_revolution
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.meshes import box_mesh, unite
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.tuning import param, tuned

ON_LEGS = "a slab on four legs"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of sheet-like objects."""

    least_sheets: float = param(
        3.0, "ratio", "Smallest extent, in sheet thicknesses, above which the sheet hypothesis is offered"
    )


def carved_family(evidence: Evidence, everything: Variation, *, is_round: bool) -> tuple[Hypothesis, ...]:
    """Visual hull and free space completed in several ways; raises GenerationFailed with too little depth."""
    is_legged = category_of(evidence.track.category).on_legs

    @lru_cache(maxsize=1)  # the variants of one draw share it
    def carved(variation: Variation) -> _Carved:
        carving = carve(evidence, variation)
        seen = carving.seen
        field, mirrored = solid_field(carving, None, mirror=True)
        level = best_level(carving.grid, field, seen.floor, variation, seen.world_from_local)
        return _Carved(carving, field, mirrored, level)

    known = carved(everything)
    support = find_support(known.carving, everything.views) if is_legged else None

    def hull(variation: Variation) -> Shape:
        known = carved(variation)
        return _less_likely(_surfaced(known, known.field, mirrored=float(known.mirrored)), known, known.field, support)

    def unmirrored(variation: Variation) -> Shape:
        known = carved(variation)
        field, _ = solid_field(known.carving, None, mirror=False)
        return _less_likely(_surfaced(known, field), known, field, support)

    def turned(variation: Variation) -> Shape:
        known = carved(variation)
        field, _ = solid_field(known.carving, fit_revolution(known.carving.seen.points), mirror=False)
        return _less_likely(_surfaced(known, field, revolved=1.0), known, field, support)

    def sheet(variation: Variation) -> Shape:
        known = carved(variation)
        field = sheet_field(known.carving, known.field)
        shell = _surfaced(known, field, mirrored=float(known.mirrored))
        return replace(shell, unseen_error_m=emptied_height(known.carving, known.field, field))

    def bars(variation: Variation) -> Shape:
        known = carved(variation)
        found = find_bars(known.carving, variation.views)
        if found is None:
            raise GenerationFailed("too little of it has depth", hint="scan it from nearer")
        seen = known.carving.seen
        surface = surface_at(known.carving.grid, found.field, 0.0, seen.floor)
        said = ("unobserved legs mirror the observed ones",) if found.mirrored > 0 else ()
        return thing_model(surface, seen.world_from_local, {"bars": 1.0, "mirrored": found.mirrored}, said)

    family = [Hypothesis("carved from free space", hull)]
    if is_legged and support is None:
        frame = Hypothesis("only its observed part, as thick as a bar", bars)
        closer = _cost(frame, evidence, everything) < _cost(family[0], evidence, everything)
        family.insert(0 if closer else 1, frame)
    if is_round:
        family.insert(0, Hypothesis("carved, its back as round as its front", turned))
    if known.mirrored:
        family.append(Hypothesis("carved, not mirrored", unmirrored))
    thick = np.ptp(known.carving.seen.points, axis=0).min() > tuned(Params).least_sheets * tuned(CarvedParams).sheet_m
    if thick and support is None:  # a slab on legs is no board in the air
        family.append(Hypothesis("as thin as a board where its back was not observed", sheet))
    if support is not None:
        family.insert(0, Hypothesis(ON_LEGS, lambda variation: _on_legs(carved(variation), support)))
    return tuple(family)


def _cost(hypothesis: Hypothesis, evidence: Evidence, everything: Variation) -> float:
    """Disagreement with masks and depth of the best frames; infinite for a hypothesis that yields no shape."""
    try:
        shape = hypothesis.shape(everything)
    except GenerationFailed:
        return inf
    judges = evidence.pool[: tuned(ConsistencyParams).judges]
    return disagreement(self_consistency(shape.vertices_world, shape.faces, shape.maskable, judges))


class _Carved(NamedTuple):
    carving: Carving
    field: np.ndarray  # unobserved space solid, mirrored where the object is symmetric
    mirrored: bool
    level: float


def _on_legs(known: _Carved, support: Support) -> Shape:
    """The carved shape above the slab's underside, united with the whole slab and its posts."""
    body = _surfaced(known, above(known.carving, known.field, float(support.slab.low[2])))
    boxes = [box_mesh(*support.slab), *(post.surface() for post in support.posts)]
    count, unseen = len(support.posts), sum(not post.is_seen for post in support.posts)
    parameters = {"mirrored": float(known.mirrored), "legs": float(count), "legs_inferred": float(unseen)}
    made = thing_model(
        unite([(body.vertices_local, body.faces), *boxes]),
        known.carving.seen.world_from_local,
        {**body.parameters, **parameters},
        (f"{unseen} of its {count} legs were not seen: inferred",) if unseen else (),
    )
    return replace(made, unseen_error_m=0.0)


def _less_likely(shape: Shape, known: _Carved, field: np.ndarray, support: Support | None) -> Shape:
    """The shape, with the mean height of its volume below a slab on posts as unobserved error: that space should be air."""
    if support is None:
        return shape
    plan = (support.slab.high - support.slab.low)[:2]
    below = volume_below(known.carving, field, float(support.slab.low[2]))
    return replace(shape, unseen_error_m=below / float(np.prod(plan)))


def _surfaced(known: _Carved, field: np.ndarray, **parameters: float) -> Shape:
    """Closed surface of the field at the level that suits the draw's masks."""
    seen = known.carving.seen
    surface = surface_at(known.carving.grid, field, known.level, seen.floor)
    return thing_model(surface, seen.world_from_local, {**parameters, "carved": 1.0, "level_m": known.level})
