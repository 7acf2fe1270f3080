"""Rules on the physical plausibility of masses and inertias."""

from collections.abc import Iterator

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.export.plan import WORLD
from r2c2r_core.export.reading import Urdf, UrdfInertial, UrdfLink
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.export.rules.table import finding
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.model.report import Finding

_BEYOND_M = 0.02  # a fitted visual may end this far inside the panels that give the mass


def check_inertia(urdf: Urdf, files: BundleFiles) -> Iterator[Finding]:
    """Check that every link but the bare root has an inertial consistent with its size."""
    for link in urdf.links:
        if link.inertial is None:
            if not (link.name == WORLD and not link.shapes):
                yield finding("inertial-missing", link.name, "no <inertial>")
        elif not (link.name == WORLD and link.inertial.mass_kg == 0.0):
            yield from _possible(link.name, link.inertial, link_points(link, files))


def link_points(link: UrdfLink, files: BundleFiles) -> Points:
    """Corners and vertices of all shapes of a link, in its frame."""
    points = [np.zeros((0, 3))]
    for shape in link.shapes:
        mesh = None if shape.mesh is None else files.mesh(shape.mesh)
        if mesh is not None:
            points.append(shape.link_from_shape.apply(mesh.vertices * shape.scale))
        elif shape.box_m is not None:
            points.append(shape.link_from_shape.apply(box_corners(shape.box_m)))
    stacked = np.concatenate(points)
    return stacked[np.isfinite(stacked).all(axis=1)]


def _possible(where: str, inertial: UrdfInertial, points: Points) -> Iterator[Finding]:
    if np.isnan(inertial.mass_kg) or np.isnan(inertial.inertia).any() or np.isnan(inertial.com_link).any():
        return  # reported by rule `number`
    if inertial.mass_kg <= 0.0:
        yield finding("mass-positive", where, f"mass {inertial.mass_kg:.4g} kg")
        return
    smallest, middle, largest = np.linalg.eigvalsh(inertial.inertia)
    if smallest <= 0.0:
        yield finding("inertia-positive", where, f"principal moments {smallest:.3g}, {middle:.3g}, {largest:.3g} kg m2")
    elif smallest + middle < largest * (1 - 1e-6):
        yield finding("inertia-triangle", where, f"{smallest:.3g} + {middle:.3g} < {largest:.3g} kg m2")
    if len(points) == 0:
        return
    reach = float(np.linalg.norm(points - inertial.com_link, axis=1).max()) + _BEYOND_M
    if largest > inertial.mass_kg * reach**2:
        bound = inertial.mass_kg * reach**2
        yield finding("inertia-impossible", where, f"{largest:.3g} kg m2 where {inertial.mass_kg:.3g} kg can have {bound:.3g}")
    outside = np.maximum(points.min(axis=0) - inertial.com_link, inertial.com_link - points.max(axis=0)).max()
    if outside > _BEYOND_M:
        yield finding("com-outside", where, f"the centre of mass is {1000 * outside:.0f} mm outside the link's shapes")
