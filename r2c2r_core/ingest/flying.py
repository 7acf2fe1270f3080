"""Multi-view rejection of flying pixels: other frames see through them, and none observes a surface there."""

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
    """Tuned parameters of flying-pixel rejection."""

    judges: int = param(6, "count", "Maximum number of other frames that test a frame", ge=1)
    longest_away: int = param(60, "count", "Maximum distance in frames between a frame and those that test it")
    least_apart_m: float = param(
        0.04, "m", "Minimum distance between the cameras of two compared frames", source="nearer ones repeat the mistake"
    )
    most_apart_m: float = param(
        0.5, "m", "Maximum distance between the cameras of two compared frames", source="farther ones see other edges"
    )
    most_turn_deg: float = param(35.0, "deg", "Maximum angle between the viewing directions of two compared frames")
    least_through: int = param(
        4,
        "count",
        "Minimum number of frames that must see through a pixel to reject it",
        source="two or three also fall for the wobbling outline of a handle as a phone sees it",
    )
    edge_px: int = param(3, "px", "Maximum distance of flying pixels from a depth step", ge=1)
    step: float = param(0.04, "ratio", "Minimum depth step as a fraction of the depth, added to the constant part")
    least_step_m: float = param(0.02, "m", "Constant part of the minimum depth step")
    noise_m: float = param(0.015, "m", "Tolerance between two frames' depth of one surface (noise and pose error), at 0 m")
    noise_more: float = param(0.006, "m", "Increase of that tolerance at 1 m; noise of depth by parallax grows with its square")
    through: float = param(2.0, "ratio", "Minimum depth behind a pixel, in tolerances, for a frame to see through it")
    there: float = param(1.5, "ratio", "Maximum depth difference, in tolerances, for a frame to confirm a pixel")
    nearest_m: float = param(0.05, "m", "Minimum depth of a pixel in another frame for it to be tested there")


class Depths(NamedTuple):
    """A frame's depth, with the minimum and maximum known depth around each pixel."""

    metres: DepthMetres
    least: DepthMetres  # +inf where nothing is known
    greatest: DepthMetres  # -inf where nothing is known
    all_known: Mask


def drop_flying(frames: Sequence[Frame], images: FrameImages, store: Path, progress: Progress = SILENT) -> int:
    """Clear flying pixels in the stored depth and return their number. All frames are tested before any is changed."""
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
    """Pixels near a depth step that at least four other frames see through and none confirms."""
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
    """The frame's depth with its 3 x 3 neighbourhood extrema."""
    metres = images.depth(frame.index).metres
    known = metres > 0
    window = np.ones((3, 3), np.uint8)
    least = cv2.erode(np.where(known, metres, np.float32(np.inf)), window)
    greatest = cv2.dilate(np.where(known, metres, np.float32(-np.inf)), window)
    return Depths(metres, least, greatest, cv2.erode(known.astype(np.uint8), window) > 0)


def judges_of(frames: Sequence[Frame], position: int) -> list[int]:
    """Positions of frames with similar direction and a small baseline, nearest in time first."""
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
