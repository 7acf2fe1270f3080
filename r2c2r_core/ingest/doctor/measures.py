"""Quality measures of a recording, before any verdict."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from r2c2r_core.ingest.doctor.coverage import cover
from r2c2r_core.ingest.doctor.drift import misplaced_m, revisits
from r2c2r_core.ingest.doctor.light import Greys, measure_light
from r2c2r_core.ingest.doctor.pairs import Pairs, Views, angle_deg, compare
from r2c2r_core.ingest.doctor.recorded import Recorded, measure_recorded, measure_timing, unreadable_share
from r2c2r_core.ingest.doctor.report import CaptureFigures, Moment
from r2c2r_core.ingest.readers.protocol import Recording
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the quality measures."""

    level_m2: float = param(0.15, "m²", "Minimum area of a level surface; a smaller one is the top of an object")
    furniture_m: tuple[float, float] = param((0.25, 1.9), "m", "Range of heights of level furniture surfaces")
    jump_m: float = param(0.2, "m", "Minimum length of a camera step to be a tracking jump")
    pace: tuple[float, float] = param(
        (6.0, 2.5), "ratio", "Minimum ratio of a jump's pace to the median pace, and to that of the adjacent steps"
    )
    blurred: float = param(1 / 3, "ratio", "Ratio to the median sharpness below which a frame is blurred")


def measure(capture: Capture, views: Views, pairs: Pairs, grey: Greys, recording: Recording | None) -> CaptureFigures:
    """The measures of a recording; `pairs` are neighbours among `views`, `grey` their images."""
    frames, room = capture.frames, capture.room
    centres = np.array([f.world_from_camera.translation for f in frames])
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    turns = [angle_deg(a.world_from_camera.rotation, b.world_from_camera.rotation) for a, b in pairwise(frames)]
    timing = measure_timing(recording, frames)
    recorded = measure_recorded(recording) if recording else Recorded(None, None)
    depth_known = views.depth_m > 0
    sharpness = np.array([f.sharpness for f in frames])
    jumps = _jumps(frames, steps)
    compared = compare(views, pairs)
    errors = compared.error_m[np.isfinite(compared.error_m)]
    again = misplaced_m(views, revisits(views, 24))
    light = measure_light(grey, views, pairs)
    heights = _heights(capture)
    seen = cover(capture.surface.vertices_world, views)
    return CaptureFigures(
        frames=len(frames),
        first_frame=frames[0].index,
        last_frame=frames[-1].index,
        missing_share=timing.missing_share,
        without_pose_share=timing.without_pose_share,
        unreadable_share=unreadable_share(recording, len(frames)) if recording else 0.0,
        longest_gap_s=timing.longest_gap_s,
        rgb_size=(frames[0].rgb_camera.width, frames[0].rgb_camera.height),
        depth_size=(frames[0].depth_camera.width, frames[0].depth_camera.height),
        fps=timing.fps,
        duration_s=timing.duration_s,
        path_m=float(steps.sum()),
        turned_deg=float(np.sum(turns)),
        depth_coverage=float(np.median(depth_known.mean(axis=(1, 2)))),
        recorded_depth_m=recorded.median_m,
        confidence_shares=recorded.confidence,
        median_depth_m=float(np.median(views.depth_m[depth_known])) if depth_known.any() else 0.0,
        blurred_share=float((sharpness < np.median(sharpness) * tuned(Params).blurred).mean()),
        overexposed_share=light.white,
        underexposed_share=light.black,
        flicker_share=light.flicker,
        pose_jumps=int(jumps.sum()),
        largest_jump_m=float(steps[jumps].max()) if jumps.any() else 0.0,
        pair_error_mm=float(1000 * np.median(errors)) if len(errors) else None,
        pair_overlap=float(compared.overlap.mean()) if len(pairs) else 0.0,
        drift_mm=float(1000 * np.nanmedian(again)) if np.isfinite(again).any() else None,
        poses_source=capture.poses.source if capture.poses else "file",
        up_source=room.up_source,
        up_spread_deg=room.up_spread_deg,
        up_file_off_deg=room.up_file_off_deg,
        up_corrected=room.up_corrected,
        up_rival=None if room.up_rival_capture is None else _three(room.up_rival_capture),
        floor_found=room.floor_found,
        floor_source=room.floor_source,
        floor_spread_mm=None if room.floor_spread_m is None else 1000 * room.floor_spread_m,
        manhattan_yaw_deg=float(np.degrees(room.manhattan_yaw_rad)),
        yaw_source=room.yaw_source,
        yaw_spread_deg=room.yaw_spread_deg,
        walls=len(room.walls),
        walls_source=room.walls_source,
        wall_spread_mm=tuple(1000 * w.spread_m for w in room.walls if w.spread_m is not None),
        camera_height_m=float(np.median(centres[:, 2])) if room.floor_found else None,
        level_heights_m=heights.level,
        room_height_m=heights.ceiling,
        seen_from_three=seen.from_three,
        seen_close=seen.close,
        voxel_mm=capture.surface.voxel_m * 1000,
        surface_m=_extent(capture.surface.vertices_world),
    )


def moments(capture: Capture, views: Views, pairs: Pairs, grey: Greys) -> tuple[Moment, ...]:
    """Per-frame measures of the examined frames, in order."""
    errors: dict[int, float] = dict(zip(pairs[:, 0].tolist(), compare(views, pairs).error_m.tolist(), strict=True))
    known = (views.depth_m > 0).mean(axis=(1, 2))
    frames = [capture.frames[p] for p in views.position]
    usual = max(float(np.median([f.sharpness for f in capture.frames])), 1e-9)
    return tuple(
        Moment(
            frame_index=frame.index,
            sharpness=round(float(frame.sharpness) / usual, 3),
            depth_share=round(float(known[k]), 3),
            brightness=round(float(grey[k].mean()) / 255, 3),
            error_mm=round(1000 * error, 1) if np.isfinite(error := errors.get(k, np.nan)) else None,
        )
        for k, frame in enumerate(frames)
    )


def _three(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 4) for value in vector)
    return x, y, z


class _Heights(NamedTuple):
    level: tuple[float, ...]
    ceiling: float | None


def _heights(capture: Capture) -> _Heights:
    """Heights of large level surfaces above the floor, and of a ceiling: cues to the scale of the recording."""
    if not capture.room.floor_found or not len(capture.surface.faces):
        return _Heights((), None)
    a, b, c = (capture.surface.vertices_world[capture.surface.faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1) / 2
    level = np.abs(cross[:, 2]) > 2 * 0.95 * area
    z, up = (a[:, 2] + b[:, 2] + c[:, 2]) / 3, cross[:, 2] > 0
    low, ceiling = tuned(Params).furniture_m
    furniture = level & up & (z > low) & (z < ceiling)
    counts = np.histogram(z[furniture], bins=np.arange(low, ceiling, 0.02), weights=area[furniture])[0]
    smooth = np.convolve(counts, np.ones(3), mode="same")
    peaks = (
        np.flatnonzero((smooth[1:-1] > smooth[:-2]) & (smooth[1:-1] >= smooth[2:]) & (smooth[1:-1] > tuned(Params).level_m2))
        + 1
    )
    around = [furniture & (np.abs(z - (low + 0.01 + 0.02 * k)) < 0.04) for k in peaks]
    heights = sorted({round(float(np.average(z[near], weights=area[near])), 2) for near in around})
    above = level & ~up & (z > ceiling)
    height = float(np.average(z[above], weights=area[above])) if area[above].sum() > 0.5 else None
    return _Heights(tuple(heights), height)


def _jumps(frames: Sequence[Frame], steps: np.ndarray) -> np.ndarray:
    """Camera steps much faster than the median pace and than the adjacent steps."""
    usual, nearby = tuned(Params).pace
    if len(steps) < 3:
        return np.zeros(len(steps), dtype=bool)
    gaps = np.diff([f.index for f in frames]).astype(np.float64)
    pace = steps / gaps
    beside = np.maximum(np.r_[pace[1], pace[:-1]], np.r_[pace[1:], pace[-2]])
    return np.asarray((steps > tuned(Params).jump_m) & (pace > usual * np.median(pace)) & (pace > nearby * beside))


def _extent(vertices: np.ndarray) -> tuple[float, float, float]:
    extent = np.ptp(np.quantile(vertices, (0.005, 0.995), axis=0), axis=0) if len(vertices) else np.zeros(3)
    return float(extent[0]), float(extent[1]), float(extent[2])
