"""Surface voxels from depth images, for parts that fusion loses: thin legs, and sheets seen from both sides."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Points, Vector3
from r2c2r_core.geometry.camera import depth_points, project
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.slab import height_of
from r2c2r_core.segment.things.support import raised, support_offset
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the depth cloud."""

    frames: int = param(40, "count", "Maximum number of frames whose depth is used", ge=2)
    nearest_m: float = param(0.2, "m", "Minimum depth that a sensor measures", source="ARKit LiDAR and Kinect: 0.2 to 0.4 m")
    places: int = param(
        4,
        "count",
        "Number of places on a level surface, those nearest the optical axis, where a frame's height offset is tried",
        ge=1,
    )
    most_rows: int = param(240, "px", "Maximum number of depth-image rows used: more show no detail at the voxel size", ge=16)
    least_hits: int = param(2, "count", "Minimum number of frames that must see surface in a voxel", ge=1)
    agreed: float = param(
        0.2,
        "share",
        "Minimum fraction of frames looking at a voxel that must see surface there: sensors smear thin parts backwards",
    )
    edge_step: float = param(
        0.06,
        "ratio",
        "Depth step within 3x3 pixels, relative to the depth, above which a pixel may mix near and far surface",
        source="backends.md 2.7",
    )
    near_side: float = param(
        0.25,
        "share",
        "Maximum distance of a pixel behind the near side of a step, as a fraction of the step: thin legs are all edge",
    )
    through_m: float = param(
        0.03, "m", "Minimum distance of measured depth behind a voxel, beyond the noise, for the voxel to be seen through"
    )


@dataclass(frozen=True, slots=True, eq=False)
class DepthCloud:
    """Voxels (n) in which depth images agree on surface: mean position, mean Lab colour, and number of frames that hit them."""

    origin: Vector3
    size_m: float
    cells: np.ndarray  # (n, 3) int
    positions: Points
    lab: np.ndarray  # (n, 3) float
    hits: np.ndarray  # (n,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Region:
    """An axis-aligned box in the world, and a level surface in it that corrects the height of each frame."""

    low: Vector3
    high: Vector3
    level: np.ndarray | None  # (a, b, c): its height is a x + b y + c

    def holds(self, points: Points) -> np.ndarray:
        """Mask of the points that lie inside the box."""
        return np.asarray(((points > self.low) & (points < self.high)).all(axis=-1))

    def lift(self, scene: Scene, frame: Frame) -> float:
        """Height error of a frame, metres (positive: too high), from the level surface where it is nearest the image centre."""
        if self.level is None:
            return 0.0
        x, y = (
            np.linspace(0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b, 5) for a, b in zip(self.low[:2], self.high[:2], strict=True)
        )
        places = np.array([[u, v, 0.0] for u in x for v in y])
        places[:, 2] = height_of(self.level, places)
        local = frame.world_from_camera.inverse.apply(places)
        off_axis = np.hypot(local[:, 0], local[:, 1]) / np.maximum(local[:, 2], 1e-6)
        off_axis[local[:, 2] < tuned(Params).nearest_m] = np.inf
        for place in np.argsort(off_axis)[: tuned(Params).places]:
            if offset := support_offset(scene, frame, places[place][2], places[place]):
                return offset
        return 0.0


def gather_cloud(scene: Scene, region: Region, size_m: float) -> DepthCloud:
    """Surface voxels of a region that enough frames agree on."""
    params = tuned(Params)
    views = _views_of(scene, region, params.frames)
    keys, sums = [], []
    shape = np.ceil((region.high - region.low) / size_m).astype(int) + 1
    for frame in views:
        points, lab = _points_in(scene, frame, region)
        flat = np.ravel_multi_index(tuple(np.floor((points - region.low) / size_m).astype(int).T), tuple(shape))
        unique, member = np.unique(flat, return_inverse=True)
        columns = [np.bincount(member, values, len(unique)) for values in (*points.T, *lab.T)]
        count = np.bincount(member, minlength=len(unique))
        keys.append(unique)
        sums.append(np.column_stack([*(column / count for column in columns), np.ones(len(unique))]))
    if not keys:
        return DepthCloud(region.low, size_m, np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    unique, member = np.unique(np.concatenate(keys), return_inverse=True)
    rows = np.concatenate(sums)
    total = np.column_stack([np.bincount(member, rows[:, k], len(unique)) for k in range(7)])
    hits = total[:, 6]
    mean = total[:, :6] / hits[:, None]
    cells = np.column_stack(np.unravel_index(unique, tuple(shape)))
    through = _seen_through(scene, views, region, mean[:, :3])
    kept = (hits >= params.least_hits) & (hits >= params.agreed * (hits + through))
    return DepthCloud(region.low, size_m, cells[kept], mean[kept, :3], mean[kept, 3:], hits[kept])


def clean_depth(depth: DepthMetres) -> DepthMetres:
    """Depth without the far side of its steps, where near and far surface mix; 0 there."""
    params = tuned(Params)
    near = cv2.erode(np.where(depth > 0, depth, 99.0).astype(np.float32), np.ones((3, 3), np.uint8))
    far = cv2.dilate(depth, np.ones((3, 3), np.uint8))
    step = far - near
    sure = (step < params.edge_step * near) | (depth - near < params.near_side * step)
    return np.where((depth > 0) & sure, depth, 0.0).astype(np.float32)


def _points_in(scene: Scene, frame: Frame, region: Region) -> tuple[Points, np.ndarray]:
    """World points (n, 3) of a frame's depth in the region, and their Lab colours."""
    camera = frame.depth_camera
    step = max(1, round(camera.height / tuned(Params).most_rows))
    depth = clean_depth(scene.depth(frame.index))[::step, ::step]
    world = frame.world_from_camera.apply(depth_points(scene.depth(frame.index), camera)[::step, ::step].reshape(-1, 3))
    world = raised(world, -region.lift(scene, frame))
    inside = region.holds(world) & (depth.ravel() > 0)
    small = cv2.resize(scene.balanced(frame.index), (camera.width, camera.height), interpolation=cv2.INTER_AREA)[::step, ::step]
    lab = cv2.cvtColor(np.ascontiguousarray(small), cv2.COLOR_RGB2LAB).reshape(-1, 3)
    return world[inside], lab[inside].astype(np.float32)


def _seen_through(scene: Scene, views: list[Frame], region: Region, points: Points) -> np.ndarray:
    """Number of frames whose depth lies clearly behind each point."""
    count = np.zeros(len(points))
    for frame in views:
        lifted, depth = raised(points, region.lift(scene, frame)), clean_depth(scene.depth(frame.index))
        z, seen, _ = look_up(lifted, frame.world_from_camera, frame.depth_camera, depth)
        count += scene.noise.seen_through(seen, z, tuned(Params).through_m)
    return count


def _views_of(scene: Scene, region: Region, most: int) -> list[Frame]:
    """Sharpest frame of each of up to `most` stretches of the recording, among those looking into the region's inner half."""
    middle, half = (region.low + region.high) / 2, (region.high - region.low) / 4
    corners = middle + half * np.array([[0, 0, 0], *np.stack(np.meshgrid(*[[-1, 1]] * 3), axis=-1).reshape(-1, 3)])
    shown = np.zeros(len(scene.frames), bool)
    for corner in corners:
        for number, (frame, local) in enumerate(zip(scene.frames, scene.seen_from_all(corner), strict=True)):
            if local[2] > tuned(Params).nearest_m:
                u, v = project(local, frame.rgb_camera)
                shown[number] |= 0 < u < frame.rgb_camera.width and 0 < v < frame.rgb_camera.height
    seeing = np.flatnonzero(shown)
    groups = np.array_split(seeing, min(most, len(seeing))) if len(seeing) else []
    return [max((scene.frames[i] for i in group), key=lambda frame: frame.sharpness) for group in groups]
