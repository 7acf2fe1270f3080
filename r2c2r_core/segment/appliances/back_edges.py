"""How deep an appliance is, by the edge in the photographs at which its sides end: depth alone smears across the gap behind."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.fronts.front import Front, side_corners, side_faces
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

_SIDES = ("left", "right", "top")


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How the edge is found at which an appliance's sides end."""

    before_m: float = param(0.09, "m", "before the depth that the surface gave, where the search begins")
    beyond_m: float = param(0.05, "m", "beyond that depth, where it ends")
    step_m: float = param(0.0015, "m", "between depths that are looked at", gt=0)
    rows: int = param(48, "count", "heights that are read of a side", ge=2)
    own_m: float = param(0.03, "m", "at the near end of the search: the side itself, which says how much its colour varies")
    onset: float = param(2.5, "ratio", "of a change of colour to the side's own, where an edge begins")
    least_step: float = param(0.16, "colour", "CIELAB units a step, of an edge")
    clear: float = param(3.0, "ratio", "of an edge's peak to where it begins")
    stays_m: float = param(0.004, "m", "what rises for less is a speck")
    rise_m: float = param(
        0.012, "m", "from where an edge begins to show to its steepest: blur, and views that disagree by their poses' errors"
    )
    on_side_m: float = param(0.04, "m", "off the side, within which depth is the side's")
    flattest: float = param(0.15, "cosine", "at which a side is still read")
    farthest_m: float = param(3.2, "m", "from the camera, at which a side is still read")
    least_rows: int = param(5, "count", "of a frame that tell")
    least_frames: int = param(3, "count", "that tell")
    most_frames: int = param(16, "count", "that are read", ge=1)


def depth_at_back_edge(front: Front, scene: Scene, about_m: float, limit_m: float) -> float | None:
    """Metres from the front to where a seen side ends in the photographs; None where no side shows a clear end.

    Looked for within some centimetres of `about_m` and not beyond `limit_m`. Behind the edge lies what the side hides: its
    shadow or the wall, the same in every view; the first lasting change of colour along the side is the edge.
    """
    params = tuned(Params)
    depths = np.arange(max(about_m - params.before_m, 0.06), min(about_m + params.beyond_m, limit_m), params.step_m)
    if len(depths) < 3 * params.own_m / params.step_m:
        return None
    found = [edge for side in _SIDES if (edge := _edge(front, scene, side, depths)) is not None]
    return max(found)[1] if found else None


def _edge(front: Front, scene: Scene, side: str, depths: np.ndarray) -> tuple[float, float] | None:
    """How clear the end of a side is, and its depth."""
    params = tuned(Params)
    points = _points(front, side, depths)
    profiles = list(_profiles(front, scene, side, points))
    if len(profiles) < params.least_frames:
        return None
    change = np.median([np.linalg.norm(np.diff(profile, axis=0), axis=1) for profile in profiles], axis=0)
    change = cv2.GaussianBlur(change[None].astype(np.float32), (0, 0), 1.2)[0]
    own = float(np.median(change[: round(params.own_m / params.step_m)]))
    high = change > max(params.onset * own, params.least_step)
    stays = np.convolve(high, np.ones(round(params.stays_m / params.step_m) + 1), mode="valid") > params.stays_m / params.step_m
    clear = float(change.max()) / max(own, params.least_step / params.onset)
    if not stays.any() or clear < params.clear:
        return None
    onset = int(np.argmax(stays))
    peak = onset + int(np.argmax(change[onset : onset + round(params.rise_m / params.step_m)]))
    return clear, float(depths[(onset + peak) // 2 + 1])


def _points(front: Front, side: str, depths: np.ndarray) -> Points:
    """World points (rows, depths, 3) on a side's plane."""
    first, second = side_corners(front.cell, front.run.grid, (0.0, 0.0), side, 1.0)[:2]
    along = np.linspace(0.04, 0.96, tuned(Params).rows)[:, None, None]
    return np.asarray(first + along * (second - first) - depths[None, :, None] * front.run.grid.outward)


def _profiles(front: Front, scene: Scene, side: str, points: Points) -> Iterator[np.ndarray]:
    """Median colour (CIELAB) along the depth, from each of the frames that see the side best."""
    params = tuned(Params)
    centre, normal = points.reshape(-1, 3).mean(axis=0), _normal(points)
    rated = []
    for frame in scene.frames:
        towards = frame.world_from_camera.translation - centre
        away = float(np.linalg.norm(towards))
        flat = abs(float(towards @ normal)) / away
        if (
            flat > params.flattest
            and away < params.farthest_m
            and side_faces(front.cell, front.run.grid, side, centre + towards)
        ):
            rated.append((flat / away, frame.index))
    read = 0
    for _, index in sorted(rated, reverse=True):
        profile = _profile(scene, scene.frame(index), points)
        if profile is not None:
            yield profile
            read += 1
        if read == params.most_frames:
            return


def _profile(scene: Scene, frame: Frame, points: Points) -> np.ndarray | None:
    """Colours (depths, 3) along a side in one frame, over the rows that it sees whole and unhidden."""
    params = tuned(Params)
    camera, sensor = frame.rgb_camera, frame.depth_camera
    local = frame.world_from_camera.inverse.apply(points.reshape(-1, 3))
    if local[:, 2].min() < 0.2:
        return None
    uv, z = project(local, camera).reshape(*points.shape[:2], 2), local[:, 2].reshape(points.shape[:2])
    inside = ((uv > 1) & (uv < [camera.width - 2, camera.height - 2])).all(axis=(1, 2))
    if inside.sum() < params.least_rows:
        return None
    uv, z = uv[inside], z[inside]
    read, known = sample_nearest(scene.depth(frame.index), project(local, sensor))
    depth = np.where(known, read, 0.0).reshape(points.shape[:2])[inside]
    near_end = np.abs(depth - z)[:, : round(params.own_m / params.step_m)] < params.on_side_m
    hidden = (depth > 0) & (depth < z - params.on_side_m)
    shown = (near_end.mean(axis=1) > 0.6) & ~hidden.any(axis=1)
    if shown.sum() < params.least_rows:
        return None
    rows = uv[shown].astype(np.float32) - 0.5
    rgb = cv2.remap(scene.rgb(frame.index), rows[..., 0], rows[..., 1], cv2.INTER_LINEAR)
    return np.asarray(np.median(cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB), axis=0))


def _normal(points: Points) -> Vector3:
    normal = np.cross(points[-1, 0] - points[0, 0], points[0, -1] - points[0, 0])
    return np.asarray(normal / np.linalg.norm(normal))
