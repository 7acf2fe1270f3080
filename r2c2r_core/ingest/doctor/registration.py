"""Registration check of depth against colour, by the distance of depth discontinuities to image edges.

Discontinuities are projected into the colour image under other focal lengths, principal points and sideways camera shifts;
the calibration that brings them nearest to image edges is compared with the given one. On the 7-Scenes
kitchen, whose raw depth is not registered, this finds 526 px and 32 mm where 585 px and 0 mm are assumed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image
from r2c2r_core.geometry.camera import Intrinsics, pixel_rays
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.tuning import param, tuned

WIDTH = 640  # px across the colour image's longer side, at which distances are given


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the registration check."""

    far_px: float = param(6.0, "px", "Truncation of the distance to an image edge, in pixels of a 640 px wide image", gt=0)
    points: int = param(500, "count", "Maximum number of depth edge points of a frame", ge=1)
    least: tuple[int, int] = param((60, 5), "count", "Minimum number of edge points of a frame, and of such frames")
    limit_px: float = param(
        2.0,
        "px",
        "Minimum mean offset to report, in pixels of a 640 px wide image",
        source="the gap between two fronts is about as wide",
    )
    gain: float = param(
        0.15,
        "share",
        "Minimum relative reduction of the edge distance for another calibration to be accepted",
        source="good recordings gain up to 0.12 by chance",
    )
    fits_px: float = param(
        3.0,
        "px",
        "Maximum edge distance of an accepted fit, in pixels of a 640 px wide image",
        source="random points: 3.5 px and more",
    )
    near_m: tuple[float, float] = param((0.3, 3.0), "m", "Range of depths of edges used")
    jump: tuple[float, float] = param((0.1, 0.03), "m", "Minimum depth step of an edge: at 0 m, and increase per metre")


@dataclass(frozen=True, slots=True, kw_only=True)
class Registration:
    """Registration of the depth images to the colour images."""

    edge_px: float  # mean distance of depth edges to image edges as calibrated, cut off at 6 px of 640
    edge_best_px: float  # and under the calibration that fits best
    off_px: float  # how far depth pixels move, on average, from the given calibration to the best, in px of 640
    limit_px: float  # largest negligible offset: 2 px, or a pixel of the depth image where that is larger
    focal_factor: float  # best focal length over the given one
    shift_px: tuple[float, float]  # of the principal point
    shift_mm: tuple[float, float]  # of the colour camera, right and down
    focal_only: bool  # the focal length alone explains nearly all of it

    @property
    def wrong(self) -> bool:
        """Whether the given calibration is clearly wrong and the best one fits well."""
        params, gain = tuned(Params), self.edge_px - self.edge_best_px
        clear = gain > params.gain * self.edge_px and self.edge_best_px < params.fits_px
        return self.off_px > self.limit_px and clear


class _Edges(NamedTuple):
    """One frame's depth edge points as normalised rays with depth, and each pixel's distance to an image edge."""

    ray: np.ndarray  # (n, 2) x/z, y/z
    z: np.ndarray  # (n,)
    distance_px: np.ndarray  # (h, w), at most `far_px`
    camera: Intrinsics  # colour, of the scaled image


def measure_registration(frames: Sequence[Frame], images: FrameImages, rng: np.random.Generator) -> Registration | None:
    """Registration of depth to colour over these frames; None with too few depth edges."""
    edges = [e for f in frames if (e := _edges(f, images.rgb(f.index), images.depth(f.index).metres, rng)) is not None]
    if len(edges) < tuned(Params).least[1]:
        return None
    stack = _stacked(edges)
    best = _minimise(stack, _FULL)
    given, reached = (float(_distances(stack, p[None]).mean()) for p in (_GIVEN, best))
    off_px = float(np.linalg.norm(_projected(stack, best[None]) - _projected(stack, _GIVEN[None]), axis=-1).mean())
    limit_px = max(tuned(Params).limit_px, WIDTH / max(frames[0].depth_camera.width, frames[0].depth_camera.height))
    focal = _minimise(stack, _FOCAL) if off_px > limit_px else best
    return Registration(
        edge_px=given,
        edge_best_px=reached,
        off_px=off_px,
        limit_px=limit_px,
        focal_factor=float(best[0]),
        shift_px=(float(best[1] * WIDTH), float(best[2] * WIDTH)),
        shift_mm=(float(1000 * best[3]), float(1000 * best[4])),
        focal_only=bool(given - float(_distances(stack, focal[None]).mean()) > 0.8 * (given - reached)),
    )


# Parameters: focal factor, principal point's shift over WIDTH, the camera's shift in metres
_GIVEN = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
_FULL = np.array([0.05, 0.01, 0.01, 0.015, 0.015])  # size of the first simplex
_FOCAL = np.array([0.05, 0.0, 0.0, 0.0, 0.0])


class _Stack(NamedTuple):
    ray: np.ndarray  # (n, 2)
    z: np.ndarray  # (n,)
    frame: np.ndarray  # (n,)
    focal: np.ndarray  # (n, 2)
    centre: np.ndarray  # (n, 2)
    distance_px: np.ndarray  # (frames, h, w)


def _stacked(edges: list[_Edges]) -> _Stack:
    counts = [len(e.z) for e in edges]
    return _Stack(
        ray=np.concatenate([e.ray for e in edges]),
        z=np.concatenate([e.z for e in edges]),
        frame=np.repeat(np.arange(len(edges)), counts),
        focal=np.repeat([[e.camera.fx, e.camera.fy] for e in edges], counts, axis=0),
        centre=np.repeat([[e.camera.cx, e.camera.cy] for e in edges], counts, axis=0),
        distance_px=np.stack([e.distance_px for e in edges]),
    )


def _projected(stack: _Stack, parameters: np.ndarray) -> np.ndarray:
    """Pixels (k, n, 2) of the edge points under k sets of parameters."""
    focal, shift, camera = parameters[:, :1, None], parameters[:, None, 1:3] * WIDTH, parameters[:, None, 3:]
    return np.asarray(stack.focal * focal * (stack.ray + camera / stack.z[:, None]) + stack.centre + shift)


def _distances(stack: _Stack, parameters: np.ndarray) -> np.ndarray:
    """Distance (k, n) in pixels of the edge points to image edges."""
    uv = _projected(stack, parameters)
    rows, columns = stack.distance_px.shape[1:]
    u, v = uv[..., 0], uv[..., 1]
    inside = (u >= 0) & (v >= 0) & (u < columns) & (v < rows)
    column, row = np.where(inside, u, 0).astype(np.int64), np.where(inside, v, 0).astype(np.int64)
    return np.where(inside, stack.distance_px[stack.frame, row, column], tuned(Params).far_px)


def _minimise(stack: _Stack, step: np.ndarray) -> np.ndarray:
    """Parameters that minimise edge distance: a coarse scan of focal length and sideways shift, then Nelder-Mead."""
    from scipy.optimize import minimize

    free = np.flatnonzero(step)
    thin = stack._replace(**{name: getattr(stack, name)[::4] for name in ("ray", "z", "frame", "focal", "centre")})
    starts = _starts(step)
    costs = np.concatenate([_distances(thin, chunk).mean(axis=1) for chunk in np.array_split(starts, max(1, len(starts) // 8))])
    best, least = _GIVEN, float(_distances(stack, _GIVEN[None]).mean())
    for start in (_GIVEN, *starts[np.argsort(costs)[:2]]):
        simplex = np.vstack([start[free], start[free] + np.diag(step[free])])

        def cost(x: np.ndarray, start: np.ndarray = start) -> float:
            parameters = start.copy()
            parameters[free] = x
            return float(_distances(stack, parameters[None]).mean())

        found = minimize(cost, start[free], method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": 150})
        if found.fun < least:
            best, least = start.copy(), float(found.fun)
            best[free] = found.x
    return best


def _starts(step: np.ndarray) -> np.ndarray:
    focals = np.linspace(0.84, 1.16, 9)
    sideways = np.linspace(-0.05, 0.05, 6) if step[3] else np.zeros(1)
    grid = np.array([(f, 0.0, 0.0, x, y) for f in focals for x in sideways for y in sideways])
    return np.asarray(grid)


def _edges(frame: Frame, rgb: Image, depth_m: DepthMetres, rng: np.random.Generator) -> _Edges | None:
    ray, z = _depth_edges(depth_m, frame.depth_camera)
    if len(z) < tuned(Params).least[0]:
        return None
    taken = rng.permutation(len(z))[: tuned(Params).points]
    scale = WIDTH / max(rgb.shape[:2])
    camera = frame.rgb_camera.resized(round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
    small = cv2.resize(rgb, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return _Edges(ray[taken], z[taken], _edge_distance(small), camera)


def _depth_edges(depth_m: DepthMetres, camera: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """(x/z and y/z (n, 2), near depth (n,)) of borders between neighbouring pixels with a depth discontinuity.

    Up to three unknown pixels between the two sides are bridged, as ingest has removed mixed depth there.
    """
    (least, more), (nearest, farthest) = tuned(Params).jump, tuned(Params).near_m
    rays, depths = [], []
    for axis in (0, 1):
        for apart in (1, 2, 3, 4):
            here, there = (np.take(depth_m, np.arange(s, depth_m.shape[axis] - apart + s), axis=axis) for s in (0, apart))
            known = (here > 0) & (there > 0)
            for k in range(1, apart):
                known &= np.take(depth_m, np.arange(k, depth_m.shape[axis] - apart + k), axis=axis) == 0
            near = np.minimum(here, there)
            jump = known & (np.abs(here - there) > least + more * near) & (near > nearest) & (near < farthest)
            row, column = np.nonzero(jump)
            border = np.stack([column + 0.5, row + 0.5], axis=1)
            border[:, 1 - axis] += apart / 2
            rays.append(pixel_rays(border, camera)[:, :2])
            depths.append(near[jump])
    return np.concatenate(rays), np.concatenate(depths)


def _edge_distance(rgb: Image) -> np.ndarray:
    """Distance (h, w) to the nearest edge of brightness or hue, px, at most `far_px`."""
    lab = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB), (0, 0), 1.2)
    edge = np.zeros(rgb.shape[:2], dtype=bool)
    for channel, (low, high) in enumerate(((30, 80), (25, 60), (25, 60))):
        edge |= cv2.Canny(np.ascontiguousarray(lab[..., channel]), low, high) > 0
    distance = cv2.distanceTransform((~edge).astype(np.uint8), cv2.DIST_L2, 5)
    return np.minimum(distance, np.float32(tuned(Params).far_px))
