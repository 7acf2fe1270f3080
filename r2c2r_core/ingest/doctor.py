"""The capture doctor: is this recording good enough, and if not, why not."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from r2c2r_core.geometry.camera import depth_points, project, sample_nearest
from r2c2r_core.model.capture import Capture, Frame

Verdict = Literal["good", "usable with care", "unusable"]
_ORDER: tuple[Verdict, ...] = ("good", "usable with care", "unusable")


@dataclass(frozen=True, slots=True, kw_only=True)
class Remark:
    """One thing about a recording, how much it matters, and what to do about it."""

    verdict: Verdict
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureFigures:
    """What was measured."""

    frames: int
    first_frame: int
    last_frame: int
    rgb_size: tuple[int, int]  # width, height
    depth_size: tuple[int, int]
    fps: float | None
    duration_s: float | None
    path_m: float
    turned_deg: float
    depth_coverage: float  # share of pixels with usable depth in the median frame
    median_depth_m: float
    blurred_share: float  # frames with less than a third of the median sharpness
    pose_jumps: int
    largest_jump_m: float
    pair_error_mm: float | None  # median disagreement of the depth of neighbouring frames; None: no overlap
    pair_overlap: float  # share of a frame's pixels its neighbour sees too
    up_source: str
    floor_found: bool
    walls: int
    voxel_mm: float
    surface_m: tuple[float, float, float]  # extent of the fused surface along x, y, z


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureReport:
    """The doctor's report."""

    verdict: Verdict
    reasons: tuple[str, ...]  # one line each, worst first
    figures: CaptureFigures
    notices: tuple[str, ...]  # what the reader had to say


def examine(capture: Capture) -> CaptureReport:
    """Look a recording over; reads about forty of its frames."""
    figures = measure(capture)
    remarks = sorted(_remarks(figures), key=lambda r: -_ORDER.index(r.verdict))
    verdict = remarks[0].verdict if remarks else "good"
    return CaptureReport(verdict=verdict, reasons=tuple(r.text for r in remarks), figures=figures, notices=capture.notices)


def measure(capture: Capture) -> CaptureFigures:
    """The figures of a recording."""
    frames = capture.frames
    centres = np.array([f.world_from_camera.translation for f in frames])
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    turns = np.array([_angle_deg(a, b) for a, b in pairwise(frames)])
    times = [f.timestamp_s for f in frames if f.timestamp_s is not None]
    duration = times[-1] - times[0] if len(times) > 1 else None
    coverage, median_depth = _coverage(capture, frames[:: max(1, len(frames) // 20)])
    error_m, overlap = pair_error(capture)
    sharpness = np.array([f.sharpness for f in frames])
    jumps = _jumps(frames, steps)
    vertices = capture.surface.vertices_world
    extent = np.ptp(np.quantile(vertices, (0.005, 0.995), axis=0), axis=0) if len(vertices) else np.zeros(3)
    return CaptureFigures(
        frames=len(frames),
        first_frame=frames[0].index,
        last_frame=frames[-1].index,
        rgb_size=(frames[0].rgb_camera.width, frames[0].rgb_camera.height),
        depth_size=(frames[0].depth_camera.width, frames[0].depth_camera.height),
        fps=(len(times) - 1) / duration if duration else None,
        duration_s=duration,
        path_m=float(steps.sum()),
        turned_deg=float(turns.sum()),
        depth_coverage=coverage,
        median_depth_m=median_depth,
        blurred_share=float((sharpness < np.median(sharpness) / 3).mean()),
        pose_jumps=int(jumps.sum()),
        largest_jump_m=float(steps[jumps].max()) if jumps.any() else 0.0,
        pair_error_mm=None if error_m is None else error_m * 1000,
        pair_overlap=overlap,
        up_source=capture.room.up_source,
        floor_found=capture.room.floor_found,
        walls=len(capture.room.walls),
        voxel_mm=capture.surface.voxel_m * 1000,
        surface_m=(float(extent[0]), float(extent[1]), float(extent[2])),
    )


def pair_error(capture: Capture, pairs: int = 24) -> tuple[float | None, float]:
    """Median disagreement (m) between one frame's depth and a neighbour's, seen from there, and the share they overlap.

    The neighbour is far enough away for a wrong pose convention, focal length or unit to show.
    """
    frames = capture.frames
    chosen = frames[:: max(1, len(frames) // pairs)]
    errors, overlaps = [], []
    for frame in chosen:
        other = _neighbour(frames, frame)
        if other is None:
            continue
        apart = _disagreement(capture, frame, other)
        overlaps.append(apart.size / max(1, (frame.depth_camera.width // 3) * (frame.depth_camera.height // 3)))
        if apart.size > 50:
            errors.append(float(np.median(np.abs(apart))))
    return (float(np.median(errors)) if errors else None), float(np.mean(overlaps)) if overlaps else 0.0


def _remarks(figures: CaptureFigures) -> list[Remark]:
    checks: tuple[tuple[bool, Verdict, str], ...] = (
        (figures.frames < 5, "unusable", f"only {figures.frames} frames; film for at least ten seconds"),
        (5 <= figures.frames < 20, "usable with care", f"only {figures.frames} frames; more views give better masks"),
        (
            figures.depth_coverage < 0.1,
            "unusable",
            _percent("usable depth covers {} of the median frame", figures.depth_coverage),
        ),
        (
            0.1 <= figures.depth_coverage < 0.35,
            "usable with care",
            _percent("usable depth covers only {} of the median frame; stay 0.5 to 3 m away", figures.depth_coverage),
        ),
        (
            figures.blurred_share > 0.2,
            "usable with care",
            _percent("{} of the frames are blurred; move slower", figures.blurred_share),
        ),
        (
            figures.pose_jumps > 0,
            "usable with care",
            f"tracking jumped {figures.pose_jumps} times, by up to {figures.largest_jump_m:.2f} m; things may appear twice",
        ),
        *_pair_checks(figures),
        (figures.path_m < 0.15, "usable with care", f"the camera moved only {figures.path_m:.2f} m; walk around the objects"),
        (
            figures.up_source == "assumed",
            "usable with care",
            "neither the recording nor its planes tell which way is up; set it by hand",
        ),
        (not figures.floor_found, "usable with care", "no floor was found; film some of it, or set its height by hand"),
    )
    return [Remark(verdict=verdict, text=text) for holds, verdict, text in checks if holds]


def _pair_checks(figures: CaptureFigures) -> tuple[tuple[bool, Verdict, str], ...]:
    """On the real kitchen: right 9 mm, focal length 10 % off 17, path 20 % too long 23, wrong conventions 120 to 165."""
    error = figures.pair_error_mm
    if error is None or figures.pair_overlap < 0.03:
        return ((True, "usable with care", "neighbouring frames hardly overlap; poses and depth could not be checked"),)
    limit = 6.0 + 3.0 * figures.median_depth_m**2  # sensor noise grows with the square of the distance
    text = f"neighbouring frames disagree by {error:.0f} mm"
    return (
        (error > 3 * limit, "unusable", f"{text}: poses, calibration or depth units are wrong"),
        (
            limit < error <= 3 * limit,
            "usable with care",
            f"{text}, {limit:.0f} mm were expected: poses drift or depth is unregistered",
        ),
    )


def _neighbour(frames: Sequence[Frame], frame: Frame) -> Frame | None:
    """A frame that looks the same way from 10 to 60 cm or 5 to 25 deg away; the nearest to 25 cm."""
    best, best_miss = None, np.inf
    for other in frames:
        apart = float(np.linalg.norm(other.world_from_camera.translation - frame.world_from_camera.translation))
        angle = _angle_deg(frame, other)
        if angle > 25.0 or apart > 0.6 or (apart < 0.05 and angle < 5.0):
            continue
        miss = abs(apart - 0.25) + angle / 100.0
        if miss < best_miss:
            best, best_miss = other, miss
    return best


def _disagreement(capture: Capture, frame: Frame, other: Frame) -> np.ndarray:
    """Depth of `frame`'s points as seen by `other`, less what `other` measured there (m), over points both see."""
    depth = capture.images.depth(frame.index).metres
    points = depth_points(depth, frame.depth_camera)[::3, ::3][depth[::3, ::3] > 0]
    there = (other.world_from_camera.inverse @ frame.world_from_camera).apply(points)
    there = there[there[:, 2] > 0.05]
    measured, inside = sample_nearest(capture.images.depth(other.index).metres, project(there, other.depth_camera))
    seen = inside & (measured > 0)
    apart = there[seen, 2] - measured[seen]
    return np.asarray(apart[np.abs(apart) < 0.15 * measured[seen] + 0.1])  # the rest is hidden from one of the two


def _coverage(capture: Capture, frames: Sequence[Frame]) -> tuple[float, float]:
    shares, medians = [], []
    for frame in frames:
        depth = capture.images.depth(frame.index)
        shares.append(float(depth.valid.mean()))
        if depth.valid.any():
            medians.append(float(np.median(depth.metres[depth.valid])))
    return float(np.median(shares)), float(np.median(medians)) if medians else 0.0


def _jumps(frames: Sequence[Frame], steps: np.ndarray) -> np.ndarray:
    """Steps much longer than their neighbours' pace allows."""
    if len(steps) < 3:
        return np.zeros(len(steps), dtype=bool)
    gaps = np.diff([f.index for f in frames]).astype(np.float64)
    pace = steps / gaps
    return np.asarray((steps > 0.25) & (pace > 8.0 * np.median(pace)))


def _angle_deg(a: Frame, b: Frame) -> float:
    cosine = (np.trace(a.world_from_camera.rotation.T @ b.world_from_camera.rotation) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _percent(text: str, share: float) -> str:
    return text.format(f"{share:.0%}")
