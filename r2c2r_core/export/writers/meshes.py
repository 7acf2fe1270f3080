"""Mesh files: OBJ + MTL + PNG for visuals (the only textured format every loader reads), plain OBJ for convex pieces."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Image, Points
from r2c2r_core.errors import ExportFailed
from r2c2r_core.export.plan import Body
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.model.mesh import TexturedMesh

MOST_HULL_VERTICES = 64
"""Of a collider: engines on GPUs bound them (MuJoCo Warp's narrow phase halves its time at 64)."""
MOST_COPLANAR = 20
"""Of a collider's vertices: MJX and Brax warn of more."""
_IN_PLANE_M = 1e-5


def write_body(body: Body, folder: Path, texture_max_px: int) -> None:
    """Write the meshes of one body under `folder`, with basenames unique in the bundle and scale applied.

    Raises ExportFailed on a collider that no engine can use.
    """
    if body.visual_file is not None or body.collision_files:
        (folder / body.folder).mkdir(parents=True, exist_ok=True)
    if body.link.visual is not None and body.visual_file is not None and body.texture_file is not None:
        _write_visual(folder / body.visual_file, body.link.visual, Path(body.texture_file).name)
        texture = folder / body.texture_file
        if not texture.exists():
            texture.write_bytes(png_bytes(_bounded(body.link.visual.texture, texture_max_px)))
    for piece, name in zip(body.link.pieces, body.collision_files, strict=True):
        vertices, faces = convex_hull(piece.vertices_link, f"{body.name}: collider {piece.name}")
        (folder / name).write_text(_obj_lines(vertices, faces))


def convex_hull(points: Points, where: str) -> tuple[Points, Faces]:
    """Vertices and outward faces of the convex hull, with at most MOST_HULL_VERTICES and MOST_COPLANAR in one plane.

    The flattest vertices are removed first.

    Raises ExportFailed on flat points, which no engine can use.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
        while (left := _left_out(hull)) is not None:
            hull = ConvexHull(hull.points[hull.vertices[hull.vertices != left]])
    except (QhullError, ValueError) as error:
        raise ExportFailed(f"{where} is flat or empty ({len(points)} points)", hint="give it a thickness") from error
    corner_of = {int(v): k for k, v in enumerate(hull.vertices)}
    vertices = hull.points[hull.vertices]
    faces = np.array([[corner_of[int(v)] for v in simplex] for simplex in hull.simplices])
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces


def coplanar(points: Points, planes: np.ndarray) -> np.ndarray:
    """Mask (n,) of the points in the hull plane with most points; planes (m, 4) as given by qhull."""
    within = np.abs(points @ planes[:, :3].T + planes[:, 3]) < _IN_PLANE_M
    return np.asarray(within[:, np.argmax(within.sum(axis=0))])


def _left_out(hull: Any) -> int | None:
    """The flattest vertex if there are too many in total or in one plane; else None."""
    crowd = np.ones(len(hull.vertices), dtype=bool)
    if len(hull.vertices) <= MOST_HULL_VERTICES:
        crowd = coplanar(hull.points[hull.vertices], hull.equations)
        if crowd.sum() <= MOST_COPLANAR:
            return None
    return int(hull.vertices[np.argmin(np.where(crowd, _sharpness(hull), np.inf))])


def _sharpness(hull: Any) -> np.ndarray:
    """Sharpness of each hull vertex: deviation of its corner from flat (rad) times the adjacent area."""
    missing, area = np.full(len(hull.points), 2 * np.pi), np.zeros(len(hull.points))
    corners = hull.points[hull.simplices]
    for k in range(3):
        a, b = (corners[:, (k + step) % 3] - corners[:, k] for step in (1, 2))
        cross = np.linalg.norm(np.cross(a, b), axis=1)
        np.subtract.at(missing, hull.simplices[:, k], np.arctan2(cross, np.einsum("ij,ij->i", a, b)))
        np.add.at(area, hull.simplices[:, k], cross / 2)
    return np.asarray((missing * area)[hull.vertices])


def boxes_mesh(body: Body) -> tuple[Points, Faces]:
    """All boxes of a body as one triangle mesh in the body's frame."""
    vertices, faces = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)]
    for number, box in enumerate(body.link.boxes):
        corners, triangles = box_mesh(-box.size_m / 2, box.size_m / 2)
        vertices.append(box.link_from_box.apply(corners))
        faces.append(triangles + len(corners) * number)
    return np.concatenate(vertices), np.concatenate(faces)


def png_bytes(image: Image) -> bytes:
    """An RGB image as PNG with run-length encoding, which is fast and sufficient for filtered photos."""
    how = [cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]
    _, encoded = cv2.imencode(".png", image[..., ::-1], how)
    return encoded.tobytes()


def _write_visual(path: Path, mesh: TexturedMesh, texture_name: str) -> None:
    material = path.stem
    head = f"mtllib {path.stem}.mtl\n"
    path.write_text(head + _obj_lines(mesh.vertices, mesh.faces, mesh.uv, material))
    path.with_suffix(".mtl").write_text(
        f"newmtl {material}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nd 1\nillum 1\nmap_Kd {texture_name}\n"
    )


def _obj_lines(vertices: Points, faces: Faces, uv: np.ndarray | None = None, material: str = "") -> str:
    lines = _rows("v %.6f %.6f %.6f", vertices)
    if uv is not None:
        lines += _rows("vt %.6f %.6f", uv)
        lines.append(f"usemtl {material}")
        lines += ["f %d/%d %d/%d %d/%d" % (a, a, b, b, c, c) for a, b, c in (faces + 1).tolist()]  # noqa: UP031  (fast)
    else:
        lines += _rows("f %d %d %d", faces + 1)
    return "\n".join(lines) + "\n"


def _rows(pattern: str, values: np.ndarray) -> list[str]:
    tidy = np.round(values, 6) + 0.0  # no negative zeros
    return [pattern % tuple(row) for row in tidy.tolist()]


def _bounded(texture: Image, longest_px: int) -> Image:
    height, width = texture.shape[:2]
    if max(height, width) <= longest_px:
        return texture
    factor = longest_px / max(height, width)
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    return np.asarray(cv2.resize(texture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
