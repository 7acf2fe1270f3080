"""Accuracy of gravity, floor, yaw, poses and depth of recordings, against exact truth and measured furniture.

    python benchmarks/capture_geometry.py SAMPLES [--seeds 0-9] [--data DIR] [--update] [--workdir DIR]

SAMPLES holds seed<N>/scan.r3d of `r2c2r sample --seed N` (180 frames); DIR holds the real recordings. --update writes the
figures under "geometry" in benchmarks/capture.json after each recording, and keeps those of recordings not measured.
Takes about half a minute of CPU time per sample.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from memory import FIGURES, update_figures
from run import _seeds
from sample_truth import SampleTruth, pose_errors, sample_truth
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.depth import fill_for_display, usable_depth
from r2c2r_core.ingest.flying import flying_in_others, judges_of, read_depths
from r2c2r_core.ingest.gravity import Levelled, level_room
from r2c2r_core.ingest.odometry import estimate_poses
from r2c2r_core.ingest.planes import sample_surface
from r2c2r_core.ingest.poses import refine_poses
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.ingest.upsample import upsample_depth
from r2c2r_core.model.capture import Capture, Depth, Frame

CONFIG = IngestConfig()
REAL = ("kitchen-7scenes-redkitchen-seq01", "cabinet-tum-fr3-58", "open3d-rgbd-5frames-synthetic")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and save the figures."""
    options = _parser().parse_args(arguments)
    figures: dict[str, Any] = {"samples": {}, "real": {}}
    if options.update and FIGURES.exists():  # measuring one seed again keeps the figures of the others
        figures |= json.loads(FIGURES.read_text(encoding="utf-8")).get("geometry", {})
    jobs = [("real", name) for name in REAL if options.data is not None] + [("samples", str(seed)) for seed in options.seeds]
    for kind, name in jobs:
        with tempfile.TemporaryDirectory(prefix="r2c2r-geometry-", dir=options.workdir) as folder:
            if kind == "real":
                found = measure_real(options.data / name, Path(folder))
            else:
                found = measure_sample(options.samples / f"seed{name}" / "scan.r3d", int(name), Path(folder))
        print(name, json.dumps(found), flush=True)
        figures[kind][name] = found
        figures["summary"] = summary(figures["samples"])
        if options.update:
            update_figures("geometry", figures)
    print(json.dumps(figures["summary"], indent=1))
    return 0


def measure_sample(source: Path, seed: int, folder: Path) -> dict[str, Any]:
    """All figures of one synthetic recording."""
    capture = read_capture(source, folder, CONFIG)
    truth = sample_truth(seed, len(capture.frames))
    posed = dict(enumerate(truth.poses))
    return {
        "room": {"gravity_given": room_errors(capture.world_from_capture, capture.room.manhattan_yaw_rad, truth)}
        | {"gravity_withheld": _withheld(capture, truth)},
        "surface_off_2cm": _share_off(truth, capture.world_from_capture.inverse.apply(capture.surface.vertices_world)),
        "poses": drift_figures(capture, posed),
        "odometry": odometry_figures(capture, posed, every=3),
        "flying": flying_figures(source, capture.as_recorded, truth),
        "upsampling": upsampling_figures(capture, truth),
    }


def room_errors(world_from_capture: Rigid3, yaw_rad: float, truth: SampleTruth) -> dict[str, float]:
    """Errors of gravity and yaw in degrees, of the floor in millimetres."""
    here = world_from_capture @ truth.capture_from_kitchen
    run = here.rotation[:, 0]
    off = np.mod(yaw_rad - np.arctan2(run[1], run[0]) + np.pi / 4, np.pi / 2) - np.pi / 4
    return {
        "gravity_deg": round(float(np.degrees(np.arccos(np.clip(here.rotation[2, 2], -1, 1)))), 3),
        "floor_mm": round(1000 * float(abs(here.apply(_under_the_walk(truth))[:, 2].mean())), 1),
        "yaw_deg": round(float(abs(np.degrees(off))), 3),
    }


def _under_the_walk(truth: SampleTruth) -> np.ndarray:
    """The floor below the cameras, in the kitchen's frame."""
    centres = truth.capture_from_kitchen.inverse.apply(np.array([p.translation for p in truth.poses]))
    return centres * np.array([1.0, 1.0, 0.0])


def _withheld(capture: Capture, truth: SampleTruth) -> dict[str, float]:
    capture_from_world = capture.world_from_capture.inverse
    rng = np.random.default_rng(CONFIG.seed)
    sample = sample_surface(capture_from_world.apply(capture.surface.vertices_world), capture.surface.faces, 30_000, rng)
    cameras = [capture_from_world @ f.world_from_camera for f in capture.frames]
    levelled: Levelled = level_room(sample, cameras, None, None, rng)
    return room_errors(levelled.world_from_capture, levelled.room.manhattan_yaw_rad, truth)


def _share_off(truth: SampleTruth, points_capture: np.ndarray) -> float:
    return round(float((truth.distance_m(points_capture) > 0.02).mean()), 5)


def drift_figures(capture: Capture, truth: dict[int, Rigid3]) -> dict[str, Any]:
    """Pose errors before and after refinement, for poses as recorded, with 3 cm and 1.5 deg of smooth drift, and exact."""
    recorded = list(capture.as_recorded.frames)
    exact = [replace(f, world_from_camera=truth[f.index]) for f in recorded]
    figures: dict[str, Any] = {}
    for name, frames in (("recorded", recorded), ("drifted", drifted(recorded, 0.03, 1.5)), ("exact", exact)):
        started = time.process_time()
        result = refine_poses(frames, capture.images, most_keyframes=CONFIG.fused_frames, far_m=CONFIG.fused_far_m)
        figures[name] = {
            "before": pose_errors(frames, truth),
            "after": pose_errors(result.frames, truth),
            "source": result.evidence.source,
            "cpu_s": round(time.process_time() - started, 1),
        }
    return figures


def drifted(frames: Sequence[Frame], metres: float, degrees: float) -> list[Frame]:
    """The frames with a pose error that grows along the path to that size, with some wander on the way."""
    from scipy.ndimage import gaussian_filter1d

    rng, count = np.random.default_rng(0), len(frames)
    along, about = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    wander = gaussian_filter1d(rng.standard_normal((count, 6)), count / 8, axis=0, mode="nearest")
    wander = 0.4 * (wander - wander[0]) / np.abs(wander).max()
    share = np.linspace(0.0, 1.0, count)[:, None]
    shifts, turns = metres * (share * along + wander[:, :3]), np.radians(degrees) * (share * about + wander[:, 3:])
    moved = []
    for frame, shift, turn in zip(frames, shifts, turns, strict=True):
        pose = frame.world_from_camera
        rotation = Rotation.from_rotvec(turn).as_matrix() @ pose.rotation
        moved.append(replace(frame, world_from_camera=Rigid3(rotation, pose.translation + shift)))
    return moved


def odometry_figures(capture: Capture, truth: dict[int, Rigid3], *, every: int = 1) -> dict[str, Any]:
    """Errors of poses estimated from images and depth alone, over every n-th frame."""
    bare = [replace(f, world_from_camera=Rigid3()) for f in capture.frames[::every]]
    started = time.process_time()
    try:
        found = estimate_poses(bare, capture.images, most_keyframes=CONFIG.fused_frames, far_m=CONFIG.fused_far_m)
    except CaptureError as problem:
        return {"frames": len(bare), "refused": str(problem)}
    errors = pose_errors(found.frames, truth)
    return {"frames": len(bare), "tracked": len(found.frames), "cpu_s": round(time.process_time() - started, 1)} | errors


class _Unsure:
    """A recording's depth without its confidence, as in most formats."""

    def __init__(self, source: Path, *, cleaned: bool) -> None:
        self._recording, self._cleaned = open_recording(source), cleaned
        self._frames = {f.index: f for f in self._recording.frames}

    def depth(self, index: int) -> Depth:
        frame = self._frames[index]
        metres = self._recording.depth_of(frame).metres
        if self._cleaned:
            metres = usable_depth(
                metres, None, frame.depth_camera, least_confidence=0, near_m=CONFIG.near_m, far_m=CONFIG.far_m
            )
        metres = np.nan_to_num(metres, nan=0.0, posinf=0.0, neginf=0.0)
        return Depth(metres, metres > 0)

    def rgb(self, index: int) -> np.ndarray:
        raise NotImplementedError


def flying_figures(source: Path, capture: Capture, truth: SampleTruth, *, every: int = 36) -> dict[str, Any]:
    """Fraction of points off the true surface: recorded without confidence, and after the single- and multi-frame filters."""
    raw, cleaned = _Unsure(source, cleaned=False), _Unsure(source, cleaned=True)
    distances: dict[str, list[np.ndarray]] = {"recorded": [], "single_frame": [], "many_frames": []}
    for position in range(10, len(capture.frames), every):
        frame = capture.frames[position]
        judges = [(capture.frames[k], read_depths(capture.frames[k], cleaned)) for k in judges_of(capture.frames, position)]
        single = cleaned.depth(frame.index).metres
        flying = flying_in_others(frame, read_depths(frame, cleaned), judges)
        many = np.where(flying, np.float32(0), single)
        for name, depth in zip(distances, (raw.depth(frame.index).metres, single, many), strict=True):
            points = depth_points(depth, frame.depth_camera)[depth > 0].astype(np.float64)
            distances[name].append(truth.distance_m(truth.poses[frame.index].apply(points)))
    joined = {name: np.concatenate(found) for name, found in distances.items()}
    good = (joined["recorded"] < 0.01).sum()
    return {
        name: {
            "off_2cm": round(float((d > 0.02).mean()), 5),
            "off_5cm": round(float((d > 0.05).mean()), 6),
            "good_kept": round(float((d < 0.01).sum() / good), 4),
        }
        for name, d in joined.items()
    }


def upsampling_figures(capture: Capture, truth: SampleTruth, *, every: int = 60) -> dict[str, Any]:
    """Depth error at and away from edges, and the fraction of edge pixels interpolated between both sides."""
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for frame in capture.frames[10::every]:
        rgb, depth = capture.images.rgb(frame.index), capture.images.depth(frame.index).metres
        exact = truth.depth(frame.index, frame.rgb_camera)
        size = (frame.rgb_camera.width, frame.rgb_camera.height)
        filled = fill_for_display(depth)
        made = {"ours": upsample_depth(depth, rgb)}
        for name, way in (("nearest", cv2.INTER_NEAREST_EXACT), ("bilinear", cv2.INTER_LINEAR), ("bicubic", cv2.INTER_CUBIC)):
            made[name] = cv2.resize(filled, size, interpolation=way)
        window = np.ones((9, 9), np.uint8)
        low, high = cv2.erode(exact, window), cv2.dilate(exact, window)
        known = (made["ours"] > 0) & (low > 0)
        edge = known & (high - low > 0.04 + 0.03 * exact)
        margin = 0.02 + 0.015 * exact
        for name, fine in made.items():
            error = np.abs(fine - exact)
            hanging = (fine > low + margin) & (fine < high - margin) & (error > margin)
            rows.setdefault(name, []).append(
                (1000 * float(error[edge].mean()), float(hanging[edge].mean()), 1000 * float(np.median(error[known & ~edge])))
            )
    means = {name: np.mean(r, axis=0) for name, r in rows.items()}
    return {
        name: {"edge_mm": round(m[0], 1), "hanging": round(m[1], 4), "elsewhere_mm": round(m[2], 2)}
        for name, m in means.items()
    }


def measure_real(source: Path, folder: Path) -> dict[str, Any]:
    """Figures available for a real recording: heights, a box, poses."""
    capture = read_capture(source, folder, CONFIG)
    truth = {f.index: f.world_from_camera for f in capture.as_recorded.frames}
    poses = capture.poses
    assert poses is not None
    figures: dict[str, Any] = {
        "poses": poses.source,
        "gap_given_mm": None if poses.given_gap_m is None else round(1000 * poses.given_gap_m, 2),
        "gap_mm": None if poses.gap_m is None else round(1000 * poses.gap_m, 2),
        "odometry_against_given": odometry_figures(capture, truth),
        "notices": list(capture.notices),
    }
    if "kitchen" in source.name:
        figures |= {"table_m": height_of(capture, 0.60, 0.86), "seat_m": height_of(capture, 0.36, 0.56)}
    if "cabinet" in source.name:
        figures["cabinet"] = cabinet_box(capture, source)
    return figures


def height_of(capture: Capture, low: float, high: float) -> float:
    """Height (m) above the floor, between `low` and `high`, with the most level surface within 12 mm."""
    vertices, faces = capture.surface.vertices_world, capture.surface.faces
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    level = cross[:, 2] > 0.95 * np.linalg.norm(cross, axis=1)
    heights, areas = ((a + b + c) / 3)[level, 2], np.linalg.norm(cross[level], axis=1)
    counts, edges = np.histogram(heights, bins=np.arange(low, high, 0.005), weights=areas)
    return round(float(edges[int(np.argmax(np.convolve(counts, np.ones(5), mode="same")))] + 0.0025), 4)


def cabinet_box(capture: Capture, source: Path) -> dict[str, float]:
    """Size and yaw error of the box around the points above the floor near the measured cabinet's centre."""
    x, y, _, yaw, *half = (float(w) for w in (source / "truth_objects.txt").read_text().split()[:7])
    world = capture.world_from_capture
    centre = world.apply(np.array([[x, y, 0.0]]))[0, :2]
    sample = sample_surface(capture.surface.vertices_world, capture.surface.faces, 400_000, np.random.default_rng(0))
    near = np.linalg.norm(sample.points[:, :2] - centre, axis=1) < np.hypot(half[0], half[1]) + 0.15
    chosen = near & (sample.points[:, 2] > 0.04)
    points, normals = sample.points[chosen], sample.normals[chosen]
    box = upright_box(points, normals, trim=0.01)
    top = points[normals[:, 2] > 0.9]
    turned = world.rotation[:2, :2] @ np.array([np.cos(yaw), np.sin(yaw)])
    off = np.mod(box.yaw_rad - np.arctan2(turned[1], turned[0]) + np.pi / 4, np.pi / 2) - np.pi / 4
    sizes = sorted(box.size_m[:2], reverse=True)
    return {
        "width_m": round(float(sizes[0]), 4),
        "depth_m": round(float(sizes[1]), 4),
        "height_m": round(float(np.median(top[top[:, 2] > 0.4][:, 2])), 4),
        "yaw_off_deg": round(float(abs(np.degrees(off))), 2),
    }


def summary(samples: dict[str, Any]) -> dict[str, Any]:
    """The worst room errors, and mean pose, odometry, upsampling and flying figures."""
    if not samples:
        return {}
    every = list(samples.values())
    worst = {
        f"{given}.{name}": max(s["room"][given][name] for s in every)
        for given in ("gravity_given", "gravity_withheld")
        for name in ("gravity_deg", "floor_mm", "yaw_deg")
    }
    poses = {
        f"{kind}.{when}_mm": round(float(np.mean([s["poses"][kind][when]["points_ahead_mm"] for s in every])), 2)
        for kind in ("recorded", "drifted", "exact")
        for when in ("before", "after")
    }
    odometry = [s["odometry"]["centres_mm"] for s in every if "centres_mm" in s["odometry"]]
    return {
        "worst_room": worst,
        "mean_poses": poses,
        "odometry_centres_mm": {"mean": round(float(np.mean(odometry)), 1), "worst": max(odometry), "of": len(odometry)},
        "upsampling": {
            way: {k: round(float(np.mean([s["upsampling"][way][k] for s in every])), 4) for k in every[0]["upsampling"][way]}
            for way in every[0]["upsampling"]
        },
        "flying": {
            way: {k: round(float(np.mean([s["flying"][way][k] for s in every])), 5) for k in every[0]["flying"][way]}
            for way in every[0]["flying"]
        },
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", type=Path)
    parser.add_argument("--seeds", type=_seeds, default=_seeds("0-9"))
    parser.add_argument("--data", type=Path)
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--workdir", type=Path)
    return parser


if __name__ == "__main__":
    sys.exit(main())
