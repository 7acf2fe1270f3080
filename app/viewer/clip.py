"""Clip box: shows only the part of the content inside it, with lines along cut edges."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from trimesh.intersections import slice_faces_plane

from r2c2r_core.arrays import Faces, Mask, Matrix3, Points, TextureCoords, Vector3
from r2c2r_core.geometry.transforms import Rigid3

_ON_CUT_M = 1e-6


@dataclass(frozen=True, slots=True)
class Span:
    """Extent along the kitchen's width, depth (from its fronts) and height."""

    span_from_world: Matrix3  # rows: to the right when facing the fronts, away from them, up
    low: Vector3
    high: Vector3

    def part(self, points_world: Iterable[Points]) -> tuple[Vector3, Vector3]:
        """Bounds of points as fractions of the span."""
        found = np.vstack([np.zeros((0, 3)), *(points @ self.span_from_world.T for points in points_world)])
        size = np.maximum(self.high - self.low, 1e-9)
        shares = np.clip([(found.min(axis=0) - self.low) / size, (found.max(axis=0) - self.low) / size], 0.0, 1.0)
        return shares[0], shares[1]


@dataclass(frozen=True, slots=True)
class Clip:
    """Half spaces normal . x >= offset in the world, whose intersection is kept."""

    normals: np.ndarray  # (k, 3)
    offsets: np.ndarray  # (k,)

    def keeps(self, points_world: Points) -> Mask:
        """Mask of the points inside."""
        return np.asarray((points_world @ self.normals.T >= self.offsets).all(axis=1))

    def cut(
        self, world_from_part: Rigid3, vertices: Points, faces: Faces, uv: TextureCoords | None
    ) -> tuple[Points, Faces, TextureCoords | None, Points]:
        """The kept part of a mesh in a body's frame, and the ends (n, 2, 3) of its cut edges."""
        lines = []
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            along = world_from_part.rotation.T @ normal
            begins = offset - float(normal @ world_from_part.translation)
            heights = vertices @ along - begins
            if not len(faces) or (heights >= -_ON_CUT_M).all():
                continue
            vertices, faces, uv = slice_faces_plane(vertices, faces, along, along * begins, uv=uv)
            lines.append((along, begins))
        return vertices, faces, uv, _edges_on(vertices, faces, lines)


def clip_of(span: Span, low: Iterable[float], high: Iterable[float]) -> Clip:
    """The box between fractions of a span; a side at 0 or 1 cuts nothing, even beyond the span."""
    normals, offsets = [], []
    size = span.high - span.low
    for axis, (begins, ends) in enumerate(zip(low, high, strict=True)):
        if begins > 0:
            normals.append(span.span_from_world[axis])
            offsets.append(span.low[axis] + begins * size[axis])
        if ends < 1:
            normals.append(-span.span_from_world[axis])
            offsets.append(-(span.low[axis] + ends * size[axis]))
    return Clip(np.reshape(normals, (-1, 3)), np.asarray(offsets, dtype=np.float64))


def span_of(facing: Vector3, points_world: Iterable[Points]) -> Span:
    """Span of points along the axes of fronts with that horizontal direction."""
    ahead = np.array([facing[0], facing[1], 0.0]) / max(float(np.hypot(facing[0], facing[1])), 1e-9)
    axes = np.array([[-ahead[1], ahead[0], 0.0], -ahead, [0.0, 0.0, 1.0]])
    stacked = np.vstack([points @ axes.T for points in points_world])
    return Span(axes, stacked.min(axis=0), stacked.max(axis=0))


def _edges_on(vertices: Points, faces: Faces, planes: list[tuple[Vector3, float]]) -> Any:
    edges = np.asarray(faces)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    found = [np.zeros((0, 2, 3))]
    for along, begins in planes:
        on = np.abs(vertices @ along - begins) < _ON_CUT_M
        found.append(vertices[edges[on[edges].all(axis=1)]])
    return np.vstack(found)
