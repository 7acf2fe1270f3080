"""Segmentation of a fitted mesh into the moving fronts, with their handles, and the hollow carcass.

One closed mesh has no inside and no separate door (method.md row 25): the fronts are cut off where the primitive's are, the
cuts are capped, and the carcass is hollowed like its panels, so that an opened door shows an interior.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.scene import Box, Link, SceneObject
from r2c2r_core.tuning import param, tuned
from r2c2r_core.warp.solids import Paint, box_solid, joined, mesh_of, plain_box, solid_of

_FAR_M = 10.0
_TOUCH_M = 1e-4  # a board this close to an outer face touches it


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned gaps between the parts of a mesh."""

    beside_m: float = param(0.0015, "m", "Gap between a moving front and its static neighbours")
    behind_m: float = param(0.002, "m", "Gap between a moving front and the carcass behind it")
    before_m: float = param(0.001, "m", "Thickness in front of a front that others pass, within which its own surface may lie")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Region:
    """Box of a moving front in the object frame, open towards the outside of the object."""

    low: Vector3
    high: Vector3


def cut_apart(item: SceneObject, mesh: TexturedMesh, paint: Paint) -> dict[str, TexturedMesh]:
    """Visual of each link in the object frame, closed: fronts with handles (and a drawer's tray), and the carcass."""
    fronts = {link.name: front_region(item, link) for link in item.links[1:]}
    solid = solid_of(mesh.vertices, mesh.faces, mesh.uv)
    if solid is None:
        return _cut_open(item, mesh, paint, fronts)
    visuals: dict[str, TexturedMesh] = {}
    rest = solid
    for link in item.links[1:]:
        region = fronts[link.name]
        front = solid ^ box_solid(region.low, region.high, paint.back_uv)
        visuals[link.name] = joined([mesh_of(front, paint.texture), *_inner_boxes(item, link, paint)])
        wider = _widened(region)
        # edges of the carcass are banded like its front: white ones would shine through the seam
        rest = rest - box_solid(wider.low, wider.high, paint.back_uv)
    if _shares_its_box(item):
        rest = rest ^ box_solid(*_body(item), paint.back_uv)
    low, high = cavity(item)
    if (high > low).all():
        rest = rest - box_solid(low, high, paint.inside_uv)
    base = item.links[0]
    visuals[base.name] = joined([mesh_of(rest, paint.texture), *_inner_boxes(item, base, paint)])
    return visuals


def _shares_its_box(item: SceneObject) -> bool:
    """Whether its front slides sideways: then other leaves pass through its box, in front of its body or beside it."""
    return any(joint.type == "prismatic" and abs(float(joint.axis_object[1])) < 0.5 for joint in item.joints)


def _body(item: SceneObject) -> tuple[Vector3, Vector3]:
    """Corners of the part of the mesh that may remain, in the object frame."""
    half = item.dimensions_m / 2
    return _range(item.links[0], item.links[0].boxes) if _shares_its_box(item) else (-half, half)


def front_region(item: SceneObject, link: Link) -> Region:
    """Box of the front boards, unbounded forwards (the handle) and where it reaches the object's own edge.

    A front that slides sideways ends where its handle does: another may pass in front of it.
    """
    low, high = front_range(link)
    half = item.dimensions_m / 2
    for axis in (0, 2):
        low[axis] = -_FAR_M if low[axis] < -half[axis] + _TOUCH_M else low[axis]
        high[axis] = _FAR_M if high[axis] > half[axis] - _TOUCH_M else high[axis]
    low[1] = _range(link, link.boxes)[0][1] - tuned(Params).before_m if _shares_its_box(item) else -_FAR_M
    return Region(low=low, high=high)


def front_range(link: Link) -> tuple[Vector3, Vector3]:
    """Joint corners of a moving link's front boards, in the object frame."""
    return _range(link, link.of_role("front"))


def cavity(item: SceneObject) -> tuple[Vector3, Vector3]:
    """Interior of the carcass between its boards; empty (low > high) unless both sides, top, bottom and back have one."""
    params = tuned(Params)
    base = item.links[0]
    first, last = _body(item)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for box in base.of_role("carcass"):
        start, end = _range(base, (box,))
        axis = int(np.argmin(end - start))
        if start[axis] < first[axis] + _TOUCH_M:
            low[axis] = min(low[axis], end[axis])
        if end[axis] > last[axis] - _TOUCH_M:
            high[axis] = max(high[axis], start[axis])
        if axis == 0:
            low[1] = min(low[1], start[1] - params.behind_m)  # the front edges of the sides
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return np.ones(3), -np.ones(3)
    return low, high


def _range(link: Link, boxes: Sequence[Box]) -> tuple[Vector3, Vector3]:
    """Joint corners of boxes in the object frame; a link's axes are the object's."""
    centres = link.object_from_link.apply(np.array([box.link_from_box.translation for box in boxes]))
    halves = np.array([box.size_m for box in boxes]) / 2
    return (centres - halves).min(axis=0), (centres + halves).max(axis=0)


def _widened(region: Region) -> Region:
    """Region that a carcass must leave free: a little wider than the front, and deeper by the seat gap."""
    params = tuned(Params)
    beside = np.array([params.beside_m, 0.0, params.beside_m])
    return Region(low=region.low - beside, high=region.high + beside + np.array([0.0, params.behind_m, 0.0]))


def _inner_boxes(item: SceneObject, link: Link, paint: Paint) -> list[TexturedMesh]:
    """Unobserved parts as panels: a drawer's floor, sides and back; shelves and floors inside a carcass."""
    return [_placed(box, link, paint) for box in link.of_role("inner")]


def _placed(box: Box, link: Link, paint: Paint) -> TexturedMesh:
    plain = plain_box(box.size_m, paint.inside_uv, paint.texture)
    pose: Rigid3 = link.object_from_link @ box.link_from_box
    return TexturedMesh(vertices=pose.apply(plain.vertices), faces=plain.faces, uv=plain.uv, texture=plain.texture)


def _cut_open(item: SceneObject, mesh: TexturedMesh, paint: Paint, fronts: dict[str, Region]) -> dict[str, TexturedMesh]:
    """The same parts of a surface that does not bound a solid, backed with the primitive's panels instead of capped."""
    visuals: dict[str, TexturedMesh] = {}
    for link in item.links[1:]:
        skin = _kept(mesh, fronts[link.name])
        panels = [_placed(_thinner(box), link, paint) for box in link.boxes if box.role != "handle"]
        visuals[link.name] = joined([skin, *panels])
    base = item.links[0]
    behind = max(region.high[1] for region in fronts.values()) + tuned(Params).behind_m
    pieces = [_sliced(mesh, np.array([0.0, 1.0, 0.0]), behind)]
    if len(fronts) == 1:
        pieces += _beside(_sliced(mesh, np.array([0.0, -1.0, 0.0]), -behind), _widened(next(iter(fronts.values()))))
    pieces += [_placed(_thinner(box), base, paint) for box in base.boxes]
    visuals[base.name] = joined([piece for piece in pieces if len(piece.faces)])
    return visuals


def _kept(mesh: TexturedMesh, region: Region) -> TexturedMesh:
    """The part of a surface inside a region."""
    for axis in range(3):
        direction = np.eye(3)[axis]
        mesh = _sliced(mesh, direction, float(region.low[axis]))
        mesh = _sliced(mesh, -direction, -float(region.high[axis]))
    return mesh


def _beside(mesh: TexturedMesh, region: Region) -> list[TexturedMesh]:
    """The parts of a front that lie left, right, below and above a region: control panels."""
    pieces = []
    for axis in (0, 2):
        direction = np.eye(3)[axis]
        pieces.append(_sliced(mesh, -direction, -float(region.low[axis])))
        pieces.append(_sliced(mesh, direction, float(region.high[axis])))
        mesh = _sliced(_sliced(mesh, direction, float(region.low[axis])), -direction, -float(region.high[axis]))
    return pieces


def _sliced(mesh: TexturedMesh, normal: Vector3, offset: float) -> TexturedMesh:
    """The part of a surface where normal @ x >= offset."""
    from trimesh.intersections import slice_faces_plane

    if len(mesh.faces) == 0:
        return mesh
    vertices, faces, uv = slice_faces_plane(mesh.vertices, mesh.faces, normal, normal * offset, uv=mesh.uv)
    return TexturedMesh(
        vertices=np.asarray(vertices, dtype=np.float64).reshape(-1, 3),
        faces=np.asarray(faces, dtype=np.int64).reshape(-1, 3),
        uv=np.asarray(uv, dtype=np.float64).reshape(-1, 2),
        texture=mesh.texture,
    )


def _thinner(box: Box) -> Box:
    """The panel shrunk by a millimetre, so that it backs the skin without z-fighting."""
    return replace(box, size_m=np.maximum(box.size_m - 0.002, 0.001))


def outline(meshes: Sequence[TexturedMesh]) -> TexturedMesh:
    """All fronts as one mesh, for measuring their corners."""
    return joined(list(meshes))
