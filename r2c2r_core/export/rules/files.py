"""Files of a bundle for the rules: safe paths, and cached meshes."""

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.disk import is_below


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjMesh:
    """Content of an OBJ or STL file relevant to the rules."""

    vertices: Points
    faces: Faces
    parts: int  # `o` or `g` groups that hold faces
    libraries: tuple[str, ...]  # mtllib names


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BundleFiles:
    """The folder of a bundle; meshes are parsed once."""

    folder: Path
    _meshes: dict[str, ObjMesh | None] = field(default_factory=dict)

    def path(self, reference: str) -> Path | None:
        """The file of a relative reference, or None when it leaves the bundle or is not a plain path."""
        if not is_inside(reference):
            return None
        path = self.folder / reference
        return path if is_below(path, self.folder) else None

    def mesh(self, reference: str) -> ObjMesh | None:
        """The mesh, or None when it is absent, outside, of another format, or damaged."""
        if reference not in self._meshes:
            path = self.path(reference)
            self._meshes[reference] = read_mesh(path) if path is not None and path.is_file() else None
        return self._meshes[reference]


def is_inside(reference: str) -> bool:
    """Whether a reference is a plain relative path that stays inside its folder."""
    parts = PurePosixPath(reference).parts
    return bool(parts) and ":" not in reference and "\\" not in reference and parts[0] != "/" and ".." not in parts


def read_mesh(path: Path) -> ObjMesh | None:
    """Mesh of an OBJ or STL file; None when it has no triangle or cannot be read."""
    try:
        return _read_obj(path) if path.suffix.lower() == ".obj" else _read_stl(path)
    except (ValueError, OverflowError, IndexError, OSError, KeyError, TypeError):  # a face may name vertex 10^30
        return None


def _read_obj(path: Path) -> ObjMesh | None:
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    libraries: list[str] = []
    parts, open_part = 0, True
    for line in path.read_text(errors="replace").splitlines():
        key, _, rest = line.strip().partition(" ")
        if key == "v":
            vertices.append([float(word) for word in rest.split()[:3]])
        elif key == "f":
            parts, open_part = parts + open_part, False
            corners = [int(word.split("/")[0]) for word in rest.split()]
            corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
        elif key in ("o", "g"):
            open_part = True
        elif key == "mtllib":
            libraries.append(rest.strip())
    return _checked(np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64), parts, tuple(libraries))


def _read_stl(path: Path) -> ObjMesh | None:
    import trimesh

    if path.suffix.lower() != ".stl":
        return None
    mesh = trimesh.load(path, force="mesh")
    return _checked(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64), 1, ())


def _checked(vertices: np.ndarray, faces: np.ndarray, parts: int, libraries: tuple[str, ...]) -> ObjMesh | None:
    if not len(vertices) or not len(faces) or not np.isfinite(vertices).all():
        return None
    if faces.min() < 0 or faces.max() >= len(vertices):
        return None
    return ObjMesh(vertices=vertices, faces=faces, parts=parts, libraries=libraries)
