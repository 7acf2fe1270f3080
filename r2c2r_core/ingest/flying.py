"""Flying pixels that several frames agree on: nothing else stands where they hang, and others look right through them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Mask
from r2c2r_core.geometry.camera import project, sample_nearest, unproject
from r2c2r_core.ingest.store import write_depth
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned

_KEPT = 40  # depth images in memory


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Which depth pixels hang in the air."""

    judges: int = param(6, "count", "frames that judge one", ge=1)
    longest_away: int = param(60, "count", "frames from one to its judges")
    least_apart_m: float = param(0.04, "m", "between cameras", source="nearer ones repeat the mistake")
    most_apart_m: float = param(0.5, "m", "between cameras", source="farther ones see other edges")
    most_turn_deg: float = param(35.0, "deg", "between cameras")
    least_through: int = param(
        4,
        "count",
        "judges that look through it",
        source="two or three also fall for the wobbling outline of a handle as a phone sees it",
    )
    edge_px: int = param(3, "px", "from a step, within which flying pixels lie", ge=1)
    step: float = param(0.04, "ratio", "of a step to the depth")
    least_step_m: float = param(0.02, "m", "of a step, besides")
    noise_m: float = param(0.015, "m", "by which two frames' depth of one surface may differ: noise and poses, at 0 m")
    noise_more: float = param(0.006, "m", "and more of it at 1 m: the noise of depth by parallax grows with its square")
    through: float = param(2.0, "ratio", "of it, that a judge must see behind a pixel")
    there: float = param(1.5, "ratio", "of it, within which a judge sees the pixel's surface itself")
    nearest_m: float = param(0.05, "m", "from a judge, at least")


class Depths(NamedTuple):
    """A frame's depth, and the least and greatest known depth around each pixel."""

    metres: DepthMetres
    least: DepthMetres  # +inf where nothing is known
    greatest: DepthMetres  # -inf where nothing is known
    all_known: Mask


def drop_flying(frames: Sequence[Frame], images: FrameImages, store: Path, progress: Progress = SILENT) -> int:
    """Clear such pixels in the stored depth; how many there were. All frames are judged as they were before."""
    depths = lru_cache(maxsize=_KEPT)(lambda position: read_depths(frames[position], images))
    dropped: list[np.ndarray] = []
    for position, frame in enumerate(frames):
        progress.at(position / len(frames), f"comparing frame {position + 1}/{len(frames)}")
        judges = [(frames[k], depths(k)) for k in judges_of(frames, position)]
        dropped.append(np.flatnonzero(flying_in_others(frame, depths(position), judges)))
    for frame, pixels in zip(frames, dropped, strict=True):
        if len(pixels):
            cleared = images.depth(frame.index).metres.copy()
            cleared.ravel()[pixels] = 0
            write_depth(store, frame.index, cleared)
    return sum(len(pixels) for pixels in dropped)


def flying_in_others(frame: Frame, depths: Depths, judges: Sequence[tuple[Frame, Depths]]) -> Mask:
    """Pixels beside a step that at least four judges see through and none sees there itself."""
    params, flying = tuned(Params), np.zeros(depths.metres.shape, dtype=bool)
    rows, columns = np.nonzero(_beside_steps(depths))
    if not len(rows) or not judges:
        return flying
    uv = np.stack([columns, rows], axis=1) + 0.5
    points = frame.world_from_camera.apply(unproject(uv, depths.metres[rows, columns].astype(np.float64), frame.depth_camera))
    through, support = np.zeros(len(rows), np.int64), np.zeros(len(rows), np.int64)
    for judge, seen in judges:
        there = judge.world_from_camera.inverse.apply(points)
        uv, z = project(there, judge.depth_camera), there[:, 2]
        inside = sample_nearest(seen.metres, uv)[1] & (z > params.nearest_m)
        metres, least, greatest, all_known = (sample_nearest(image, uv)[0] for image in seen)
        tolerance = params.noise_m + params.noise_more * z**2
        through += inside & all_known & (least > z + params.through * tolerance)
        near = np.abs(metres - z) < params.there * tolerance
        support += inside & (least < z + tolerance) & (greatest > z - tolerance) & near
    wrong = (through >= params.least_through) & (support == 0)
    flying[rows[wrong], columns[wrong]] = True
    return flying


def read_depths(frame: Frame, images: FrameImages) -> Depths:
    """The frame's depth, ready to be asked."""
    metres = images.depth(frame.index).metres
    known = metres > 0
    window = np.ones((3, 3), np.uint8)
    least = cv2.erode(np.where(known, metres, np.float32(np.inf)), window)
    greatest = cv2.dilate(np.where(known, metres, np.float32(-np.inf)), window)
    return Depths(metres, least, greatest, cv2.erode(known.astype(np.uint8), window) > 0)


def judges_of(frames: Sequence[Frame], position: int) -> list[int]:
    """Positions of the frames that see what this one sees from a little aside; those near in time first."""
    params = tuned(Params)
    me = frames[position].world_from_camera
    found: list[int] = []
    for away in range(1, params.longest_away):
        for other in (position - away, position + away):
            if not 0 <= other < len(frames):
                continue
            pose = frames[other].world_from_camera
            apart = float(np.linalg.norm(pose.translation - me.translation))
            cosine = float(pose.rotation[:, 2] @ me.rotation[:, 2])
            new = all(
                np.linalg.norm(pose.translation - frames[k].world_from_camera.translation) > params.least_apart_m for k in found
            )
            if params.least_apart_m < apart < params.most_apart_m and cosine > np.cos(np.radians(params.most_turn_deg)) and new:
                found.append(other)
        if len(found) >= params.judges:
            break
    return found[: params.judges]


def _beside_steps(depths: Depths) -> Mask:
    params = tuned(Params)
    known = depths.metres > 0
    step = known & ((depths.greatest > depths.least + params.least_step_m + params.step * depths.metres) | ~depths.all_known)
    size = 2 * params.edge_px - 1
    return known & (cv2.dilate(step.astype(np.uint8), np.ones((size, size), np.uint8)) > 0)
