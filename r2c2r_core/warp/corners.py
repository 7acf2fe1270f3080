"""Four corners of a mesh's front face (paper section 4.8, corrected).

The paper scores vertices by radius and depth, which picks handle tips, needs a centred front, and gives four points that are
not coplanar. Here: the front plane that every stage uses (kitchen/fronts.py), then the smallest rectangle around its inliers
(method.md row 22, whose RANSAC converges between frame and panel when they are millimetres apart).
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.boxes import smallest_rectangle
from r2c2r_core.geometry.meshes import face_normals, sample_surface
from r2c2r_core.geometry.transforms import rotation_between
from r2c2r_core.kitchen.fronts import FrontPlane, front_plane
from r2c2r_core.kitchen.fronts import Params as FrontsParams
from r2c2r_core.tuning import param, tuned

_FORWARD = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of front corners."""

    samples: int = param(12000, "count", "Number of points sampled on the mesh", ge=100)
    edge_share: float = param(
        0.0005, "share", "Fraction of the front's points ignored beyond each side: specks of other faces", ge=0, lt=0.5
    )
    rim_m: float = param(
        0.006, "m", "Distance from the front's outline within which the mesh's own vertices determine its edges"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontFace:
    """The front's plane and rectangle in the mesh's canonical axes."""

    corners: Points  # (4, 3): top right, top left, bottom left, bottom right, as seen by a person facing it
    outward: Vector3
    inliers: int

    @property
    def centre(self) -> Vector3:
        """Centre of the rectangle."""
        return self.corners.mean(axis=0)

    @property
    def upright_from_mesh(self) -> np.ndarray:
        """The small rotation that makes the face vertical, facing -Y, with level edges."""
        level = rotation_between(self.outward, _FORWARD)
        right = level @ (self.corners[0] - self.corners[1])
        roll = np.arctan2(right[2], right[0])
        c, s = np.cos(roll), np.sin(roll)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ level


def find_front(vertices: Points, faces: Faces, *, seed: int = 0) -> FrontFace | None:
    """The foremost large plane among faces that look towards -Y; None without one."""
    params = tuned(Params)
    rng = np.random.default_rng(seed)
    points, chosen = sample_surface(vertices, faces, params.samples, rng)
    towards = face_normals(vertices, faces)
    plane = front_plane(points, towards[chosen])
    if plane is None:
        return None
    forward = faces[towards[:, 1] < -tuned(FrontsParams).looks]
    flat = forward[plane.holds(vertices[forward]).all(axis=1)]
    # Resampled alone, if there are any: among all faces a sliver along an edge may get no sample
    inliers = sample_surface(vertices, flat, params.samples, rng)[0] if len(flat) else _on(plane, points, towards[chosen])
    rim = vertices[np.unique(forward)]
    corners = _rectangle_corners(inliers, rim[plane.holds(rim)], plane.outward, plane.offset_m)
    return FrontFace(corners=corners, outward=plane.outward, inliers=len(inliers))


def _on(plane: FrontPlane, points: Points, normals: Points) -> Points:
    """The points that face forwards and lie on a plane."""
    return points[(normals[:, 1] < -tuned(FrontsParams).looks) & plane.holds(points)]


def _rectangle_corners(inliers: Points, rim: Points, normal: Vector3, offset: float) -> Points:
    """Corners, on the plane, of the smallest rectangle around the inliers.

    Specks are trimmed first; the sides then extend to the plane's own vertices, which samples do not quite reach.
    """
    params = tuned(Params)
    level = rotation_between(normal, _FORWARD)
    flat, rim_flat = (inliers @ level.T)[:, [0, 2]], (rim @ level.T)[:, [0, 2]]
    beside = ((rim_flat > flat.min(axis=0) - params.rim_m) & (rim_flat < flat.max(axis=0) + params.rim_m)).all(axis=1)
    axes = smallest_rectangle(np.concatenate([flat, rim_flat[beside]])).axes
    if abs(axes[0, 0]) < np.cos(np.pi / 4):
        axes = axes[:, ::-1] * [1, -1]
    axes = axes * np.sign(axes[0, 0])
    low, high = np.quantile(flat @ axes, [params.edge_share, 1 - params.edge_share], axis=0)
    vertices = rim_flat @ axes
    near = vertices[((vertices > low - params.rim_m) & (vertices < high + params.rim_m)).all(axis=1)]
    if len(near):
        low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    signs = np.array([[1, 1], [0, 1], [0, 0], [1, 0]])
    corners2 = (low + signs * (high - low)) @ axes.T
    corners = np.column_stack([corners2[:, 0], np.full(4, -offset), corners2[:, 1]])
    return corners @ level
