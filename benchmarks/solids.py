"""Solids that a sample was drawn from, and the overlap of a mesh with one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np

from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.kitchen import Bottle
from r2c2r_core.synthetic.layout import plan_kitchen

_SIDES = 48


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueSolid:
    """True shape of one object, in world coordinates."""

    record: ObjectRecord
    solid: Any  # manifold3d.Manifold

    def extents_error(self, vertices_world: np.ndarray) -> float:
        """Mean relative error of the sizes along the object's own axes; a handle in front of the front face is excluded."""
        local = self.record.world_from_object.inverse.apply(vertices_world)
        low, high = local.min(axis=0), local.max(axis=0)
        if not self.record.turns_freely:
            low[1] = max(low[1], _front_face(local[:, 1]))
        return float((np.abs(high - low - self.record.dimensions_m) / self.record.dimensions_m).mean())

    def recentred(self, vertices_world: np.ndarray) -> np.ndarray:
        """The vertices, with a round object's centre shifted to its true place, which only the alignment estimates.

        Otherwise a round object a centimetre off would be judged by that alone; furniture keeps its place, as its handle is
        part of it.
        """
        if not self.record.turns_freely:
            return vertices_world
        middle = (vertices_world.min(axis=0) + vertices_world.max(axis=0)) / 2
        return vertices_world - middle + self.record.world_from_object.translation


def true_solids(seed: int, truth: Path, world_from_capture: Rigid3) -> dict[str, TrueSolid]:
    """Every object's solid: bottles by their profile, others as boxes (a cupboard is the space it fills)."""
    bottles = {bottle.name: bottle for bottle in plan_kitchen(seed).bottles}
    return {
        record.name: TrueSolid(record=record, solid=_solid_of(record, bottles.get(record.name)))
        for record in read_truth(truth, world_from_capture)
    }


def overlap(vertices: np.ndarray, faces: np.ndarray, true: TrueSolid) -> float:
    """Exact solid intersection over union, 0..1."""
    mesh = _manifold(vertices, faces)
    shared = (mesh ^ true.solid).volume()
    return float(shared / max(mesh.volume() + true.solid.volume() - shared, 1e-12))


def _solid_of(record: ObjectRecord, bottle: Bottle | None) -> Any:
    half = record.dimensions_m / 2
    if bottle is None:
        vertices, faces = box_mesh(-half, half)
    else:
        vertices, faces = _revolved(_profile(bottle) - [0.0, half[2]])
    return _manifold(record.world_from_object.apply(vertices), faces)


def _profile(bottle: Bottle) -> np.ndarray:
    """(radius, height above the base) from the base to the top, as synthetic/build.py draws it."""
    r, h, n = bottle.radius_m, bottle.height_m, bottle.neck_radius_m
    shoulder, neck, cap = bottle.shoulder * h, (bottle.shoulder + 0.18) * h, h - 0.022
    turn = np.linspace(0, np.pi, 9)[::-1]
    bend = np.column_stack([n + (r - n) * (1 - np.cos(turn)) / 2, neck + (shoulder - neck) * turn / np.pi])
    return np.vstack([[[r - 0.006, 0.0], [r, 0.006]], bend, [[n, cap], [n + 0.0015, cap + 1e-4], [n + 0.0015, h]]])


def _revolved(profile: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    outline = manifold3d.CrossSection([np.vstack([[0.0, profile[0, 1]], profile, [0.0, profile[-1, 1]]])])
    mesh = outline.revolve(_SIDES).to_mesh()
    return np.asarray(mesh.vert_properties, np.float64)[:, :3], np.asarray(mesh.tri_verts, np.int64)


def _manifold(vertices: np.ndarray, faces: np.ndarray) -> Any:
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.ascontiguousarray(vertices, np.float64), tri_verts=np.ascontiguousarray(faces, np.uint64)
        )
    )


def _front_face(y: np.ndarray) -> float:
    """The foremost depth coordinate shared by many vertices: a handle and its posts stand in front of it."""
    middle = (y.min() + y.max()) / 2
    front = y[y < middle]
    return float(np.quantile(front, 0.5)) if len(front) else float(y.min())
