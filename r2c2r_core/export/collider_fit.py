"""Symmetric surface distance between the colliders and the visual of each link."""

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.export.openings import inside_hull, shape_corners
from r2c2r_core.export.reading import Urdf, UrdfLink, UrdfShape
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.geometry.meshes import box_mesh, distances_to_mesh, sample_surface
from r2c2r_core.model.report import ColliderFit, Gap

_SAMPLES = 4000  # on each surface of a link
_SUNK_M = 1e-4  # depth in another collider at which a point cannot be touched


def collider_fits(urdf: Urdf, files: BundleFiles) -> tuple[ColliderFit, ...]:
    """Fit of every link with both a visual and a collider, in file order."""
    return tuple(fit for link in urdf.links if (fit := _fit(link, files)) is not None)


def _fit(link: UrdfLink, files: BundleFiles) -> ColliderFit | None:
    drawn = _surface([shape for shape in link.shapes if shape.kind == "visual"], files)
    colliders = [shape for shape in link.shapes if shape.kind == "collision"]
    touched = _surface(colliders, files)
    if drawn is None or touched is None:
        return None
    rng = np.random.default_rng(0)
    on_drawn, on_touched = (sample_surface(*surface, _SAMPLES, rng)[0] for surface in (drawn, touched))
    on_touched = _outermost(on_touched, colliders, files)
    return ColliderFit(
        link=link.name,
        drawn_to_collider=_gap(distances_to_mesh(on_drawn, *touched)),
        collider_to_drawn=_gap(distances_to_mesh(on_touched, *drawn)),
    )


def _outermost(points: Points, colliders: list[UrdfShape], files: BundleFiles) -> Points:
    """Points on collider surfaces that are not inside another collider."""
    sunk = np.zeros(len(points), dtype=bool)
    for shape in colliders:
        sunk |= inside_hull(points, shape.link_from_shape.apply(shape_corners(shape.box_m, shape.mesh, files)), _SUNK_M)
    return points if sunk.all() else points[~sunk]


def _surface(shapes: list[UrdfShape], files: BundleFiles) -> tuple[Points, Faces] | None:
    """All shapes of a link as one mesh in its frame; None where none can be read."""
    vertices, faces, count = list[Points](), list[Faces](), 0
    for shape in shapes:
        own = _mesh(shape, files)
        if own is not None:
            vertices.append(shape.link_from_shape.apply(own[0]))
            faces.append(own[1] + count)
            count += len(own[0])
    return (np.concatenate(vertices), np.concatenate(faces)) if count else None


def _mesh(shape: UrdfShape, files: BundleFiles) -> tuple[Points, Faces] | None:
    if shape.box_m is not None:
        return box_mesh(-shape.box_m / 2, shape.box_m / 2)
    found = files.mesh(shape.mesh) if shape.mesh is not None else None
    return None if found is None else (found.vertices, found.faces)


def _gap(distances_m: np.ndarray) -> Gap:
    return Gap(
        median_m=float(np.median(distances_m)), p95_m=float(np.quantile(distances_m, 0.95)), most_m=float(distances_m.max())
    )
