"""RANSAC detection of the large planes of a surface: floor, worktops, fronts, walls."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.ingest.cloud import face_areas
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of plane detection."""

    tolerance_m: float = param(
        0.02,
        "m",
        "Maximum distance of an inlier from its plane",
        source="fused Kinect and LiDAR surfaces wobble by about 1 cm",
        gt=0,
    )
    normal_cos: float = param(
        float(np.cos(np.radians(25.0))),
        "cosine",
        "Minimum cosine of the angle between an inlier's normal and its plane's (25 degrees)",
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceSample:
    """Points spread evenly over a surface, each representing the same area."""

    points: Points
    normals: Points  # smoothed, pointing into free space
    area_each_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """A plane normal @ x = offset; the normal points into free space."""

    normal: Vector3
    offset_m: float
    area_m2: float
    points: Points  # of the sample, that lie on it


def sample_surface(vertices: Points, faces: Faces, count: int, rng: np.random.Generator) -> SurfaceSample:
    """`count` points spread by area, with normals smoothed over about five edge lengths."""
    if not len(faces):
        return SurfaceSample(points=np.zeros((0, 3)), normals=np.zeros((0, 3)), area_each_m2=0.0)
    areas = face_areas(vertices, faces)
    total = float(areas.sum())
    chosen = np.searchsorted(np.cumsum(areas) / total, (np.arange(count) + rng.random(count)) / count).clip(max=len(faces) - 1)
    corners = faces[chosen]
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    points = np.einsum("nk,nkd->nd", weights, vertices[corners])
    normals = _smooth_normals(vertices, faces)[corners[:, 0]]
    return SurfaceSample(points=points, normals=normals, area_each_m2=total / count)


def find_planes(
    sample: SurfaceSample, rng: np.random.Generator, *, smallest_m2: float = 0.15, most: int = 30, tries: int = 150
) -> tuple[Plane, ...]:
    """The largest planes, by area in descending order: RANSAC from single oriented points, refined by least squares."""
    params = tuned(Params)
    left = np.arange(len(sample.points))
    planes: list[Plane] = []
    while len(planes) < most and len(left) * sample.area_each_m2 >= smallest_m2:
        points, normals = sample.points[left], sample.normals[left]
        seeds = rng.choice(len(left), min(tries, len(left)), replace=False)
        judges = rng.choice(len(left), min(3000, len(left)), replace=False)
        distance = np.abs(points[judges] @ normals[seeds].T - np.einsum("nd,nd->n", points[seeds], normals[seeds]))
        fits = (distance < 1.5 * params.tolerance_m) & (normals[judges] @ normals[seeds].T > params.normal_cos)
        best = seeds[int(np.argmax(fits.sum(axis=0)))]
        normal, offset = _refine(points, normals, normals[best], float(normals[best] @ points[best]))
        on_it = _lies_on(points, normals, normal, offset, params.tolerance_m)
        area = float(on_it.sum() * sample.area_each_m2)
        if area < smallest_m2:
            break
        planes.append(Plane(normal=normal, offset_m=offset, area_m2=area, points=points[on_it]))
        left = left[~_lies_on(points, normals, normal, offset, 1.5 * params.tolerance_m)]
    return tuple(sorted(planes, key=lambda p: -p.area_m2))


def _refine(points: Points, normals: Points, normal: Vector3, offset: float) -> tuple[Vector3, float]:
    """Least-squares plane over the inliers, in four rounds with a shrinking tolerance."""
    params = tuned(Params)
    for band in (3.0, 2.0, 1.0, 1.0):
        on_it = _lies_on(points, normals, normal, offset, band * params.tolerance_m)
        if on_it.sum() < 8:
            break
        centre = points[on_it].mean(axis=0)
        spread = points[on_it] - centre
        fitted = np.linalg.eigh(spread.T @ spread)[1][:, 0]
        normal = fitted if fitted @ normal > 0 else -fitted
        offset = float(normal @ centre)
    return normal, offset


def _lies_on(points: Points, normals: Points, normal: Vector3, offset: float, band_m: float) -> np.ndarray:
    return np.asarray((np.abs(points @ normal - offset) < band_m) & (normals @ normal > tuned(Params).normal_cos))


def _smooth_normals(vertices: Points, faces: Faces) -> Points:
    from scipy.sparse import coo_matrix

    a, b, c = (vertices[faces[:, i]] for i in range(3))
    of_face = np.cross(b - a, c - a)
    count = len(vertices)
    normals = np.stack(
        [np.bincount(faces.ravel(), weights=np.repeat(of_face[:, axis], 3), minlength=count) for axis in range(3)], axis=1
    )
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    links = coo_matrix((np.ones(len(start), np.float32), (start, end)), shape=(count, count)).tocsr()
    links = links + links.T
    for _ in range(5):
        normals = links @ normals + normals
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return np.asarray(normals)
