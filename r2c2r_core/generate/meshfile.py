"""Reader of mesh files (GLB, OBJ, PLY, STL) into plain parts with their colours."""

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from r2c2r_core.arrays import Colours, Faces, Image, Points, TextureCoords
from r2c2r_core.errors import OverrideError
from r2c2r_core.geometry.meshes import closest_on_mesh
from r2c2r_core.geometry.texels import texture_colours

SUFFIXES = (".glb", ".obj", ".ply", ".stl")

MOST_BYTES = 300_000_000
_MOST_FACES = 2_000_000
_PLAIN = 160  # grey of a mesh without colours


class MeshPart(NamedTuple):
    """One geometry of a file, in the file's frame and unit."""

    vertices: Points
    faces: Faces
    uv: TextureCoords | None  # v = 0 is the bottom row
    texture: Image | None
    vertex_colours: Colours  # used where there is no texture
    is_plain: bool = False  # the file gives it no colour of any kind

    @property
    def keeps_its_texture(self) -> bool:
        """Whether uv and texture can be used unchanged: no tiling beyond 0..1."""
        return self.uv is not None and self.texture is not None and bool((self.uv > -1e-3).all() and (self.uv < 1.001).all())


def read_parts(path: Path) -> list[MeshPart]:
    """The file's geometries with their transforms applied; raises OverrideError when it cannot be read."""
    import trimesh

    if path.suffix.lower() not in SUFFIXES:
        raise OverrideError(f"{path.name}: a mesh file expected", hint=f"give one of {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise OverrideError(f"{path}: no such file", hint="check the path of the uploaded mesh")
    if path.stat().st_size > MOST_BYTES:
        raise OverrideError(
            f"{path.name}: {path.stat().st_size // 1_000_000} MB, at most {MOST_BYTES // 1_000_000} MB expected"
        )
    try:
        geometries = _triangles(trimesh.load_scene(path))
    # the parsers behind trimesh raise arbitrary exceptions on corrupt files
    except Exception as error:
        raise OverrideError(
            f"{path.name}: not a readable {path.suffix[1:].upper()} mesh ({error})", hint="export it again"
        ) from error
    _check_geometries(path.name, geometries)
    return parts_of(geometries)


def missing_files(path: Path) -> tuple[str, ...]:
    """Files referenced by a mesh file but missing beside it: an OBJ's materials and textures, a GLB's textures."""
    named: list[str] = []
    if path.suffix.lower() == ".obj":
        libraries = _named_in(path, ("mtllib",))
        found = [library for name in libraries if (library := _beside(path, name)) is not None]
        named = [*libraries, *(name for library in found for name in _named_in(library, ("map_Kd",)))]
    elif path.suffix.lower() == ".glb":
        named = _glb_pictures(path)
    return tuple(dict.fromkeys(name for name in named if _beside(path, name) is None))


def _beside(path: Path, name: str) -> Path | None:
    """The file of that name in the mesh file's folder or below it; None also where the path leads outside."""
    folder = path.parent.resolve()
    try:
        found = (folder / name).resolve()
        return found if found.is_relative_to(folder) and found.is_file() else None
    except (OSError, ValueError):  # not a valid file name
        return None


def _named_in(path: Path, keywords: tuple[str, ...]) -> list[str]:
    """File names after the keywords of an OBJ or MTL file; options such as `-o 0 0 0` precede the name."""
    try:
        with path.open(errors="replace") as lines:
            words = [line.split() for line in lines if line.lstrip().startswith(keywords)]
    except OSError:
        return []
    return [line[-1].replace("\\", "/") for line in words if len(line) > 1]


def _glb_pictures(path: Path) -> list[str]:
    """External image files that a binary glTF references."""
    with path.open("rb") as handle:
        head = handle.read(20)
        chunk = handle.read(min(int.from_bytes(head[12:16], "little"), MOST_BYTES))
    try:
        images = json.loads(chunk).get("images", [])
        return [unquote(image["uri"]) for image in images if not image.get("uri", "data:").startswith("data:")]
    except (ValueError, AttributeError, TypeError, RecursionError):
        return []


def parts_of_glb(content: bytes, label: str) -> list[MeshPart]:
    """The geometries of a binary glTF in memory; raises OverrideError, naming `label`, when it cannot be read."""
    import trimesh

    try:
        geometries = _triangles(trimesh.load_scene(io.BytesIO(content), file_type="glb"))
    except Exception as error:  # as in read_parts
        raise OverrideError(f"{label}: not a readable GLB mesh ({error})") from error
    _check_geometries(label, geometries)
    return parts_of(geometries)


def parts_of(geometries: Sequence[Any]) -> list[MeshPart]:
    """Trimesh geometries as plain parts."""
    return [_part(geometry) for geometry in geometries]


def _triangles(scene: Any) -> list[Any]:
    """Every geometry with faces, with its transform applied."""
    import trimesh

    return [g for g in scene.dump() if isinstance(g, trimesh.Trimesh) and len(g.faces)]


def _check_geometries(label: str, geometries: Sequence[Any]) -> None:
    if not geometries:
        raise OverrideError(f"{label}: no triangles found", hint="export the mesh with faces")
    if not all(g.vertices.ndim == 2 and g.vertices.shape[1] == 3 for g in geometries):  # an OBJ may state two numbers
        raise OverrideError(f"{label}: vertices that are not three numbers", hint="export it again")
    count = sum(len(g.faces) for g in geometries)
    if count > _MOST_FACES:
        raise OverrideError(f"{label}: {count} triangles, at most {_MOST_FACES} expected", hint="simplify the mesh first")
    if not all(g.faces.min() >= 0 and g.faces.max() < len(g.vertices) for g in geometries):
        raise OverrideError(f"{label}: triangles refer to missing vertices", hint="export it again")
    if not all(np.isfinite(g.vertices).all() for g in geometries):
        raise OverrideError(f"{label}: vertices that are not numbers", hint="export it again")


def colours_at(parts: list[MeshPart], points: Points) -> Colours:
    """Colour of the surface nearest to each point."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)])
    nearest, face = closest_on_mesh(points, vertices, faces)
    first_faces = np.cumsum([0, *(len(part.faces) for part in parts)])
    owner = np.searchsorted(first_faces, face, side="right") - 1
    colours = np.zeros((len(points), 3), np.uint8)
    for k, part in enumerate(parts):
        own = owner == k
        if own.any():
            colours[own] = _part_colours(part, nearest[own], face[own] - first_faces[k])
    return colours


def _part_colours(part: MeshPart, points: Points, face: np.ndarray) -> Colours:
    corners = part.vertices[part.faces[face]]
    weights = _barycentric(points, corners)
    if part.uv is not None and part.texture is not None:
        uv = (part.uv[part.faces[face]] * weights[..., None]).sum(axis=1) % 1.0
        return texture_colours(part.texture, uv)
    blended = (part.vertex_colours[part.faces[face]] * weights[..., None]).sum(axis=1)
    return np.asarray(np.round(blended).clip(0, 255).astype(np.uint8))


def _barycentric(points: Points, corners: np.ndarray) -> np.ndarray:
    """Barycentric weights (n, 3) of points in their triangles (n, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    square = np.maximum((normal**2).sum(axis=1), 1e-300)
    wa = (np.cross(c - b, points - b) * normal).sum(axis=1) / square
    wb = (np.cross(a - c, points - c) * normal).sum(axis=1) / square
    return np.stack([wa, wb, 1.0 - wa - wb], axis=1)


def _part(geometry: Any) -> MeshPart:
    """A trimesh geometry as arrays."""
    vertices = np.asarray(geometry.vertices, dtype=np.float64)
    texture = _texture(geometry)
    uv = getattr(geometry.visual, "uv", None)
    has_picture = texture is not None and uv is not None and len(uv) == len(vertices)
    return MeshPart(
        vertices=vertices,
        faces=np.asarray(geometry.faces, dtype=np.int64),
        uv=np.asarray(uv, dtype=np.float64) if has_picture else None,
        texture=texture if has_picture else None,
        vertex_colours=_vertex_colours(geometry, len(vertices)),
        is_plain=not has_picture and _is_plain(geometry.visual),
    )


def _texture(geometry: Any) -> Image | None:
    material = getattr(geometry.visual, "material", None)
    picture = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    return None if picture is None else np.asarray(picture.convert("RGB"), dtype=np.uint8)


def _is_plain(visual: Any) -> bool:
    """Whether neither vertices, faces nor the material have a colour."""
    from trimesh.visual.color import DEFAULT_COLOR

    if visual.kind in ("vertex", "face"):
        return False
    main = getattr(getattr(visual, "material", None), "main_color", None)
    return main is None or np.array_equal(np.asarray(main), DEFAULT_COLOR)


def _vertex_colours(geometry: Any, count: int) -> Colours:
    """Vertex colours, else the material's colour, else grey."""
    plain = np.full((count, 3), _PLAIN, np.uint8)
    visual = geometry.visual
    if visual.kind == "vertex" or visual.kind == "face":
        return np.asarray(visual.to_color().vertex_colors if visual.kind == "face" else visual.vertex_colors)[:, :3].astype(
            np.uint8
        )
    main = getattr(getattr(visual, "material", None), "main_color", None)
    if main is not None and visual.kind == "texture":
        plain[:] = np.asarray(main)[:3]
    return plain
