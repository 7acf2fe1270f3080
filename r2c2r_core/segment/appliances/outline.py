"""Where an appliance ends, by colour: its top and its back against what stands behind it.

Depth runs from a body's back into the wall close behind, and its front may show lines that are clearer than its own upper
edge. But its outline is an edge in every photograph, from wherever it is taken, while what lies inside or behind moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Points
from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.fronts.front import Front, front_middle
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How an appliance's top and back are found by colour."""

    samples: int = param(48, "count", "along an edge", ge=4)
    normal_px: float = param(1.5, "px", "half the distance over which colours beside an edge are compared", gt=0)
    least_sight: float = param(0.08, "ratio", "to the distance, that a camera must stand beyond a face's plane to see the face")
    least_shift_px: float = param(6.0, "px", "by which an edge must move over the range: else the frame cannot tell")
    least_frames: int = param(4, "count", "that tell")
    top_clear: float = param(
        2.5, "ratio", "to the usual contrast at other places, of a top", source="a white oven before a white wall has no edge"
    )
    back_clear: float = param(3.0, "ratio", "to the usual contrast at other places, of a back")
    peak_share: float = param(0.8, "share", "of the highest contrast: places as good as it")
    top_peak_m: float = param(0.014, "m", "how far such places may lie from a top")
    back_peak_m: float = param(0.045, "m", "how far such places may lie from a back", source="it is seen at a slant")
    most_contrast: float = param(15.0, "ratio", "of one frame to its usual")
    frames: int = param(16, "count", "that are looked at", ge=1)
    top_reach_m: float = param(0.06, "m", "above and below the cut, where the top is looked for")
    top_step_m: float = param(0.003, "m", "between heights that are looked at", gt=0)
    depth_step_m: float = param(0.004, "m", "between depths that are looked at", gt=0)
    depth_range: tuple[float, float] = param((0.6, 1.4), "ratio", "to the usual depth, least and most")
    hidden_m: float = param(0.05, "m", "nearer by more, beyond its noise, depth belongs to something in front")


class Photo(NamedTuple):
    """A frame in which the body stands."""

    lab: Image
    camera: Intrinsics
    depth_m: DepthMetres  # of the same view; 0 where unknown
    world_from_camera: Rigid3
    noise: DepthNoise


class Body(NamedTuple):
    """An upright box behind a front rectangle. Frame: the front's, +X right, +Y back, +Z up, origin on the front face."""

    world_from_front: Rigid3
    half_width_m: float
    bottom_m: float
    top_m: float
    depth_m: float


def body_of(front: Front) -> Body:
    """The box behind a front."""
    grid, cell = front.run.grid, front.cell
    half_height = cell.height * grid.cell_m / 2
    world_from_front = Rigid3(grid.world_from_plane.rotation, front_middle(front))
    return Body(world_from_front, cell.width * grid.cell_m / 2, -half_height, half_height, front.depth_m)


def photos_of(front: Front, scene: Scene) -> list[Photo]:
    """Frames that show the middle of a front, from many directions."""
    params = tuned(Params)
    return [_photo(scene, frame) for frame in best_views(scene, front_middle(front), params.frames)]


def outlined(front: Front, photos: Sequence[Photo], usual_m: float, wall_m: float | None) -> tuple[Front, bool]:
    """The front with its upper edge and its depth at their colour edges, where those are clear; and whether the depth was."""
    params = tuned(Params)
    body = body_of(front)
    half_height = body.top_m
    farthest = min(params.depth_range[1] * usual_m, np.inf if wall_m is None else wall_m)
    depths = np.arange(params.depth_range[0] * usual_m, farthest, params.depth_step_m)
    body, clear = outlined_body(
        body, photos, half_height + np.arange(-params.top_reach_m, params.top_reach_m, params.top_step_m), depths
    )
    cell = front.cell
    moved = replace(cell, top=cell.top - (body.top_m - half_height) / front.run.grid.cell_m)
    return replace(front, cell=moved, depth_m=body.depth_m), clear


def outlined_body(body: Body, photos: Sequence[Photo], tops_m: np.ndarray, depths_m: np.ndarray) -> tuple[Body, bool]:
    """The body with the best of the tops and depths, as it was where none is clear; and whether the depth was.

    Twice, for where one is looked for depends on the other.
    """
    clear = False
    for _ in range(2):
        top = best_top(body, photos, tops_m)
        body = body if top is None else body._replace(top_m=top)
        depth = best_depth(body, photos, depths_m)
        body = body if depth is None else body._replace(depth_m=depth)
        clear = depth is not None
    return body, clear


def _photo(scene: Scene, frame: Frame) -> Photo:
    lab = cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB)
    return Photo(lab, frame.rgb_camera, scene.filled_depth(frame.index), frame.world_from_camera, scene.noise)


def best_depth(body: Body, photos: Sequence[Photo], depths_m: np.ndarray) -> float | None:
    """The depth at which the edges of the back lie on colour edges; None where no frame or no edge tells."""
    params = tuned(Params)
    contrasts = [_contrasts(photo, _back_edges(body, photo, depths_m)) for photo in photos]
    return _clearest(contrasts, depths_m, params.back_clear, params.back_peak_m)


def best_top(body: Body, photos: Sequence[Photo], tops_m: np.ndarray) -> float | None:
    """The height at which the edges of the top lie on colour edges; None where no frame or no edge tells."""
    params = tuned(Params)
    contrasts = [_contrasts(photo, _top_edges(body, photo, tops_m)) for photo in photos]
    return _clearest(contrasts, tops_m, params.top_clear, params.top_peak_m)


def _back_edges(body: Body, photo: Photo, depths_m: np.ndarray) -> list[Points]:
    """The visible edges of the back at every depth: (candidates, samples, 3), world."""
    params = tuned(Params)
    eye = _eye(body, photo)
    along = (np.arange(params.samples) + 0.5) / params.samples
    edges = []
    reach = params.least_sight * float(np.linalg.norm(eye))
    for sign in (-1.0, 1.0):
        if sign * eye[0] - body.half_width_m > reach:
            z = body.bottom_m + (0.15 + 0.85 * along) * (body.top_m - body.bottom_m)  # the foot lies in shadow
            edges.append(_line(body, sign * body.half_width_m, depths_m[:, None], z[None]))
    if eye[2] - body.top_m > reach:
        x = (2 * along - 1) * body.half_width_m
        edges.append(_line(body, x[None], depths_m[:, None], body.top_m))
    return edges


def _top_edges(body: Body, photo: Photo, tops_m: np.ndarray) -> list[Points]:
    """The edges of the top that are its outline, at every height: the front one from below, else the back and the sides'."""
    params = tuned(Params)
    eye = _eye(body, photo)
    along = (np.arange(params.samples) + 0.5) / params.samples
    x, y = (2 * along - 1) * body.half_width_m, along * body.depth_m
    reach = params.least_sight * float(np.linalg.norm(eye))
    from_above = eye[2] > body.top_m
    edges = [_line(body, x[None], body.depth_m if from_above else 0.0, tops_m[:, None])]
    for sign in (-1.0, 1.0):
        if sign * eye[0] - body.half_width_m > reach or from_above:
            edges.append(_line(body, sign * body.half_width_m, y[None], tops_m[:, None]))
    return edges


def _eye(body: Body, photo: Photo) -> np.ndarray:
    return body.world_from_front.inverse.apply(photo.world_from_camera.translation[None])[0]


def _line(body: Body, x: np.ndarray | float, y: np.ndarray | float, z: np.ndarray | float) -> Points:
    local = np.stack(np.broadcast_arrays(x, y, z), axis=-1).astype(np.float64)
    return body.world_from_front.apply(local.reshape(-1, 3)).reshape(local.shape)


def _contrasts(photo: Photo, edges: list[Points]) -> np.ndarray | None:
    """The mean contrast across the edges for every candidate; None where the frame cannot tell them apart."""
    found = [contrast for edge in edges if (contrast := _contrast(photo, edge)) is not None]
    return np.mean(found, axis=0) if found else None


def _contrast(photo: Photo, edge: Points) -> np.ndarray | None:
    params = tuned(Params)
    in_camera = photo.world_from_camera.inverse.apply(edge.reshape(-1, 3))
    if in_camera[:, 2].min() < 0.1:
        return None
    uv = project(in_camera, photo.camera).reshape(*edge.shape[:2], 2)
    shift = np.linalg.norm(uv[-1] - uv[0], axis=1)
    inside = (uv > 4).all(axis=2) & (uv < [photo.camera.width - 4, photo.camera.height - 4]).all(axis=2)
    inside &= ~hidden(photo, uv, in_camera[:, 2].reshape(inside.shape))
    if np.median(shift) < params.least_shift_px or inside.mean() < 0.7:
        return None
    direction = uv[:, -1] - uv[:, 0]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)[:, None] * params.normal_px
    sides = [_colours_at(photo.lab, uv + sign * normal) for sign in (-1.0, 1.0)]
    difference = np.linalg.norm(sides[1] - sides[0], axis=2)
    return np.asarray(np.where(inside, np.minimum(difference, 60.0), 0.0).sum(axis=1) / np.maximum(inside.sum(axis=1), 1))


def hidden(photo: Photo, uv_px: np.ndarray, z_m: np.ndarray) -> np.ndarray:
    """Whether the photo's depth shows something in front of each point."""
    rows, columns = photo.depth_m.shape
    row = np.clip(uv_px[..., 1] * rows / photo.camera.height, 0, rows - 1).astype(int)
    column = np.clip(uv_px[..., 0] * columns / photo.camera.width, 0, columns - 1).astype(int)
    seen = photo.depth_m[row, column]
    return photo.noise.occluded(seen, z_m, tuned(Params).hidden_m)


def _colours_at(lab: Image, uv_px: np.ndarray) -> np.ndarray:
    x, y = (np.ascontiguousarray(uv_px[..., k] - 0.5, dtype=np.float32) for k in (0, 1))
    return np.asarray(cv2.remap(lab, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32)


def _clearest(contrasts: list[np.ndarray | None], values_m: np.ndarray, clear: float, widest_m: float) -> float | None:
    """The value of the highest mean contrast over the frames, each by its own usual contrast; None for a blunt peak."""
    params = tuned(Params)
    known = np.array([row / max(float(np.median(row)), 2.0) for row in contrasts if row is not None])
    if len(known) < params.least_frames:
        return None
    mean = np.minimum(known, params.most_contrast).mean(axis=0)
    best = int(np.argmax(mean))
    rivals = np.abs(values_m[mean > params.peak_share * mean[best]] - values_m[best])
    if mean[best] < clear * np.median(mean) or rivals.max() > widest_m or best in (0, len(values_m) - 1):
        return None
    a, b, c = mean[best - 1 : best + 2]
    bend = a - 2 * b + c
    return float(values_m[best] + (0.5 * (a - c) / bend if bend < 0 else 0.0) * (values_m[1] - values_m[0]))
