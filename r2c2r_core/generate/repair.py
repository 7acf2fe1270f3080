"""Mesh repair: any triangles to a closed, outward, textured mesh, with a note of every step for a person."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.errors import OverrideError
from r2c2r_core.generate.charts import unwrapped_atlas
from r2c2r_core.generate.meshfile import MeshPart, colours_at
from r2c2r_core.geometry.meshes import (
    Surface,
    closest_on_mesh,
    compact,
    distances_to_mesh,
    is_manifold,
    is_watertight,
    join_vertices,
    simplify,
    unite,
    vertex_normals,
    volume,
)
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.tuning import param, tuned

_LEAST_SIZE, _MOST_SIZE = 1e-9, 1e9  # in the file's own unit: volumes and squared distances stay within double precision


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of mesh repair."""

    kept_faces: int = param(20_000, "count", "Maximum number of triangles of a mesh that is kept unchanged")
    reduced_faces: int = param(
        10_000,
        "count",
        "Maximum number of triangles of a mesh that must be unwrapped again",
        source="the atlas of 20 000 takes seconds",
    )
    remesh_cells: int = param(
        80, "count", "Number of grid cells along the longest side when a mesh is remeshed to close it", ge=8
    )
    shell_ratio: float = param(0.75, "ratio", "Half the thickness given to an open sheet, in grid cells")
    least_flatness: float = param(1e-4, "ratio", "Minimum ratio of the shortest to the longest side of a mesh with a volume")
    texture_px: int = param(1024, "px", "Side of a new texture", ge=16)
    largest_px: int = param(2048, "px", "Maximum side of a texture that is kept", ge=16)
    crumb: float = param(0.01, "ratio", "Maximum size of a loose piece, relative to the largest body's diagonal, to be dropped")


class Mended(NamedTuple):
    """The mesh in the frame and unit of its parts, and notes on its repair; without notes it is unchanged."""

    mesh: TexturedMesh
    notes: tuple[str, ...]


def mended(parts: list[MeshPart], label: str) -> Mended:
    """The parts as one closed textured mesh; raises OverrideError, naming `label`, for what cannot be repaired.

    Closed bodies with one texture keep both. Anything else is closed, and its colours are transferred to a new texture.
    """
    vertices, faces = join_vertices(*_stacked([(part.vertices, part.faces) for part in parts]))
    _check_sane(label, vertices, faces)
    try:
        return _closed_and_coloured(parts, label, vertices, faces)
    except (ValueError, ArithmeticError, LookupError) as error:  # raised by the libraries on unusual shapes
        raise OverrideError(f"{label}: the mesh cannot be repaired ({error})", hint="close it in a mesh editor") from error


def _closed_and_coloured(parts: list[MeshPart], label: str, vertices: Points, faces: Faces) -> Mended:
    notes = ["it has no colours: shown grey"] if all(part.is_plain for part in parts) else []
    faces = _once_each(faces, notes)
    bodies = _bodies(vertices, faces, notes)
    if _keeps_its_skin(parts, bodies):
        return Mended(_with_own_texture(parts[0], notes), tuple(notes))
    vertices, faces = _closed(label, bodies, notes)
    return Mended(_recoloured(vertices, faces, parts), tuple(notes))


def _once_each(faces: Faces, notes: list[str]) -> Faces:
    """The faces without duplicates, regardless of winding."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    if len(first) < len(faces):
        notes.append(f"{len(faces) - len(first)} duplicate faces were dropped")
    return faces[np.sort(first)]


def _bodies(vertices: Points, faces: Faces, notes: list[str]) -> list[Surface]:
    """Connected components over edges with two faces, largest first, without tiny pieces."""
    params = tuned(Params)
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(faces))
    pieces = [compact(vertices, faces[labels == label]) for label in np.unique(labels)]
    sizes = np.array([np.linalg.norm(np.ptp(piece[0], axis=0)) for piece in pieces])
    kept = [pieces[k] for k in np.argsort(-sizes) if sizes[k] > params.crumb * sizes.max()]
    if len(kept) < len(pieces):
        notes.append(f"{len(pieces) - len(kept)} fragments smaller than {100 * params.crumb:.0f} % of it were dropped")
    return kept


def _keeps_its_skin(parts: list[MeshPart], bodies: list[Surface]) -> bool:
    """Whether the mesh can be kept unchanged except for its winding: closed, disjoint bodies with one usable texture."""
    count = len(parts[0].faces)
    if len(parts) != 1 or not parts[0].keeps_its_texture or count > tuned(Params).kept_faces:
        return False
    if sum(len(body[1]) for body in bodies) != count or not all(_is_solid(*body) for body in bodies):
        return False
    volumes = np.array([volume(*body) for body in bodies])
    if not (np.all(volumes > 0) or np.all(volumes < 0)):
        return False
    together = volume(*unite([_outward(body) for body in bodies]))
    return bool(abs(together - np.abs(volumes).sum()) < 1e-6 * together)


def _outward(body: Surface) -> Surface:
    return body if volume(*body) > 0 else (body[0], body[1][:, ::-1])


def _check_sane(label: str, vertices: Points, faces: Faces) -> None:
    """Raise OverrideError for input that cannot be repaired into a solid."""
    if len(faces) < 4:
        raise OverrideError(f"{label}: {len(faces)} triangles, at least 4 expected", hint="export it again as triangles")
    sides = np.ptp(vertices[np.unique(faces)], axis=0)
    if not _LEAST_SIZE < sides.max() < _MOST_SIZE:
        found = f"the mesh is {sides.max():.3g} units long, {_LEAST_SIZE:g} to {_MOST_SIZE:g} expected"
        raise OverrideError(f"{label}: {found}", hint="export it in metres")
    if sides.min() < tuned(Params).least_flatness * sides.max():
        size = " x ".join(f"{side:.3g}" for side in sides)
        raise OverrideError(f"{label}: the mesh is flat ({size}), a body with a volume expected", hint="give it thickness")


def _is_solid(vertices: Points, faces: Faces) -> bool:
    return is_watertight(vertices, faces) and is_manifold(vertices, faces)


def _with_own_texture(part: MeshPart, notes: list[str]) -> TexturedMesh:
    """A closed part unchanged, but wound outwards and its texture reduced to the size limit."""
    params = tuned(Params)
    assert part.uv is not None
    assert part.texture is not None
    faces, texture = part.faces, part.texture
    if volume(part.vertices, faces) < 0:
        faces = faces[:, ::-1]
        notes.append("its faces pointed inwards and were turned round")
    if max(texture.shape[:2]) > params.largest_px:
        scale = params.largest_px / max(texture.shape[:2])
        texture = np.asarray(cv2.resize(texture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        notes.append(f"its texture was reduced to {texture.shape[1]} x {texture.shape[0]} pixels")
    used, faces = np.unique(faces, return_inverse=True)  # an unused vertex would enlarge the mesh's extent
    return TexturedMesh(vertices=part.vertices[used], faces=faces.reshape(-1, 3), uv=part.uv[used], texture=texture)


def _closed(label: str, bodies: list[Surface], notes: list[str]) -> Surface:
    """One closed, outward surface within the face limit; appends notes on the repair."""
    params = tuned(Params)
    vertices, faces = _solid_union(bodies, notes) or _remeshed(label, bodies, notes)
    if len(faces) > params.kept_faces:
        count, size = len(faces), float(np.ptp(vertices, axis=0).max())
        vertices, faces = simplify(vertices, faces, 1e-4 * size, params.reduced_faces)
        notes.append(f"simplified from {count} to {len(faces)} triangles")
    return vertices, faces


def _solid_union(bodies: list[Surface], notes: list[str]) -> Surface | None:
    """Union of all bodies; None if one of them cannot be closed by filling small holes."""
    solids, patched = [], 0
    for body in bodies:
        mended_body = body if _is_solid(*body) else _patched(*body)
        if mended_body is None:
            return None
        patched += mended_body is not body
        solids.append(mended_body)
    inward = sum(volume(*body) < 0 for body in solids)
    if patched:
        notes.append("it was not closed: small holes were filled and its faces oriented consistently")
    if inward == len(solids):
        notes.append("its faces pointed inwards and were turned round")
    if len(solids) == 1:
        return _outward(solids[0])
    union = unite([_outward(body) for body in solids])
    notes.append(f"its {len(solids)} bodies were united; inner surfaces were removed")
    return union if _is_solid(*union) else None


def _patched(vertices: Points, faces: Faces) -> tuple[Points, Faces] | None:
    """The mesh with holes filled and winding made consistent; None if that does not close it."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=True)
    mesh.update_faces(mesh.unique_faces())
    trimesh.repair.fix_normals(mesh)
    trimesh.repair.fill_holes(mesh)
    trimesh.repair.fix_normals(mesh)
    fixed = join_vertices(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))
    return fixed if _is_solid(*fixed) else None


def _remeshed(label: str, bodies: list[Surface], notes: list[str]) -> Surface:
    """Outer boundary on a grid: all space unreachable from outside is solid; sheets get a thickness."""
    params = tuned(Params)
    from scipy import ndimage
    from skimage.measure import marching_cubes

    vertices, faces = _stacked(bodies)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    cell = float((high - low).max()) / params.remesh_cells
    counts = np.ceil((high - low) / cell).astype(int) + 6
    start = low - 2.5 * cell
    axes = [start[k] + np.arange(counts[k]) * cell for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = distances_to_mesh(grid.reshape(-1, 3), vertices, faces).reshape(grid.shape[:3]) / cell
    labels, _ = ndimage.label(distance > params.shell_ratio)
    inside = (labels != labels[0, 0, 0]) & (labels > 0)
    field = np.where(inside, -1.0, distance - params.shell_ratio)
    points, cubes, _, _ = marching_cubes(ndimage.gaussian_filter(field, 0.6), 0.0)
    closed, cubes = join_vertices(points.astype(np.float64), cubes.astype(np.int64))
    if volume(closed, cubes) < 0:
        cubes = cubes[:, ::-1]
    tight = _tightened(start + closed * cell, cubes, inside, start, cell, (vertices, faces))
    if not _is_solid(tight, cubes):
        raise OverrideError(f"{label}: the mesh could not be closed", hint="close it in a mesh editor")
    notes.append(
        f"it was not a closed body: remeshed, details finer than {100 / params.remesh_cells:.1f} % of its size are lost"
    )
    return simplify(tight, cubes, 0.1 * cell, params.reduced_faces)


def _tightened(vertices: Points, faces: Faces, inside: np.ndarray, start: np.ndarray, cell: float, original: Surface) -> Points:
    """The grid's surface projected onto the original one except at sheets, which would lose their volume."""
    inward = vertices - 2.0 * cell * vertex_normals(vertices, faces)
    index = np.clip(np.round((inward - start) / cell).astype(int), 0, np.array(inside.shape) - 1)
    thick = inside[tuple(index.T)]
    nearest, _ = closest_on_mesh(vertices, *original)
    near = np.linalg.norm(nearest - vertices, axis=1) < 1.5 * cell
    moved = np.where((thick & near)[:, None], nearest, vertices)
    return moved if _is_solid(moved, faces) else vertices


def _stacked(bodies: list[Surface]) -> Surface:
    """All bodies concatenated into one mesh."""
    starts = np.cumsum([0, *(len(body[0]) for body in bodies)])
    faces = [body[1] + start for body, start in zip(bodies, starts, strict=False)]
    return np.concatenate([body[0] for body in bodies]), np.concatenate(faces)


def _recoloured(vertices: Points, faces: Faces, parts: list[MeshPart]) -> TexturedMesh:
    """The changed surface with a new texture: each texel takes the nearest colour of the original."""
    atlas = unwrapped_atlas(vertices, faces, tuned(Params).texture_px)
    colours = colours_at(parts, atlas.points)
    texture = np.zeros((*atlas.size, 3), np.uint8)
    texture[:] = np.median(colours, axis=0).astype(np.uint8)
    texture.reshape(-1, 3)[atlas.texel] = colours
    return TexturedMesh(vertices=vertices[atlas.source], faces=atlas.faces, uv=atlas.uv, texture=texture)
