"""Size and orientation of an object from its placed mesh (paper eq. 8-10, corrected).

Departures from the paper (method.md rows 17, 18): the box is measured on the *placed* mesh, in metres; gravity is known, so
only the plan is searched (exactly); width, depth and height are assigned by the side that the cameras saw; the handle is
measured separately; the segmenter's measurements over all frames (a front's rectangle, an object's box) replace the mesh's on
the axes they cover.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.free_boxes import powell_box, smallest_box
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.kitchen.category import Category, Size
from r2c2r_core.kitchen.depth import FrontDepth, believable, front_depth, sigma_m
from r2c2r_core.kitchen.depth import Params as DepthParams
from r2c2r_core.kitchen.fronts import front_y
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.model.motion import JointMotion, Source
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.track import FrontHandle, FrontPanel, MaskTrack
from r2c2r_core.synthesize.fixtures.spec import Lap
from r2c2r_core.synthesize.handles import handle_of_mesh, handles_of_mesh
from r2c2r_core.synthesize.surface import SurfaceSamples, sampled
from r2c2r_core.tuning import param, tuned

BoxSearch = Literal["upright", "hull", "powell"]
"""Search for a mesh's own axes: rotating calipers in plan, where gravity is known; the hull's faces, where it is assumed; or
the paper's Powell search (eq. 8-9), for comparison."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of size and orientation."""

    samples: int = param(6000, "count", "Number of points sampled on a mesh's surface", ge=100)
    sure_share: float = param(0.08, "share", "Standard deviation relative to the depth below which a depth counts as measured")
    sure_m: float = param(0.004, "m", "Standard deviation below which a depth counts as measured")
    as_tight: float = param(
        1.03,
        "ratio",
        "Maximum ratio of plan areas at which two yaws of an object's box fit equally tightly",
        source="a square rotated by 0.9 degrees reaches this ratio, a round object at any yaw",
    )
    edge_share: float = param(
        0.25,
        "share",
        "Distance of a handle from the middle, relative to the width, above which it is at an edge",
        source="handles of two doors meet in the middle",
    )
    slides: float = param(0.7, "share", "Minimum probability of a sliding door for it to be built as one", gt=0, lt=1)
    foot_m: float = param(
        0.035,
        "m",
        "Height above the floor below which a lower end cannot be distinguished from it",
        source="sample kitchens of both generators: of 6 refrigerators 4 ended 18-22 mm off there, on either side of the truth",
    )
    trim: float = param(
        0.001,
        "share",
        "Fraction of the surface ignored at either end of an axis: less than any real face, more than a spike",
        ge=0,
        lt=0.5,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredObject:
    """An object as measured, before the layout."""

    name: str
    category: str
    spec: Category
    world_from_object: Rigid3
    dimensions_m: Vector3
    sources: tuple[Source, Source, Source]
    depth_sigma_m: float = 1.0  # standard deviation of a unit's depth; 1 m: nothing is known
    handle: FrontHandle | None
    handles: tuple[FrontHandle, ...] = ()  # all handles, where several fronts may be one object
    motions: tuple[JointMotion, ...] = ()  # of each leaf filmed open, at its placed pose before the layout
    support_z_m: float | None
    front_measured: bool  # the front plane and its rectangle come from all frames, not from the mesh
    confidence: float
    edges: tuple[float, ...] = ()  # probability that each edge of its front is right: left, right, top, bottom
    strip_over_m: float = 0.0  # height of the strip of another material over its front; 0: none was seen
    fixed_by_person: bool  # a person gave pose or size: the layout leaves it where it is
    laps: tuple[Lap, ...] = ()  # with the leaves that it slides past, set after the layout
    placed_pose: Rigid3  # world_from_object as the mesh was placed, before person and layout
    warnings: tuple[str, ...]

    @property
    def outward(self) -> Vector3:
        """Horizontal direction that its front faces."""
        return -self.world_from_object.rotation[:, 1]

    @property
    def front_centre(self) -> Vector3:
        """Centre of the front face, in the world."""
        return self.world_from_object.apply(np.array([0.0, -self.dimensions_m[1] / 2, 0.0]))


def measure_object(
    capture: Capture,
    track: MaskTrack,
    placement: Placement,
    asset: MeshAsset,
    spec: Category,
    override: ObjectOverride,
    *,
    seed: int = 0,
    box_search: BoxSearch = "upright",
) -> MeasuredObject:
    """Size, pose and handle of one object; every axis states the source of its number."""
    vertices_world = placement.world_from_mesh.apply(asset.mesh.vertices)
    samples = sampled(vertices_world, asset.mesh.faces, tuned(Params).samples, seed)
    warnings: list[str] = []
    outward, yaw_known = facing(capture, track, samples)
    if box_search == "upright" and capture.room.up_source == "assumed":
        box_search = "hull"
    rotation = front_rotation(outward) if yaw_known else _mesh_rotation(samples, outward, box_search)
    low, high = mesh_range(samples, rotation, with_front=spec.opens not in ("rigid", "fixed"))
    handle = None
    front = track.front if track.front is not None and _fits(track.front, high - low, warnings) else None
    sources: list[Source] = ["measured", "inferred", "measured"]
    sigma = sigma_m("box")
    if front is not None:
        low, high = _with_front(low, high, front, rotation)
        handle = front.handle
    elif track.box is not None and spec.opens != "rigid":
        low, high = _with_box(low, high, track, rotation)
    if spec.opens == "rigid":
        sources[1] = _depth_source(capture, asset, low, high, rotation, warnings)
    elif (observed_m := _observed_depth(track, float(high[1] - low[1]))) is not None:
        high, sources[1] = np.array([high[0], low[1] + observed_m, high[2]]), "measured"
    else:
        high, sources[1], sigma = _believable_depth(capture, track, asset, spec, low, high, rotation)
    if track.kind == "appliance" and _foot_hidden(capture, low):
        sources[2] = "inferred"
    if handle is None and spec.opens not in ("rigid", "fixed"):
        handle = handle_of_mesh(samples, rotation, low, high)
    pose = Rigid3(rotation, rotation @ ((low + high) / 2))
    measured = MeasuredObject(
        name=track.name,
        category=track.category,
        spec=spec,
        world_from_object=pose,
        dimensions_m=high - low,
        sources=(sources[0], sources[1], sources[2]),
        depth_sigma_m=sigma if override.candidate is None else sigma_m("box"),  # a person chose the depth with the shape
        handle=handle,
        handles=handles_of_mesh(samples, rotation, low, high) if spec.several_fronts else (),
        motions=track.motions,
        support_z_m=track.box.support_z_m if track.box is not None else None,
        front_measured=front is not None,
        confidence=front.confidence if front is not None else 0.3,
        edges=front.edges if front is not None else (),
        strip_over_m=front.strip_over_m if front is not None else 0.0,
        fixed_by_person=False,
        placed_pose=pose,
        warnings=tuple(warnings),
    )
    if front is not None and front.slides > tuned(Params).slides and spec.opens == "side" and not track.motions:
        warnings.append(f"it lies in front of the panel beside it: treated as a sliding door ({front.slides:.0%})")
        measured = replace(measured, spec=category_of("sliding_door"), warnings=tuple(warnings))
        return _corrected(measured, override)
    return _corrected(replace(measured, spec=_at_width(spec, float(measured.dimensions_m[0]), handle)), override)


def _at_width(spec: Category, width_m: float, handle: FrontHandle | None) -> Category:
    """Category at a width: a wide refrigerator has two doors, unless its handle is at one edge."""
    at_edge = handle is not None and abs(handle.centre[0]) > tuned(Params).edge_share * width_m
    return category_of(spec.wider[1]) if spec.wider is not None and width_m >= spec.wider[0] and not at_edge else spec


def facing(capture: Capture, track: MaskTrack, samples: SurfaceSamples) -> tuple[Vector3, bool]:
    """Horizontal direction that the object faces, and whether its yaw is exact; else only the side that the cameras saw."""
    if track.front is not None:
        return track.front.outward, True
    if track.box is not None and track.kind == "appliance":
        return -track.box.world_from_object.rotation[:, 1], True
    if track.box is not None:
        return -track.box.world_from_object.rotation[:, 1], False
    seen = [f.world_from_camera.translation for f in capture.frames if f.index in track.masks]
    towards = np.mean(seen, axis=0) - samples.points.mean(axis=0) if seen else np.array([0.0, -1.0, 0.0])
    return np.array([towards[0], towards[1], 0.0]) / max(float(np.hypot(towards[0], towards[1])), 1e-9), False


def mesh_range(samples: SurfaceSamples, rotation: np.ndarray, *, with_front: bool) -> tuple[Vector3, Vector3]:
    """Low and high ends along the object's axes; with a front, its plane is the low end of y and the handle is excluded."""
    params = tuned(Params)
    points = samples.points @ rotation
    if with_front:
        front = front_y(points, samples.normals @ rotation)
        points = points[points[:, 1] > front - 0.004]
        low, high = np.quantile(points, [params.trim, 1 - params.trim], axis=0)
        low[1] = front
        return low, high
    low, high = np.quantile(points, [params.trim, 1 - params.trim], axis=0)
    return low, high


def _mesh_rotation(samples: SurfaceSamples, outward: Vector3, search: BoxSearch) -> np.ndarray:
    """Upright axes along the mesh's own box, with the quarter turn whose front is nearest to `outward`.

    A round object has no such box: any yaw is equally tight, and it faces `outward`.
    """
    params = tuned(Params)
    if search == "upright":
        axes = upright_box(samples.points, samples.normals, trim=params.trim).world_from_box.rotation
    else:
        free = smallest_box(samples.points) if search == "hull" else powell_box(samples.points)
        axes = free.world_from_box.rotation
    level = np.delete(axes.T, np.argmax(np.abs(axes[2])), axis=0)
    nearest = max([*level, *-level], key=lambda d: float(d @ outward))
    facing, tightest = front_rotation(outward), front_rotation(np.array([nearest[0], nearest[1], 0.0]))
    as_tight = _plan_area(samples.points, facing) <= params.as_tight * _plan_area(samples.points, tightest)
    return facing if as_tight else tightest


def _plan_area(points: Points, rotation: np.ndarray) -> float:
    params = tuned(Params)
    low, high = np.quantile((points @ rotation)[:, :2], [params.trim, 1 - params.trim], axis=0)
    return float(np.prod(high - low))


def _fits(front: FrontPanel, mesh_size: Vector3, warnings: list[str]) -> bool:
    """Whether the measured front may replace the mesh's width and height."""
    ratio = np.array([front.width_m, front.height_m]) / np.maximum(mesh_size[[0, 2]], 1e-6)
    if front.confidence < 0.15:
        return False
    if (ratio < 0.8).any() or (ratio > 1.25).any():
        warnings.append(
            f"the mesh measures {mesh_size[0]:.2f} x {mesh_size[2]:.2f} m across, its front in the frames "
            f"{front.width_m:.2f} x {front.height_m:.2f} m: the frames were used"
        )
    return True


def _with_front(low: Vector3, high: Vector3, front: FrontPanel, rotation: np.ndarray) -> tuple[Vector3, Vector3]:
    """The range with the front's rectangle and plane; the back remains the mesh's."""
    centre, half = front.centre @ rotation, front.corners_front[1]
    new_low, new_high = centre - half, centre + half
    new_high[1] = centre[1] + max(high[1] - low[1], 0.02) if high[1] < centre[1] + 0.05 else high[1]
    return new_low, new_high


def _with_box(low: Vector3, high: Vector3, track: MaskTrack, rotation: np.ndarray) -> tuple[Vector3, Vector3]:
    """The range of the box measured on the visible points, for an appliance without a front."""
    assert track.box is not None
    centre = track.box.world_from_object.translation @ rotation
    return centre - track.box.dimensions_m / 2, centre + track.box.dimensions_m / 2


def _believable_depth(
    capture: Capture, track: MaskTrack, asset: MeshAsset, spec: Category, low: Vector3, high: Vector3, rotation: np.ndarray
) -> tuple[Vector3, Source, float]:
    """High end of the range with a plausible depth, its source, and its standard deviation."""
    behind = depth_behind(capture, rotation, low, high, spec.depth)
    depth, replaced = believable(float(high[1] - low[1]), behind, spec.depth, seen_apart=track.kind != "front")
    high = np.array([high[0], low[1] + depth, high[2]])
    if track.kind == "front" and spec.opens != "fixed" and _side_ends(capture, low, high, rotation):
        return high, "measured", sigma_m("box")
    sigma = asset.parameters.get("behind_sigma_m", sigma_m("category")) if replaced is None else sigma_m(replaced)
    return high, "default" if replaced == "category" else "inferred", sigma


def depth_behind(capture: Capture, rotation: np.ndarray, low: Vector3, high: Vector3, depth: Size) -> FrontDepth:
    """Depth available behind the front of a box along the columns of `rotation`, limited by the room's walls."""
    front_centre = rotation @ np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return front_depth(capture.room.walls, front_centre, -rotation[:, 1], depth)


def _depth_source(
    capture: Capture, asset: MeshAsset, low: Vector3, high: Vector3, rotation: np.ndarray, warnings: list[str]
) -> Source:
    """Whether an object's depth was observed, on a face that shows it or in outlines; a round one's follows from its width."""
    params = tuned(Params)
    if asset.parameters.get("revolved"):
        return "inferred"
    depth, sigma = float(high[1] - low[1]), asset.parameters.get("depth_sigma_m")
    seen = _face_seen(capture, low, high, rotation) if sigma is None else sigma < max(params.sure_share * depth, params.sure_m)
    if not seen:
        warnings.append(f"no frame shows how deep it is: {depth:.2f} m is inferred")
    return "measured" if seen else "inferred"


def _observed_depth(track: MaskTrack, depth_m: float) -> float | None:
    """Depth that was observed with the object's box, where the placed mesh has that depth up to the error of its scale."""
    if track.box is None or not track.box.depth_seen:
        return None
    observed_m = float(track.box.dimensions_m[1])
    return observed_m if abs(depth_m - observed_m) < tuned(DepthParams).alike_m else None


def _side_ends(capture: Capture, low: Vector3, high: Vector3, rotation: np.ndarray) -> bool:
    """Whether the scan shows a side of a unit from front to back, but not 5 cm beyond, so that the depth was observed."""
    beyond = np.array([low[0], high[1] + 0.02, low[2]]), np.array([high[0], high[1] + 0.07, high[2]])
    return _face_seen(capture, low, high, rotation, (0,)) and not _face_seen(capture, *beyond, rotation, (0,))


def _face_seen(capture: Capture, low: Vector3, high: Vector3, rotation: np.ndarray, axes: Sequence[int] = (0, 2)) -> bool:
    """Whether the scan shows a side (axis 0) or the top (2) from front to back, so that the depth was observed."""
    points = capture.surface.vertices_world @ rotation
    margin = 0.2 * (high - low)
    points = points[(points[:, 1] > low[1] - 0.02) & (points[:, 1] < high[1] + 0.02)]
    bins = int(np.clip(0.8 * (high[1] - low[1]) / capture.surface.voxel_m, 3, 12))
    for other in axes:
        across, faces = 2 - other, (low[0], high[0]) if other == 0 else (high[2],)
        inner = points[(points[:, across] > low[across] + margin[across]) & (points[:, across] < high[across] - margin[across])]
        for face in faces:
            y = inner[np.abs(inner[:, other] - face) < 0.02, 1]
            filled = np.histogram(y, bins=bins, range=(low[1], high[1]))[0]
            if len(y) > 30 and (filled > 0).mean() > 0.85:
                return True
    return False


def _foot_hidden(capture: Capture, low: Vector3) -> bool:
    """Whether its lower end is too near the floor to be distinguished: feet lift an appliance by a dark gap or none."""
    return capture.room.floor_found and bool(low[2] < tuned(Params).foot_m)


def _corrected(measured: MeasuredObject, override: ObjectOverride) -> MeasuredObject:
    """The object with a person's values; the front face stays in place when only the size is given."""
    if override.dimensions_m is not None:
        grown = np.asarray(override.dimensions_m, dtype=np.float64)
        into = measured.world_from_object.rotation[:, 1]
        shift = into * (grown[1] - measured.dimensions_m[1]) / 2
        if measured.spec.stands:  # it grows from what it stands on
            shift = shift + np.array([0.0, 0.0, (grown[2] - measured.dimensions_m[2]) / 2])
        pose = Rigid3(measured.world_from_object.rotation, measured.world_from_object.translation + shift)
        measured = replace(
            measured,
            dimensions_m=grown,
            world_from_object=pose,
            sources=("person", "person", "person"),
            depth_sigma_m=sigma_m("box"),
            fixed_by_person=True,
        )
    if override.pose is not None:
        measured = replace(measured, world_from_object=Rigid3.from_matrix(override.pose), fixed_by_person=True)
    return measured
