"""Cuboid hypotheses whose depth is constrained by silhouettes, walls and the usual proportions."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from r2c2r_core.generate.cuboid import Cuboid, fit_cuboid, room_behind, surface_distance
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.seen import Seen
from r2c2r_core.generate.shape import Shape, thing_model
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of cuboid hypotheses."""

    box_m: float = param(0.006, "m", "Maximum median distance of the depth points from the cuboid")
    far_share: float = param(0.1, "share", "Maximum fraction of the points that may be outliers")
    far_m: float = param(0.015, "m", "Distance from the cuboid above which a point is an outlier")
    open_m: float = param(0.004, "m", "Standard deviation of the depth above which several depths are offered as hypotheses")


def carton_family(evidence: Evidence, seen: Seen) -> tuple[Hypothesis, ...]:
    """Cuboid hypotheses where the points lie on one, at depths that silhouettes, walls and the usual proportions allow."""
    params = tuned(Params)
    walls = evidence.capture.room.walls
    found = fit_cuboid(seen.points, seen.low, seen.high, evidence.pool, seen.world_from_local, walls)
    if found is None:
        return ()
    off = np.abs(surface_distance(found, seen.world_from_local.apply(seen.points)))
    if np.median(off) > params.box_m or (off > params.far_m).mean() > params.far_share:
        return ()
    room = room_behind(found, walls)
    family = [Hypothesis("a box", partial(_cuboid_shape, found, room, 0.0))]
    if found.depth_spread_m > params.open_m:
        family.append(Hypothesis("a box, shallower than likely", partial(_cuboid_shape, found, room, -1.0)))
        if room > params.open_m:
            family.append(Hypothesis("a box, deeper than likely", partial(_cuboid_shape, found, room, 1.0)))
    return tuple(family)


def _cuboid_shape(found: Cuboid, room_m: float, sigmas: float, variation: Variation) -> Shape:
    """The cuboid at another depth, offset by `sigmas` standard deviations but not into a wall.

    A draw varies the most likely depth to either side; the other hypotheses vary only towards the side that they are named for.
    """
    size = np.array(found.size_m)
    low = -size / 2  # the front, which was seen, stays
    off = sigmas * (1.0 + abs(variation.depth_draw) / 3.0) if sigmas else variation.depth_draw
    deeper = min(found.depth_spread_m * off, room_m)
    size[1] = max(size[1] + deeper, 0.3 * size[1])
    parameters = {"boxed": 1.0, "depth_sigma_m": float(found.sigma_m[1])}
    return thing_model(box_mesh(low, low + size), found.world_from_cuboid, parameters)
