"""Click selection: the frame that shows a proposal best, and the pixel there to click."""

from collections.abc import Iterator

import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.geometry.camera import project
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.proposals.clutter import Clump
from r2c2r_core.segment.proposals.panels import Panel
from r2c2r_core.segment.scene import Scene

_SPREAD = (0.5, 0.35, 0.65, 0.2, 0.8)


_VIEWS = 5  # maximum number of frames compared for the best view of an object


def best_views(scene: Scene, corners: Points, outward: Vector3) -> list[Frame]:
    """Frames expected to show a rectangle large, whole and sharp, best first."""
    rated = []
    centre = corners.mean(axis=0)
    for frame in scene.frames:
        local = frame.world_from_camera.inverse.apply(np.vstack([corners, centre]))
        if local[:, 2].min() < 0.15:
            continue
        camera = frame.rgb_camera
        uv = project(local, camera)
        size = np.array([camera.width, camera.height])
        if not ((uv[-1] > 0) & (uv[-1] < size)).all():
            continue
        inside = np.clip(uv[:4], 0, size)
        x, y = inside.T
        area = 0.5 * abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
        whole = float(((uv[:4] >= 0) & (uv[:4] <= size)).all(axis=1).mean())
        away = frame.world_from_camera.translation - centre
        facing = float(away @ outward) / float(np.linalg.norm(away))
        if facing > 0.15:
            rated.append((area * (0.2 + 0.8 * whole) ** 2 * facing * np.sqrt(max(frame.sharpness, 1e-3)), frame))
    return [frame for _, frame in sorted(rated, key=lambda view: (-view[0], view[1].index))[:_VIEWS]]


def panel_clicks(scene: Scene, panel: Panel, frame: Frame, mask: Mask) -> Iterator[PromptPoint]:
    """Clicks in a frame on unoccluded parts of the panel's plane, off its handle, from the centre outwards."""
    cell, handle, grid = panel.front.cell, panel.front.handle, panel.run.grid
    steps = sorted(((u, v) for u in _SPREAD for v in _SPREAD), key=lambda at: abs(at[0] - 0.5) + abs(at[1] - 0.5))
    slide = np.array(panel.run.slide_of(frame.index, scene))
    for u, v in steps:
        at = np.array([cell.left + u * cell.width, cell.top + v * cell.height])
        if handle is not None and _on_handle(at, handle.left, handle.top, handle.right, handle.bottom, 0.02 / grid.cell_m):
            continue
        click = _click_in(scene, grid.points_at((at - slide)[None])[0], frame)
        if click is not None and mask[int(click.y), int(click.x)]:
            yield click


def click_on(scene: Scene, point: Vector3, outward: Vector3) -> PromptPoint | None:
    """Click on a point of a plane, in the frame that shows its surroundings best."""
    up = np.array([0.0, 0.0, 1.0])
    right = np.cross(outward, up)
    corners = point + 0.1 * np.array([right + up, up - right, -right - up, right - up])
    clicks = (_click_in(scene, point, frame) for frame in best_views(scene, corners, outward))
    return next((click for click in clicks if click is not None), None)


def clump_clicks(scene: Scene, clump: Clump) -> Iterator[PromptPoint]:
    """Clicks on a cluster's observed surface in the three frames that show most of it."""
    rated = []
    for frame in scene.frames:
        local = frame.world_from_camera.inverse.apply(clump.points)
        if local[:, 2].min() < 0.2:
            continue
        uv, camera = project(local, frame.rgb_camera), frame.rgb_camera
        inside = ((uv > 4) & (uv < np.array([camera.width, camera.height]) - 4)).all(axis=1).mean()
        rated.append((float(inside) ** 4 * np.sqrt(max(frame.sharpness, 1e-3)) / float(local[:, 2].mean()) ** 2, frame))
    middle = np.median(clump.points, axis=0)
    nearest = clump.points[np.argsort(np.linalg.norm(clump.points - middle, axis=1))]
    for _, frame in sorted(rated, key=lambda view: (-view[0], view[1].index))[:3]:
        towards = (frame.world_from_camera.translation - middle) @ (nearest - middle).T
        for point in nearest[towards >= 0][:: max(1, len(nearest) // 12)][:6]:
            click = _click_in(scene, point, frame)
            if click is not None:
                yield click
                break


def _click_in(scene: Scene, point: Vector3, frame: Frame) -> PromptPoint | None:
    """Pixel of a world point, when the frame observes it there."""
    local = frame.world_from_camera.inverse.apply(point[None])
    camera = frame.rgb_camera
    if local[0, 2] < 0.1:
        return None
    u, v = (float(value) for value in project(local, camera)[0])
    if not (1 <= u < camera.width - 1 and 1 <= v < camera.height - 1):
        return None
    hit = scene.pick(frame.index, u, v)
    if hit is None or np.linalg.norm(hit - point) > 0.05 + 0.02 * local[0, 2]:
        return None
    return PromptPoint(frame=frame.index, x=round(u, 1), y=round(v, 1), label=1)


def _on_handle(at: np.ndarray, left: float, top: float, right: float, bottom: float, margin: float) -> bool:
    return bool(left - margin < at[0] < right + margin and top - margin < at[1] < bottom + margin)
