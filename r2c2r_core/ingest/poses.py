"""Pose refinement against drift: pose-graph optimisation with point-to-plane factors and an odometry prior.

All overlapping keyframe pairs are aligned jointly; the prior lets a correction change only slowly from one keyframe to the
next. Unlike frame-to-model fitting, this needs no fused model, in which drift would already have doubled surfaces, and it
closes loops without a separate step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from r2c2r_core.geometry.least_squares import Normal
from r2c2r_core.geometry.transforms import Rigid3, nearest_rotation
from r2c2r_core.ingest.cloud import spread_frames
from r2c2r_core.ingest.overlap import SmallView, match, overlaps, small_view
from r2c2r_core.model.capture import Frame, FrameImages, PoseEvidence
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of pose refinement."""

    least_overlap: float = param(0.3, "share", "Minimum mutual overlap of two views to be matched")
    least_matches: int = param(50, "count", "Minimum number of matched points of a pair to be used")
    least_loops: int = param(
        8, "count", "Minimum number of loop pairs (one place seen at different times) for poses to be refined"
    )
    held_out: int = param(4, "count", "Stride of loop pairs that are excluded from the fit and validate it", ge=2)
    least_gain: float = param(
        0.15,
        "share",
        "Minimum relative reduction of the disagreement for refined poses to be accepted",
        source="exact poses gain 5 to 8 % (noise is fitted), a phone's 20 to 25 %, 3 cm of drift 50 % and more",
    )
    most_gap_m: float = param(
        0.012,
        "m",
        "Maximum disagreement after refinement for refined poses to be accepted",
        source="depth noise leaves 3 to 5 mm, wrong axes or inverted poses 16 to 100",
    )
    most_change: float = param(
        0.2,
        "share",
        "Maximum change of the relative motions, as a fraction of the motion, for refined poses to be accepted",
        source="drift of 8 cm takes 0.02 to 0.12, wrong axes before one door 0.27",
    )
    independent: float = param(
        15.0,
        "count",
        "Effective number of independent points of a pair",
        source="a sensor's error is the same over whole surfaces",
        gt=0,
    )
    step_m: float = param(
        0.002, "m", "Standard deviation of the change of a correction's translation between successive keyframes", gt=0
    )
    step_deg: float = param(
        0.1, "deg", "Standard deviation of the change of a correction's rotation between successive keyframes", gt=0
    )
    stay_m: float = param(0.3, "m", "Standard deviation of the absolute translation prior, which fixes the gauge", gt=0)
    stay_deg: float = param(10.0, "deg", "Standard deviation of the absolute rotation prior, which fixes the gauge", gt=0)
    reaches_m: tuple[float, float, float, float, float, float] = param(
        (0.15, 0.12, 0.08, 0.06, 0.04, 0.04), "m", "Maximum matching distance between points of two frames in each round"
    )


class SettledPoses(NamedTuple):
    """The frames with their final poses, and the evidence for them."""

    frames: tuple[Frame, ...]
    evidence: PoseEvidence
    notices: tuple[str, ...]


def refine_poses(
    frames: Sequence[Frame], images: FrameImages, *, most_keyframes: int, far_m: float, progress: Progress = SILENT
) -> SettledPoses:
    """Poses refined on depth if that clearly improves held-out loop pairs; otherwise the given ones."""
    params = tuned(Params)
    keyframes = spread_frames(frames, most_keyframes)
    views = [small_view(f, images, far_m) for f in progress.each(keyframes, "checking the poses, frame")]
    given = [f.world_from_camera for f in keyframes]
    near, loops = overlapping_pairs(overlaps(views, given))
    if len(loops) < params.least_loops:
        return SettledPoses(tuple(frames), PoseEvidence(source="file", given_gap_m=None, gap_m=None), ())
    judges = loops[:: params.held_out]
    moved = bring_together(views, given, [*near, *(p for p in loops if p not in set(judges))])
    moved = _held_level(given, moved)
    before, after = median_gap(views, given, judges), median_gap(views, moved, judges)
    if before is None or after is None or not _is_drift(given, moved, before, after):
        return SettledPoses(tuple(frames), PoseEvidence(source="file", given_gap_m=before, gap_m=before), ())
    shift_m = np.linalg.norm([a.translation - b.translation for a, b in zip(moved, given, strict=True)], axis=1)
    notice = (
        f"the recorded poses drifted and were corrected: frames of one place at different times disagreed by "
        f"{before * 1000:.1f} mm, now by {after * 1000:.1f} mm; cameras moved by up to {shift_m.max() * 1000:.0f} mm"
    )
    recorded = np.array([f.world_from_camera.matrix for f in frames])
    evidence = PoseEvidence(source="refined", given_gap_m=before, gap_m=after, given=recorded)
    return SettledPoses(carried(frames, keyframes, moved), evidence, (notice,))


def _held_level(given: Sequence[Rigid3], moved: Sequence[Rigid3]) -> list[Rigid3]:
    """The refined poses, moved as a whole to the given poses' mean rotation and position, which depth leaves undetermined.

    A phone's gravity is accurate, and a room turned by half a degree would be tilted in it.
    """
    turn = nearest_rotation(sum((a.rotation @ b.rotation.T for a, b in zip(given, moved, strict=True)), np.zeros((3, 3))))
    turned = [Rigid3(turn, np.zeros(3)) @ pose for pose in moved]
    shift = np.mean([a.translation - b.translation for a, b in zip(given, turned, strict=True)], axis=0)
    return [Rigid3(pose.rotation, pose.translation + shift) for pose in turned]


def _is_drift(given: Sequence[Rigid3], moved: Sequence[Rigid3], before_m: float, after_m: float) -> bool:
    """Whether a correction is drift: clear gain, small final error, small against the motion (a wrong convention is not)."""
    params = tuned(Params)
    motion = changed = 0.0
    for (a, b), (c, d) in zip(pairwise(given), pairwise(moved), strict=True):
        step = a.inverse @ b
        motion += _size(step)
        changed += _size(step.inverse @ c.inverse @ d)
    return (
        after_m < (1.0 - params.least_gain) * before_m and after_m < params.most_gap_m and changed < params.most_change * motion
    )


def overlapping_pairs(shares: np.ndarray, *, near: int = 3, each: int = 3) -> tuple[list[Pair], list[Pair]]:
    """Pairs of successive keyframes, and loop pairs that meet again later, from the overlap matrix (n, n)."""
    params = tuned(Params)
    count = len(shares)
    apart = max(near + 1, count // 10)
    both = np.minimum(shares, shares.T)
    following = [(i, i + k) for k in range(1, near + 1) for i in range(count - k) if both[i, i + k] > params.least_overlap]
    loops: set[Pair] = set()
    for i in range(count):
        again = [
            int(j) for j in np.argsort(-both[i], kind="stable") if abs(i - j) >= apart and both[i, j] > params.least_overlap
        ]
        loops.update((min(i, j), max(i, j)) for j in again[:each])
    return following, sorted(loops)


def bring_together(
    views: Sequence[SmallView],
    poses: Sequence[Rigid3],
    pairs: Sequence[Pair],
    *,
    reaches_m: Sequence[float] | None = None,
    step_m: float | None = None,
    step_deg: float | None = None,
) -> list[Rigid3]:
    """Poses (world_from_camera) that align the views of `pairs`: Gauss-Newton with a shrinking matching distance.

    Defaults of the matching distances and of the prior on successive corrections are those for keyframes.
    """
    params = tuned(Params)
    count = len(views)
    links = np.diff(np.eye(count), axis=0)
    step = (params.step_m if step_m is None else step_m, params.step_deg if step_deg is None else step_deg)
    prior = np.kron(links.T @ links, _precision(*step)) + np.kron(np.eye(count), _precision(params.stay_m, params.stay_deg))
    corrections = np.zeros((count, 6))  # metres, then a rotation vector about the camera's centre; both along world axes
    current = list(poses)
    for reach_m in params.reaches_m if reaches_m is None else reaches_m:
        matrix, pull = prior.copy(), -(prior @ corrections.ravel())
        for i, j in pairs:
            found = match(views[i], views[j], current[i], current[j], reach_m)
            if len(found.weights) < params.least_matches:
                continue
            slopes = np.hstack(
                [
                    found.normals,
                    np.cross(found.moved - current[i].translation, found.normals),
                    -found.normals,
                    -np.cross(found.still - current[j].translation, found.normals),
                ]
            )
            normal = Normal.of(slopes, found.gaps_m, found.weights * (params.independent / len(found.weights)))
            rows = np.r_[6 * i : 6 * i + 6, 6 * j : 6 * j + 6]
            matrix[np.ix_(rows, rows)] += normal.information
            pull[rows] += normal.pull
        corrections += np.linalg.solve(matrix, pull).reshape(count, 6)
        current = [_corrected(pose, c) for pose, c in zip(poses, corrections, strict=True)]
    return current


def median_gap(views: Sequence[SmallView], poses: Sequence[Rigid3], pairs: Sequence[Pair]) -> float | None:
    """Median over pairs of the median point-to-plane distance (m) of both views; None with too few matches."""
    params = tuned(Params)
    found = [match(views[i], views[j], poses[i], poses[j], params.reaches_m[0]) for i, j in pairs]
    gaps = [float(np.median(np.abs(m.gaps_m))) for m in found if len(m.weights) >= params.least_matches]
    return float(np.median(gaps)) if gaps else None


def carried(frames: Sequence[Frame], keyframes: Sequence[Frame], moved: Sequence[Rigid3]) -> tuple[Frame, ...]:
    """All frames with the keyframes' corrections, interpolated by frame number in between."""
    from scipy.spatial.transform import Rotation

    numbers = np.array([f.index for f in keyframes], dtype=np.float64)
    shifts = np.array([m.translation - f.world_from_camera.translation for m, f in zip(moved, keyframes, strict=True)])
    turns = np.array([m.rotation @ f.world_from_camera.rotation.T for m, f in zip(moved, keyframes, strict=True)])
    table = np.hstack([shifts, Rotation.from_matrix(turns).as_rotvec()])
    return tuple(
        replace(
            f, world_from_camera=_corrected(f.world_from_camera, np.array([np.interp(f.index, numbers, c) for c in table.T]))
        )
        for f in frames
    )


def _corrected(pose: Rigid3, correction: np.ndarray) -> Rigid3:
    from scipy.spatial.transform import Rotation

    return Rigid3(Rotation.from_rotvec(correction[3:]).as_matrix() @ pose.rotation, pose.translation + correction[:3])


def _size(motion: Rigid3) -> float:
    """Size of a motion: metres translated plus radians rotated times one metre."""
    cosine = (float(np.trace(motion.rotation)) - 1.0) / 2.0
    return float(np.linalg.norm(motion.translation)) + float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _precision(sigma_m: float, sigma_deg: float) -> np.ndarray:
    return np.diag([1.0 / sigma_m**2] * 3 + [1.0 / np.radians(sigma_deg) ** 2] * 3)
