"""Shape hypotheses of fronts and appliances: boxes with the front on the measured plane, with handle and relief."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Literal

import numpy as np

from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.relief import BoxPart, Relief, handle_parts, measure_relief
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.meshes import box_mesh, unite
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.depth import DepthBehind, DepthSource, depths_behind, distinct, next_sizes, sigma_m
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.tuning import param, tuned

HandleStyle = Literal["bar", "block", "none"]

_TOLD: dict[DepthSource, str] = {
    "box": "as its box was measured",
    "wall": "to the wall behind it",
    "worktop": "as the worktop on it",
    "category": "as is usual for its category",
    "catalogue": "the next size sold",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of box-shaped furniture: when depth and faces count as measured."""

    front_zone_m: float = param(0.03, "m", "Distance behind the outer face within which mesh faces belong to the front")
    block_error: float = param(0.25, "ratio", "Error assigned to a handle drawn as a solid block, relative to its protrusion")


def front_hypotheses(evidence: Evidence, front: FrontPanel) -> tuple[Hypothesis, ...]:
    """A measured front extruded to each candidate depth, with its handle and without; frame `front`."""
    depths = _depths(evidence, front)
    relief = cache(partial(measure_relief, front))  # the guesses of one draw share it

    def shape(behind: DepthBehind, handle: HandleStyle, variation: Variation) -> Shape:
        depth = behind.depth_m * _scale(behind, variation)
        box = BoxPart(front.corners_front[3], front.corners_front[1] + [0.0, depth, 0.0])
        made = _box_with_relief(box, front.world_from_front, relief(variation), handle)
        at_front = made.vertices_local[made.faces][:, :, 1].max(axis=1) < tuned(Params).front_zone_m
        masked = at_front | (evidence.track.kind == "appliance")  # masks of fronts leave out their carcass
        error = abs(depth - depths[0].depth_m) + _handle_error(relief(variation), handle)
        measures = {"depth_m": depth, "behind_sigma_m": sigma_m(behind.source)}
        return replace(made, maskable=masked, parameters=made.parameters | measures, unseen_error_m=error)

    return _depths_and_handles(depths, front, shape)


def _depths(evidence: Evidence, front: FrontPanel) -> tuple[DepthBehind, ...]:
    """Candidate depths: an appliance's observed one and those assumed behind the front; next to a front's, the sizes sold."""
    box = evidence.track.box
    assumed = depths_behind(evidence.capture, front, category_of(evidence.track.category))
    if box is None:
        return distinct([*assumed, *next_sizes(assumed[0].depth_m)])
    observed = [DepthBehind(float(box.dimensions_m[1]), "box")] if box.depth_seen else []
    return distinct([*observed, *assumed])


def _depths_and_handles(
    depths: Sequence[DepthBehind], front: FrontPanel, shape: Callable[[DepthBehind, HandleStyle, Variation], Shape]
) -> tuple[Hypothesis, ...]:
    """Hypotheses: the candidate depths interleaved with the alternative handle styles at the most trusted depth."""
    style: HandleStyle = "bar" if front.handle is not None else "none"
    others = [Hypothesis("{depth_m:.2f} m deep, " + _TOLD[b.source], partial(shape, b, style)) for b in depths]
    if style == "none":
        return tuple(others)
    best = depths[0]
    styles: tuple[tuple[str, HandleStyle], ...] = (("front without its handle", "none"), ("handle as a solid block", "block"))
    handles = [Hypothesis(told, partial(shape, best, other)) for told, other in styles]
    return (*others[:2], handles[0], *others[2:], handles[1])


def _box_with_relief(box: BoxPart, world_from_front: Rigid3, relief: Relief, handle: HandleStyle) -> Shape:
    """The box with the handle and the relief of its front."""
    bars = handle_parts(relief.handle, as_bar=handle == "bar") if relief.handle and handle != "none" else ()
    parts = [box_mesh(*part) for part in (box, *relief.raised, *bars)]
    vertices, faces = unite(parts, [box_mesh(*part) for part in relief.sunk])
    return Shape(
        vertices_local=vertices,
        faces=faces,
        world_from_local=world_from_front,
        front_y_m=float(box.low[1]),
        maskable=np.ones(len(faces), dtype=bool),
        parameters={"raised_steps": float(len(relief.raised)), "sunk_steps": float(len(relief.sunk))},
        warnings=(),
        handle=relief.handle if bars else None,
    )


def _handle_error(relief: Relief, style: HandleStyle) -> float:
    """Prior error of a handle style relative to the usual bar, scaled by the observed protrusion: hands reach behind a bar."""
    errors: dict[HandleStyle, float] = {"bar": 0.0, "block": tuned(Params).block_error, "none": 1.0}
    return 0.0 if relief.handle is None else errors[style] * relief.handle.protrusion_m


def _scale(behind: DepthBehind, variation: Variation) -> float:
    """Depth factor of a draw: the full spread for a usual depth, less for a surer one, none if observed or from a catalogue."""
    spread = 0.0 if behind.source in ("box", "catalogue") else sigma_m(behind.source) / sigma_m("category")
    return 1.0 + spread * (variation.depth_scale - 1.0)
