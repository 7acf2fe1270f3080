"""View selection: sharp, near frames in which a point is unoccluded, spread over directions."""

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.camera import project
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene

_HIDDEN_M = 0.08  # maximum distance of a visible click behind the frame's depth: handles, glass


def best_views(scene: Scene, point: Vector3, count: int) -> list[Frame]:
    """Frames in which the point is unoccluded, spread over viewing directions."""
    rated: list[tuple[float, Frame, float]] = []
    for frame, local in zip(scene.frames, scene.seen_from_all(point), strict=True):
        camera = frame.rgb_camera
        if local[2] < 0.2:
            continue
        u, v = project(local, camera)
        margin = 0.04 * camera.width
        if not (margin < u < camera.width - margin and margin < v < camera.height - margin):
            continue
        seen = scene.filled_depth(frame.index)
        row, column = int(v * seen.shape[0] / camera.height), int(u * seen.shape[1] / camera.width)
        if scene.noise.occluded(seen[row, column], local[2], _HIDDEN_M):
            continue
        away = point - frame.world_from_camera.translation
        rated.append((float(np.sqrt(max(frame.sharpness, 1e-3)) / local[2]), frame, float(np.arctan2(away[1], away[0]))))
    if not rated:
        return []
    middle = np.angle(np.exp(1j * np.array([yaw for _, _, yaw in rated])).mean())
    bins: dict[int, list[tuple[float, Frame]]] = {}
    for score, frame, yaw in rated:
        bins.setdefault(round(float(np.angle(np.exp(1j * (yaw - middle)))) / np.radians(8)), []).append((score, frame))
    per_bin = max(2, -(-count // len(bins)))
    chosen = [item for _, items in sorted(bins.items()) for item in sorted(items, key=lambda item: -item[0])[:per_bin]]
    return [frame for _, frame in sorted(chosen, key=lambda item: -item[0])[: count + 4]]
