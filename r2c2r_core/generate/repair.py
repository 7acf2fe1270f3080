"""Any triangles as a closed, outward, textured mesh: what was wrong is mended, and every step is noted for a person."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.errors import OverrideError
from r2c2r_core.generate.asset import unposed
from r2c2r_core.generate.charts import unwrapped_atlas
from r2c2r_core.generate.meshfile import MeshPart, sample_colours
from r2c2r_core.geometry.meshes import (
    distances_to_mesh,
    is_manifold,
    is_watertight,
    join_vertices,
    largest_component,
    simplify,
    volume,
)
from r2c2r_core.model.mesh import TexturedMesh

_KEPT_FACES = 20_000
_REDUCED_FACES = 10_000  # of a mesh that must be unwrapped anew: the atlas of 20 000 takes seconds
_REMESH_CELLS = 80  # along the longest side
_SHELL_CELLS = 0.75  # half the thickness a leaking sheet is given
_LEAST_FLATNESS = 1e-4  # shortest over longest side
_TEXTURE_PX = 1024
_COLOUR_SAMPLES = 200_000


class Mended(NamedTuple):
    """The mesh in an arbitrary frame and unit, and what was done to it; no note means it was taken as it is."""

    mesh: TexturedMesh
    notes: tuple[str, ...]


def mended(parts: list[MeshPart], label: str, rng: np.random.Generator) -> Mended:
    """The parts as one closed textured mesh; raises OverrideError, naming `label`, for what no repair can save.

    A closed mesh with one texture keeps both. Anything else is closed, and its colours are carried over to a new texture.
    """
    vertices, faces = join_vertices(*_joined(parts))
    _check_sane(label, vertices, faces)
    notes: list[str] = []
    if len(parts) == 1 and parts[0].keeps_its_texture and len(faces) <= _KEPT_FACES and _is_solid(vertices, faces):
        mesh = _with_own_texture(parts[0], notes, rng)
    else:
        vertices, faces = _closed(label, vertices, faces, notes)
        mesh = _recoloured(vertices, faces, parts, rng)
    return Mended(mesh, tuple(notes))


def _joined(parts: list[MeshPart]) -> tuple[Points, Faces]:
    """All parts as one list of faces."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return np.concatenate([part.vertices for part in parts]), np.concatenate(faces)


def _check_sane(label: str, vertices: Points, faces: Faces) -> None:
    """Raise OverrideError for what no repair can turn into a solid."""
    if len(faces) < 4:
        raise OverrideError(f"{label}: {len(faces)} triangles, at least 4 expected", hint="export it again as triangles")
    sides = np.ptp(vertices[np.unique(faces)], axis=0)
    if sides.max() <= 0 or sides.min() < _LEAST_FLATNESS * sides.max():
        size = " x ".join(f"{side:.3g}" for side in sides)
        raise OverrideError(f"{label}: the mesh is flat ({size}), a body with a volume expected", hint="give it thickness")


def _is_solid(vertices: Points, faces: Faces) -> bool:
    return is_watertight(vertices, faces) and is_manifold(vertices, faces)


def _with_own_texture(part: MeshPart, notes: list[str], rng: np.random.Generator) -> TexturedMesh:
    """A closed part as it is, wound outwards."""
    assert part.uv is not None
    assert part.texture is not None
    faces = part.faces
    if volume(part.vertices, faces) < 0:
        faces = faces[:, ::-1]
        notes.append("its faces pointed inwards and were turned round")
    unique, inverse = np.unique(part.vertices, axis=0, return_inverse=True)
    return unposed(unique, inverse.reshape(-1), faces, part.uv, part.texture, rng)


def _closed(label: str, vertices: Points, faces: Faces, notes: list[str]) -> tuple[Points, Faces]:
    """A closed, outward mesh within the face limit; notes what was done."""
    size = float(np.ptp(vertices, axis=0).max())
    if not _is_solid(vertices, faces):
        patched = _patched(vertices, faces)
        if patched is not None:
            vertices, faces = patched
            notes.append("it was not closed: small holes were filled and its faces turned the same way")
        else:
            vertices, faces = _remeshed(label, vertices, faces)
            notes.append(
                f"it was not a closed body: remeshed, details finer than {100 / _REMESH_CELLS:.1f} % of its size are lost"
            )
    if volume(vertices, faces) < 0:
        faces = faces[:, ::-1]
        notes.append("its faces pointed inwards and were turned round")
    if len(faces) > _KEPT_FACES:
        count = len(faces)
        vertices, faces = simplify(vertices, faces, 1e-4 * size, _REDUCED_FACES)
        notes.append(f"simplified from {count} to {len(faces)} triangles")
    return vertices, faces


def _patched(vertices: Points, faces: Faces) -> tuple[Points, Faces] | None:
    """Holes filled and winding made consistent; None when that does not close it."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=True)
    mesh.update_faces(mesh.unique_faces())
    trimesh.repair.fix_normals(mesh)
    trimesh.repair.fill_holes(mesh)
    trimesh.repair.fix_normals(mesh)
    fixed = join_vertices(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))
    return fixed if _is_solid(*fixed) else None


def _remeshed(label: str, vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """The outer boundary on a grid: everything that air from outside cannot reach is solid; sheets get a thickness."""
    from scipy import ndimage
    from skimage.measure import marching_cubes

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    cell = float((high - low).max()) / _REMESH_CELLS
    counts = np.ceil((high - low) / cell).astype(int) + 6
    start = low - 2.5 * cell
    axes = [start[k] + np.arange(counts[k]) * cell for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = distances_to_mesh(grid.reshape(-1, 3), vertices, faces).reshape(grid.shape[:3]) / cell
    labels, _ = ndimage.label(distance > _SHELL_CELLS)
    inside = (labels != labels[0, 0, 0]) & (labels > 0)
    field = np.where(inside, -1.0, distance - _SHELL_CELLS)
    points, cubes, _, _ = marching_cubes(ndimage.gaussian_filter(field, 0.6), 0.0)
    closed, cubes = largest_component(start + points.astype(np.float64) * cell, cubes.astype(np.int64))
    closed, cubes = join_vertices(closed, cubes if volume(closed, cubes) > 0 else cubes[:, ::-1])
    if not _is_solid(closed, cubes):
        raise OverrideError(f"{label}: the mesh could not be closed", hint="close it in a mesh editor")
    return simplify(closed, cubes, 0.1 * cell, _REDUCED_FACES)


def _recoloured(vertices: Points, faces: Faces, parts: list[MeshPart], rng: np.random.Generator) -> TexturedMesh:
    """A new texture for a changed surface: each texel takes the nearest colour of the original."""
    from scipy.spatial import cKDTree

    atlas = unwrapped_atlas(vertices, faces, _TEXTURE_PX)
    points, colours = sample_colours(parts, _COLOUR_SAMPLES, rng)
    texture = np.zeros((*atlas.size, 3), np.uint8)
    texture[:] = np.median(colours, axis=0).astype(np.uint8)
    texture.reshape(-1, 3)[atlas.texel] = colours[cKDTree(points).query(atlas.points)[1]]
    return unposed(vertices, atlas.source, atlas.faces, atlas.uv, texture, rng)
