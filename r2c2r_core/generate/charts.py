"""Texture atlases with the 3D point of every texel: six planar projections for furniture, xatlas charts for the rest."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Points, TextureCoords
from r2c2r_core.generate.unwrap import unwrap
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.meshes import face_normals, vertex_normals
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned

FRONT = 2  # chart of the faces that look along -Y
_PADDING_PX = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of texture layout."""

    largest_px: int = param(1536, "px", "Maximum long side of a planar chart", ge=16)


class Atlas(NamedTuple):
    """A UV-unwrapped mesh with the surface point of each texel."""

    source: np.ndarray  # (n,) the original vertex of each skin vertex
    faces: Faces  # of skin vertices
    uv: TextureCoords  # v = 0 is the bottom row
    size: tuple[int, int]  # texture rows, columns
    texel: np.ndarray  # (t,) flat pixel index of each covered texel
    points: Points  # (t, 3) surface point of each texel
    normals: Points  # (t, 3)
    chart: np.ndarray  # (t,) chart of each texel; for planar charts 2 * axis + (positive side), so FRONT is -Y


def planar_atlas(vertices: Points, faces: Faces, longest_px: int, finest_m: float) -> Atlas:
    """Six orthographic charts along ± the axes; the front (-Y) has full resolution, the others 0.4 of it.

    Faces of one direction that lie behind one another (a door behind its handle) share the texels of the outermost.
    """
    direction = _main_direction(face_normals(vertices, faces))
    spans = vertices.max(axis=0) - vertices.min(axis=0)
    fine = max(float(max(spans[0], spans[2])) / longest_px, finest_m)
    present = [k for k in range(6) if (direction == k).any()]
    charts = [_draw_chart(vertices, faces, direction, k, fine if k == FRONT else 2.5 * fine) for k in present]
    offsets, size = _shelves([chart.face_image.shape for chart in charts])
    source, skin_faces, uv, texel, points, normals, label = [], [], [], [], [], [], []
    count = 0
    for chart, (row, column) in zip(charts, offsets, strict=True):
        chosen = faces[direction == chart.direction]
        used, inverse = np.unique(chosen, return_inverse=True)
        pixel = chart.pixels(vertices[used]) + np.array([column, row])
        uv.append(np.column_stack([pixel[:, 0] / size[1], 1.0 - pixel[:, 1] / size[0]]))
        source.append(used)
        skin_faces.append(inverse.reshape(-1, 3) + count)
        count += len(used)
        rows, columns = np.indices(chart.face_image.shape)
        texel.append(((rows + row) * size[1] + columns + column).ravel())
        points.append(_texel_points(chart, vertices, faces))
        normals.append(face_normals(vertices, faces)[chart.face_image.ravel()])
        label.append(np.full(chart.face_image.size, chart.direction))
    return Atlas(
        np.concatenate(source),
        np.concatenate(skin_faces),
        np.concatenate(uv),
        size,
        np.concatenate(texel),
        np.concatenate(points),
        np.concatenate(normals),
        np.concatenate(label),
    )


def unwrapped_atlas(vertices: Points, faces: Faces, size_px: int) -> Atlas:
    """Atlas of xatlas charts on a square texture."""
    source, skin_faces, uv = unwrap(vertices, faces)
    uv = uv * (1.0 - 4.0 / size_px) + 2.0 / size_px
    points = _uv_raster(uv, skin_faces, vertices[source], size_px)
    normals = _uv_raster(uv, skin_faces, vertex_normals(vertices, faces)[source], size_px)
    covered = _uv_raster(uv, skin_faces, np.ones((len(uv), 3)), size_px)[..., 0] > 0.5
    texel = np.flatnonzero(covered)
    normal = normals.reshape(-1, 3)[texel]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return Atlas(
        source, skin_faces, uv, (size_px, size_px), texel, points.reshape(-1, 3)[texel], normal, np.full(len(texel), FRONT)
    )


class _Chart(NamedTuple):
    direction: int
    axes: list[int]  # horizontal, vertical axis of the chart
    corner: np.ndarray  # (2,) metres at the chart's top left corner, inside the padding; rows run downwards
    pitch_m: float
    face_image: np.ndarray  # outermost face per texel; the padding repeats the nearest

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Continuous (column, row) of points (..., 3)."""
        return np.asarray((points[..., self.axes] - self.corner) * [1.0, -1.0] / self.pitch_m + _PADDING_PX)


def _main_direction(normals: Points) -> np.ndarray:
    """Dominant axis direction of each face normal as 2 * axis + (positive side)."""
    axis = np.argmax(np.abs(normals), axis=1)
    return np.asarray(2 * axis + (normals[np.arange(len(normals)), axis] > 0))


def _draw_chart(vertices: Points, faces: Faces, direction: np.ndarray, k: int, pitch_m: float) -> _Chart:
    chosen = np.flatnonzero(direction == k)
    axis, sign = k // 2, 1.0 if k % 2 else -1.0
    axes = [a for a in range(3) if a != axis]
    flat = vertices[faces[chosen]][:, :, axes]
    low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
    pitch_m = max(pitch_m, float((high - low).max()) / tuned(Params).largest_px)
    width, height = (int(np.ceil(v)) + 2 * _PADDING_PX for v in (high - low) / pitch_m)
    chart = _Chart(k, axes, np.array([low[0], high[1]]), pitch_m, np.zeros((0, 0)))
    image = np.full((height, width), -1, np.float32)
    height_of = sign * vertices[faces[chosen]][:, :, axis].mean(axis=1)
    corners = np.round((chart.pixels(vertices[faces[chosen]]) - 0.5) * 256).astype(np.int32)
    for i in np.argsort(height_of, kind="stable"):
        cv2.fillConvexPoly(image, corners[i], float(chosen[i]), cv2.LINE_8, 8)
    empty = (image < 0).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(empty, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    face_of_label = np.zeros(int(nearest.max()) + 1, dtype=np.int64)
    face_of_label[nearest[empty == 0]] = image[empty == 0].astype(np.int64)
    return chart._replace(face_image=face_of_label[nearest])


def _texel_points(chart: _Chart, vertices: Points, faces: Faces) -> Points:
    """Point of each texel on the plane of its face."""
    rows, columns = np.indices(chart.face_image.shape)
    flat = np.stack([columns, rows], axis=-1).reshape(-1, 2) + 0.5
    face = chart.face_image.ravel()
    points = np.zeros((len(face), 3))
    points[:, chart.axes] = chart.corner + (flat - _PADDING_PX) * chart.pitch_m * [1.0, -1.0]
    axis = chart.direction // 2
    normal, corner = face_normals(vertices, faces)[face], vertices[faces[face, 0]]
    across = ((points - corner)[:, chart.axes] * normal[:, chart.axes]).sum(axis=1)
    points[:, axis] = corner[:, axis] - across / normal[:, axis]
    return points


def _shelves(shapes: list[tuple[int, ...]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Shelf packing: row and column of each chart, tallest first, and the size of the roughly square atlas."""
    width = max(max(shape[1] for shape in shapes), int(np.sqrt(sum(shape[0] * shape[1] for shape in shapes)) * 1.15))
    offsets: dict[int, tuple[int, int]] = {}
    row = column = shelf = 0
    for index in sorted(range(len(shapes)), key=lambda i: -shapes[i][0]):
        height, breadth = shapes[index][:2]
        if column + breadth > width:
            row, column, shelf = row + shelf, 0, 0
        offsets[index] = (row, column)
        column, shelf = column + breadth, max(shelf, height)
    return [offsets[i] for i in range(len(shapes))], (row + shelf, width)


def _uv_raster(uv: TextureCoords, faces: Faces, attributes: np.ndarray, size_px: int) -> np.ndarray:
    """Vertex attributes (n, 3) rasterised over the texture (row 0 on top): the uv plane seen from one metre in front of it."""
    plane = np.column_stack([uv[:, 0] - 0.5, 0.5 - uv[:, 1], np.ones(len(uv))])
    half = size_px / 2
    camera = Intrinsics(fx=size_px, fy=size_px, cx=half, cy=half, width=size_px, height=size_px)
    return rasterize(plane, faces, attributes, camera, Rigid3()).attributes
