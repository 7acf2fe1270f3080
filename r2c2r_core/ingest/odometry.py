"""RGB-D odometry for recordings without poses: landmark and depth tracking against keyframes, loop closure by pose graph."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.cloud import spread_frames
from r2c2r_core.ingest.landmarks import Landmarks, find_landmarks, motion_between
from r2c2r_core.ingest.overlap import SmallView, agreement, overlaps, small_view
from r2c2r_core.ingest.poses import SettledPoses, bring_together, carried, median_gap, overlapping_pairs
from r2c2r_core.model.capture import Frame, FrameImages, PoseEvidence
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of RGB-D odometry."""

    agreeing: float = param(
        0.7,
        "share",
        "Fraction of the common surface that must coincide above which a motion is accepted",
        source="right ones: 0.75 to 0.95",
    )
    key_overlap: float = param(0.6, "share", "Overlap with the last keyframe below which a frame becomes the next keyframe")
    loop_landmarks: int = param(20, "count", "Minimum number of inlier landmarks for a loop closure")
    most_loop_keys: int = param(
        60, "count", "Maximum number of keyframes compared pairwise for loops", source="about 10 ms per pair", ge=2
    )
    pair_reaches_m: tuple[float, float, float] = param(
        (0.08, 0.05, 0.03), "m", "Maximum matching distance between points of two frames in each round"
    )
    return_m: float = param(
        0.015, "m", "Maximum forward-backward translation error of a dense motion", source="wrong motions end centimetres off"
    )
    return_deg: float = param(0.7, "deg", "Maximum forward-backward rotation error of a dense motion")
    loose_m: float = param(0.01, "m", "Standard deviation of the prior on the translation when depth refines a motion", gt=0)
    loose_deg: float = param(0.5, "deg", "Standard deviation of the prior on the rotation when depth refines a motion", gt=0)
    least_frames: int = param(5, "count", "Minimum number of tracked frames")
    least_share: float = param(0.5, "share", "Minimum fraction of frames that are tracked in one piece")


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """One frame's depth view and landmarks for tracking."""

    frame: Frame
    view: SmallView
    landmarks: Landmarks


@dataclass(slots=True)
class _Track:
    """A stretch of frames tracked without a gap; poses are stretch_from_camera."""

    sights: list[_Sight]
    poses: list[Rigid3]
    keys: list[int]  # positions of the keyframes


def estimate_poses(
    frames: Sequence[Frame], images: FrameImages, *, most_keyframes: int, far_m: float, progress: Progress = SILENT
) -> SettledPoses:
    """Poses by RGB-D odometry, of the longest unbroken stretch; raises CaptureError if that is less than half the frames."""
    params = tuned(Params)
    rng = np.random.default_rng(0)
    track = max(_tracks(frames, images, far_m, rng, progress.part(0.0, 0.7)), key=lambda t: len(t.poses))
    count = len(track.poses)
    if count < max(params.least_frames, params.least_share * len(frames)):
        raise CaptureError(
            f"no poses in the recording, and only {count} of {len(frames)} frames could be tracked continuously",
            hint="record with tracking on, or move more slowly and keep textured surfaces in view",
        )
    progress.at(0.75, "closing loops")
    found = _close_loops(track, rng)
    posed = tuple(replace(s.frame, world_from_camera=p) for s, p in zip(track.sights, found, strict=True))
    keyframes = spread_frames(posed, most_keyframes)
    views = {s.frame.index: s.view for s in track.sights}
    chosen = [views[f.index] for f in keyframes]
    start = [f.world_from_camera for f in keyframes]
    near, loops = overlapping_pairs(overlaps(chosen, start))
    moved = bring_together(chosen, start, [*near, *loops], step_m=params.loose_m, step_deg=params.loose_deg)
    gap_m = median_gap(chosen, moved, loops or near)
    notices = ["the recording has no poses; they were estimated from its images and depth"]
    if count < len(frames):
        first, last = posed[0].index, posed[-1].index
        notices.append(f"tracking was lost: only frames {first} to {last} are used, {count} of {len(frames)}")
    return SettledPoses(
        carried(posed, keyframes, moved), PoseEvidence(source="odometry", given_gap_m=None, gap_m=gap_m), tuple(notices)
    )


def _tracks(
    frames: Sequence[Frame], images: FrameImages, far_m: float, rng: np.random.Generator, progress: Progress
) -> list[_Track]:
    """Tracks of consecutive frames without a gap."""
    params = tuned(Params)
    tracks: list[_Track] = []
    for position, frame in enumerate(frames):
        progress.at(position / len(frames), f"tracking frame {position + 1}/{len(frames)}")
        sight = _Sight(frame, small_view(frame, images, far_m), find_landmarks(frame, images, far_m))
        pose = _next_pose(tracks[-1], sight, images, rng) if tracks else None
        if pose is None:
            tracks.append(_Track([sight], [Rigid3()], [0]))
            continue
        track = tracks[-1]
        track.sights.append(sight)
        track.poses.append(pose)
        key = track.keys[-1]
        shared = agreement(track.sights[key].view, sight.view, track.poses[key].inverse @ pose)
        if shared.seen < params.key_overlap:
            track.keys.append(len(track.poses) - 1)
    return tracks


def _next_pose(track: _Track, sight: _Sight, images: FrameImages, rng: np.random.Generator) -> Rigid3 | None:
    """Pose of the next frame, relative to the keyframe if depth confirms it, else to the previous frame; None if lost."""
    before = len(track.poses) - 1
    for position in dict.fromkeys((track.keys[-1], before)):
        known = track.sights[position]
        told = motion_between(known.landmarks, sight.landmarks, rng)
        confirmed = _confirmed(known, sight, told.first_from_second) if told is not None else None
        if confirmed is not None:
            return track.poses[position] @ confirmed
    steady = track.poses[before - 1].inverse @ track.poses[before] if before > 0 else Rigid3()
    for guess in (steady, Rigid3()):
        dense = _dense_motion(track.sights[before], sight, images, guess)
        if dense is not None:
            return track.poses[before] @ dense
    return None


def _confirmed(first: _Sight, second: _Sight, first_from_second: Rigid3) -> Rigid3 | None:
    """The motion refined on the depth of both frames; None if their surfaces do not coincide afterwards."""
    params = tuned(Params)
    a, b = bring_together(
        [first.view, second.view],
        [Rigid3(), first_from_second],
        [(0, 1), (1, 0)],
        reaches_m=params.pair_reaches_m,
        step_m=params.loose_m,
        step_deg=params.loose_deg,
    )
    settled = a.inverse @ b
    return settled if agreement(first.view, second.view, settled).coincide > params.agreeing else None


def _dense_motion(first: _Sight, second: _Sight, images: FrameImages, guess: Rigid3) -> Rigid3 | None:
    """first_from_second by dense RGB-D odometry, for too few landmarks; None unless forward and backward results agree.

    Planar surfaces fit each other when shifted along themselves, so coinciding depth alone is no confirmation.
    """
    params = tuned(Params)
    there = _rgbd_odometry(first.frame, second.frame, images, guess)
    back = _rgbd_odometry(second.frame, first.frame, images, guess.inverse)
    if there is None or back is None:
        return None
    missed = there @ back
    turned_deg = np.degrees(np.arccos(np.clip((np.trace(missed.rotation) - 1.0) / 2.0, -1.0, 1.0)))
    if np.linalg.norm(missed.translation) > params.return_m or turned_deg > params.return_deg:
        return None
    return _confirmed(first, second, there)


def _rgbd_odometry(first: Frame, second: Frame, images: FrameImages, guess: Rigid3) -> Rigid3 | None:
    """first_from_second by Open3D's RGB-D odometry (Park et al. 2017); None where its linear system is singular."""
    import open3d as o3d

    odometry: Any = o3d.t.pipelines.odometry
    core: Any = o3d.core
    matrix = first.depth_camera.matrix
    matrix[:2, 2] -= 0.5  # Open3D's odometry counts pixel centres at integers
    try:
        result = odometry.rgbd_odometry_multi_scale(
            _rgbd(second, images),
            _rgbd(first, images),
            core.Tensor(matrix),
            core.Tensor(guess.matrix),
            1.0,
            5.0,
            [odometry.OdometryConvergenceCriteria(n) for n in (12, 8, 5)],
            odometry.Method.Hybrid,
            odometry.OdometryLossParams(0.07, 0.05, 0.1),
        )
    except RuntimeError:  # "Singular 6x6 linear system detected, tracking failed."
        return None
    return Rigid3.from_matrix(result.transformation.numpy())


def _rgbd(frame: Frame, images: FrameImages) -> Any:
    import open3d as o3d

    size = (frame.depth_camera.width, frame.depth_camera.height)
    colour = cv2.resize(images.rgb(frame.index), size, interpolation=cv2.INTER_AREA)
    image: Any = o3d.t.geometry.Image
    return o3d.t.geometry.RGBDImage(
        image(np.ascontiguousarray(colour)), image(np.ascontiguousarray(images.depth(frame.index).metres))
    )


def _close_loops(track: _Track, rng: np.random.Generator) -> list[Rigid3]:
    """The track's poses after pose-graph optimisation with every loop closure that landmarks and depth confirm."""
    params = tuned(Params)
    import open3d as o3d

    registration: Any = o3d.pipelines.registration
    keys = track.keys
    graph = registration.PoseGraph()
    for key in keys:
        graph.nodes.append(registration.PoseGraphNode(track.poses[key].matrix))
    for i in range(len(keys) - 1):
        motion = track.poses[keys[i]].inverse @ track.poses[keys[i + 1]]
        graph.edges.append(_edge(i + 1, i, motion.matrix, uncertain=False))
    loops = 0
    step = -(-len(keys) // params.most_loop_keys)
    for i in range(0, len(keys), step):
        for j in range(i + max(2, step), len(keys), step):
            first, second = track.sights[keys[i]], track.sights[keys[j]]
            told = motion_between(first.landmarks, second.landmarks, rng)
            if told is None or told.agreeing < params.loop_landmarks:
                continue
            settled = _confirmed(first, second, told.first_from_second)
            if settled is not None:
                graph.edges.append(_edge(j, i, settled.matrix, uncertain=True))
                loops += 1
    if not loops:
        return list(track.poses)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        registration.global_optimization(
            graph,
            registration.GlobalOptimizationLevenbergMarquardt(),
            registration.GlobalOptimizationConvergenceCriteria(),
            registration.GlobalOptimizationOption(
                max_correspondence_distance=0.05, edge_prune_threshold=0.25, reference_node=0
            ),
        )
    key_poses = [Rigid3.from_matrix(np.asarray(node.pose)) for node in graph.nodes]
    owner = np.searchsorted(keys, np.arange(len(track.poses)), side="right") - 1
    return [key_poses[k] @ track.poses[keys[k]].inverse @ pose for k, pose in zip(owner.tolist(), track.poses, strict=True)]


def _edge(source: int, target: int, target_from_source: np.ndarray, *, uncertain: bool) -> Any:
    import open3d as o3d

    # One sigma of 5 mm and 0.2 deg, as measured between keyframes; the rotation comes first
    information = np.diag([1.0 / np.radians(0.2) ** 2] * 3 + [1.0 / 0.005**2] * 3)
    edge: Any = o3d.pipelines.registration.PoseGraphEdge
    return edge(source, target, target_from_source, information, uncertain)
