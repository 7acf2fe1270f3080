"""Hypotheses of round objects: closed or hollow, with or without handle."""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.lathe import fit_lathe, is_round, lathe_mesh
from r2c2r_core.generate.seen import Seen, observe_thing
from r2c2r_core.generate.shape import Shape, thing_model
from r2c2r_core.generate.symmetry import Revolution, fit_revolution
from r2c2r_core.generate.unmasked import with_true_ends
from r2c2r_core.generate.variation import Variation
from r2c2r_core.generate.vessel import find_handle, vessel_mesh
from r2c2r_core.kitchen.names import category_of


def round_family(evidence: Evidence, everything: Variation) -> tuple[tuple[Hypothesis, ...], bool]:
    """Solids of revolution as hypotheses, none if the masks do not yield one, and whether depth also lies on it."""

    @lru_cache(maxsize=1)  # the variants of one draw share it
    def measured(variation: Variation) -> tuple[Seen, Revolution]:
        seen = observe_thing(evidence, variation)
        start = fit_revolution(seen.points)
        span = float(seen.low[2]), float(seen.high[2])
        found = None if start is None else fit_lathe(seen.points, start, *span, variation.views, seen.world_from_local)
        if found is None:
            raise GenerationFailed(f"{evidence.track.name}: its masks show no round outline", hint="add a click")
        return seen, found

    def body(variation: Variation) -> Shape:
        seen, outline = measured(variation)
        outline = with_true_ends(outline, seen.points, variation.views, seen.world_from_local)
        return thing_model(lathe_mesh(outline), seen.world_from_local, {"revolved": 1.0})

    def vessel(variation: Variation, with_handle: bool) -> Shape:
        seen, outline = measured(variation)
        outline = with_true_ends(outline, seen.points, variation.views, seen.world_from_local)
        shown = find_handle(outline, evidence.pool, seen.world_from_local)
        handle = shown if with_handle else None
        parameters = {"revolved": 1.0, "hollow": 1.0, "handles": float(handle is not None)}
        made = thing_model(vessel_mesh(outline, handle), seen.world_from_local, parameters)
        return replace(made, unseen_error_m=0.0 if shown is None or with_handle else shown.reach_m)

    def full(variation: Variation) -> Shape:
        made = body(variation)
        return replace(
            made, unseen_error_m=float(np.ptp(made.vertices_local[:, 2]))
        )  # its inner floor is usually near its base

    try:
        seen, outline = measured(everything)
    except GenerationFailed:
        return (), False
    true_ends = with_true_ends(outline, seen.points, everything.views, seen.world_from_local)
    family = [Hypothesis("round, as wide as its outlines", body)]
    if category_of(evidence.track.category).open_vessel:
        family = [Hypothesis("round and hollow", partial(vessel, with_handle=False)), Hypothesis("round and full", full)]
        if find_handle(true_ends, evidence.pool, seen.world_from_local) is not None:
            told = "round and hollow, with the handle its outlines show"
            family.insert(0, Hypothesis(told, partial(vessel, with_handle=True)))
    return tuple(family), is_round(seen.points, true_ends)
