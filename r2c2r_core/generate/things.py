"""Free-standing things: round or box-shaped where masks and depth agree that they are, else carved from free space."""

from functools import lru_cache

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.generate.carved import Seen, carved_shape, observe_thing
from r2c2r_core.generate.consistency import self_consistency
from r2c2r_core.generate.cuboid import Cuboid, fit_cuboid, room_behind, surface_distance
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.lathe import fit_lathe, is_round, lathe_mesh
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.symmetry import Revolution, fit_revolution, is_rounder_than_box
from r2c2r_core.generate.variation import Variation, whole_pool
from r2c2r_core.generate.vessel import find_handle, is_open_vessel, vessel_mesh
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3

_LATHE_FIT, _CUBOID_FIT = 0.75, 0.8  # below it carving is tried: a lathe is compared with it, a box given up
_SIMPLER = 0.05  # carving copies the masks' errors: it has to agree with them better than a clean shape
_BOX_M, _FAR_SHARE = 0.006, 0.1  # median distance of a box's points from it, and the share that may be far from it
_FAR_M = 0.015


def thing_shape(evidence: Evidence, variation: Variation) -> Shape:
    """A thing's solid from the views of one draw, in a gravity-aligned frame; raises GenerationFailed."""
    seen = observe_thing(evidence, variation)
    revolution = fit_revolution(seen.points)
    lathe, is_certain = _lathe_shape(evidence, variation, revolution, seen) if revolution is not None else (None, False)
    cuboid = _cuboid_shape(evidence, variation)
    sure = [shape for shape, passed in ((lathe, is_certain), (cuboid, True)) if shape is not None and passed]
    fits = [_fit(shape, evidence) for shape in sure]
    if sure and max(fits) > (_LATHE_FIT if sure[int(np.argmax(fits))] is lathe else _CUBOID_FIT):
        return sure[int(np.argmax(fits))]
    rounder = revolution is not None and is_rounder_than_box(seen.points, revolution)
    carved = carved_shape(evidence, variation, seen, revolution if rounder else None)
    return lathe if lathe is not None and _fit(lathe, evidence) > _fit(carved, evidence) - _SIMPLER else carved


def _lathe_shape(evidence: Evidence, variation: Variation, revolution: Revolution, seen: Seen) -> tuple[Shape | None, bool]:
    """A clean body of revolution, None where masks do not give one, and whether the depth points lie on it too."""
    span = float(seen.low[2]), float(seen.high[2])
    measured = fit_lathe(seen.points, revolution, *span, variation.views, seen.world_from_local)
    if measured is None:
        return None, False
    if is_open_vessel(evidence.track.category):
        handle = find_handle(measured, evidence.pool, seen.world_from_local)
        mesh, parameters = vessel_mesh(measured, handle), {"revolved": 1.0, "hollow": 1.0, "handles": float(handle is not None)}
    else:
        mesh, parameters = lathe_mesh(measured), {"revolved": 1.0}
    return _model(*mesh, seen.world_from_local, parameters), is_round(seen.points, measured)


def _cuboid_shape(evidence: Evidence, variation: Variation) -> Shape | None:
    """A flat-sided box, where the points lie on one, as deep as the draw has it within what is known of the depth."""
    found = _cuboid(evidence)
    if found is None:
        return None
    size, sigma = np.array(found.size_m), float(found.sigma_m[1])
    low = -size / 2  # the front, which was seen, stays
    deeper = min(found.depth_spread_m * variation.depth_draw, room_behind(found, evidence.capture.room.walls))
    size[1] = max(size[1] + deeper, 0.3 * size[1])
    parameters = {"boxed": 1.0, "depth_sigma_m": sigma}
    return _model(*box_mesh(low, low + size), found.world_from_cuboid, parameters)


@lru_cache(maxsize=1)  # the candidates of one object share it
def _cuboid(evidence: Evidence) -> Cuboid | None:
    """The box that all good frames give; None where the points do not lie on one."""
    seen = observe_thing(evidence, whole_pool(evidence))
    walls = evidence.capture.room.walls
    found = fit_cuboid(seen.points, seen.low, seen.high, evidence.pool, seen.world_from_local, walls)
    if found is None:
        return None
    off = np.abs(surface_distance(found, seen.world_from_local.apply(seen.points)))
    return None if np.median(off) > _BOX_M or (off > _FAR_M).mean() > _FAR_SHARE else found


def _model(vertices: Points, faces: Faces, world_from_local: Rigid3, parameters: dict[str, float]) -> Shape:
    return Shape(
        vertices_local=vertices,
        faces=faces,
        world_from_local=world_from_local,
        front_y_m=None,
        maskable=np.ones(len(faces), dtype=bool),
        parameters={"revolved": 0.0, "mirrored": 0.0, **parameters},
        warnings=(),
    )


def _fit(shape: Shape, evidence: Evidence) -> float:
    """Mask IoU less twice the depth residual in metres (backends.md §2.7), over the best frames."""
    fit = self_consistency(shape.vertices_world, shape.faces, shape.maskable, evidence.pool[:8])
    return fit["mask_iou"] - 2.0 * fit.get("depth_residual_m", 0.0)
