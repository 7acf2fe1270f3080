"""Rules on mesh files: paths, content, and agreement of colliders with visuals."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import PurePosixPath

import numpy as np

from r2c2r_core.export.reading import MOVING, Urdf, UrdfLink, UrdfShape
from r2c2r_core.export.rules.files import BundleFiles, ObjMesh
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.writers.meshes import MOST_COPLANAR, MOST_HULL_VERTICES, coplanar
from r2c2r_core.model.report import Finding

_FLAT_M = 2e-4
_DENT_M, _DENT_SHARE = 1e-3, 0.01  # maximum depth of a vertex inside its hull: 1 mm, or 1 % of the size
_FILLED_SHARE = 0.97  # minimum fraction of the hull's volume


def check_meshes(urdf: Urdf, files: BundleFiles) -> Iterator[Finding]:
    """Check paths, formats, scales, textures, and convexity of colliders."""
    yield from _basenames(urdf)
    moving = {joint.child for joint in urdf.joints if joint.type in MOVING}
    for link in urdf.links:
        yield from _link_shapes(link, files)
        if link.name in moving and not any(shape.kind == "collision" for shape in link.shapes):
            yield finding("collider-missing", link.name, "it moves and has no <collision>")


def convexity_defect(mesh: ObjMesh) -> str | None:
    """Reason why a collision mesh is flat or concave, starting with the rule's last word; None when it is convex."""
    from scipy.spatial import ConvexHull, QhullError

    used = np.unique(mesh.faces)
    points = mesh.vertices[used]
    centred = points - points.mean(axis=0)
    thickness = float(np.ptp(centred @ np.linalg.svd(centred, full_matrices=False)[2][-1]))
    if thickness < _FLAT_M:
        return f"flat: {1000 * thickness:.2f} mm thick"
    try:
        hull = ConvexHull(points)
    except QhullError:
        return "flat: it has no hull"
    inside = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    dent = float(inside.max())
    if dent > max(_DENT_M, _DENT_SHARE * float(np.ptp(points, axis=0).max())):
        return f"concave: a vertex lies {1000 * dent:.1f} mm inside the hull"
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - points.mean(axis=0) for k in range(3))
    volume = abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6
    if _closed(mesh) and volume < _FILLED_SHARE * hull.volume:
        return f"concave: it fills {100 * volume / hull.volume:.0f} % of its hull"
    return None


def most_coplanar(mesh: ObjMesh) -> int:
    """Maximum number of vertices of a convex mesh in one plane of its hull."""
    from scipy.spatial import ConvexHull

    points = mesh.vertices[np.unique(mesh.faces)]
    return int(coplanar(points, ConvexHull(points).equations).sum())


def _closed(mesh: ObjMesh) -> bool:
    """Whether the mesh is closed: every edge, by position, is used equally often in both directions."""
    _, same = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    faces = same.ravel()[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = np.sort(edges @ [len(same), 1]), np.sort(edges[:, ::-1] @ [len(same), 1])
    return bool(np.array_equal(there, back))


def _basenames(urdf: Urdf) -> Iterator[Finding]:
    paths = defaultdict(set)
    for link in urdf.links:
        for shape in link.shapes:
            if shape.mesh:
                paths[PurePosixPath(shape.mesh).name].add(shape.mesh)
    for name, where in sorted(paths.items()):
        if len(where) > 1:
            yield finding("mesh-basename", name, f"{len(where)} files of this name: {', '.join(sorted(where))}")


def _link_shapes(link: UrdfLink, files: BundleFiles) -> Iterator[Finding]:
    for shape in link.shapes:
        if shape.box_m is not None and not (shape.box_m > 0).all() and not np.isnan(shape.box_m).any():
            yield finding("box-size", link.name, f"a box of {' x '.join(f'{v:.4g}' for v in shape.box_m)} m")
        if shape.mesh is not None:
            yield from _mesh_shape(link.name, shape, shape.mesh, files)


def _mesh_shape(where: str, shape: UrdfShape, reference: str, files: BundleFiles) -> Iterator[Finding]:
    if not np.allclose(shape.scale, 1.0):
        yield finding("mesh-scale", where, f"{reference}: scale {' '.join(f'{v:g}' for v in shape.scale)}")
    if " " in reference:
        yield finding("mesh-spaces", where, f"'{reference}'")
    path = files.path(reference)
    if path is None:
        yield finding("mesh-path", where, f"'{reference}' is not a path inside the bundle")
        return
    if path.suffix.lower() not in (".obj", ".stl"):
        yield finding("mesh-format", where, f"{reference}: use OBJ or STL")
        return
    if not path.is_file():
        yield finding("mesh-missing", where, reference)
        return
    mesh = files.mesh(reference)
    if mesh is None:
        yield finding("mesh-unreadable", where, f"{reference} holds no readable triangle")
        return
    size = float(np.ptp(mesh.vertices, axis=0).max() * np.abs(shape.scale).max())
    if not 1e-3 < size < 20.0:
        yield finding("mesh-size", where, f"{reference} is {size:.4g} m long")
    if shape.kind == "collision":
        yield from _collider(where, reference, mesh)
    else:
        yield from _textures(where, reference, mesh, files)


def _collider(where: str, reference: str, mesh: ObjMesh) -> Iterator[Finding]:
    if mesh.parts > 1:
        yield finding("collision-parts", where, f"{reference} holds {mesh.parts} parts; write one <collision> each")
        return
    defect = convexity_defect(mesh)
    if defect is not None:
        yield finding(f"collision-{defect.partition(':')[0]}", where, f"{reference} is {defect}")
    elif (corners := len(np.unique(mesh.faces))) > MOST_HULL_VERTICES:
        yield finding("collision-vertices", where, f"{reference} has {corners} vertices, {MOST_HULL_VERTICES} are allowed")
    elif (fan := most_coplanar(mesh)) > MOST_COPLANAR:
        yield finding("collision-coplanar", where, f"{reference} has {fan} vertices in one plane, {MOST_COPLANAR} are allowed")


def _textures(where: str, reference: str, mesh: ObjMesh, files: BundleFiles) -> Iterator[Finding]:
    folder = PurePosixPath(reference).parent
    for library in mesh.libraries:
        library_path = files.path(str(folder / library))
        if library_path is None:
            yield finding("mesh-path", where, f"{reference}: material '{library}' is not inside the bundle")
            continue
        if not library_path.is_file():
            yield finding("texture-missing", where, f"{reference}: {library} is not there")
            continue
        for line in library_path.read_text(errors="replace").splitlines():
            key, _, picture = line.strip().partition(" ")
            if key.lower() != "map_kd":
                continue
            picture_path = files.path(str(folder / picture.strip()))
            if picture_path is None:
                yield finding("mesh-path", where, f"{library}: picture '{picture}' is not inside the bundle")
            elif not picture_path.is_file():
                yield finding("texture-missing", where, f"{library}: {picture} is not there")
