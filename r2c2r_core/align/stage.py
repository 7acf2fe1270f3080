"""Place a candidate of unknown pose and scale in the scan (paper §4.3, mended by method.md rows 1-7).

Geometry proposes (all turns of the mesh's box onto the measured box), features add proposals, and one score decides:
rendered masks, depth and colours against the photos. Nothing but the mesh's surface and texture is used of the asset.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.align.certainty import loose_ends, spins_alike, spread_of, ties
from r2c2r_core.align.hypotheses import Hypothesis, box_hypotheses, settle
from r2c2r_core.align.judge import Judgement, judge
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation, View, known_corners, look_at, observe
from r2c2r_core.align.protocol import MATCHERS, Matcher
from r2c2r_core.align.refine import anchors_for, point_condition, refine, surface_distance
from r2c2r_core.align.render import render_views
from r2c2r_core.align.shape import Shape, prepare_shape
from r2c2r_core.align.sweep import sweep_loosest
from r2c2r_core.align.voting import Votes, inliers_of, match_views, vote
from r2c2r_core.errors import PlacementFailed
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.placement import NO_MATCHES, MatchedPoints, Placement, Spread
from r2c2r_core.model.track import FrontPanel, MaskTrack
from r2c2r_core.progress import SILENT, Progress

_TRUSTED_IOU = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignConfig:
    """Sizes of the search. Pixel sizes are of our own small views, not of a camera."""

    views: int = 9  # photos compared
    view_px: int = 128
    match_photos: int = 6
    match_views: int = 100  # rendered views (the authors': 200)
    match_px: int = 200
    points: int = 1600  # observed points kept
    surface_points: int = 8000  # samples of the mesh
    face_limit: int = 6000
    settled: int = 36  # hypotheses rendered and compared
    refined: int = 8  # of them refined
    least_iou: float = 0.2  # below it nothing is trustworthy
    weights: str = ""  # of a learned matcher: a folder or a hub id; empty takes R2C2R_<NAME>_WEIGHTS, then its usual id


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """A hypothesis with its score."""

    hypothesis: Hypothesis
    judgement: Judgement


def place_mesh(
    capture: Capture,
    track: MaskTrack,
    asset: MeshAsset,
    matcher: str,
    config: AlignConfig,
    *,
    seed: int = 0,
    progress: Progress = SILENT,
) -> Placement:
    """The similarity that takes the candidate's frame to the world, with its evidence; raises PlacementFailed."""
    rng = np.random.default_rng(seed)
    progress.at(0.0, f"{asset.object_name}: gathering views")
    observation = observe(capture, track, view_count=config.views, size_px=config.view_px, point_count=config.points)
    _require_evidence(observation, track)
    shape = prepare_shape(asset.mesh, point_count=config.surface_points, face_limit=config.face_limit, rng=rng)
    progress.at(0.15, f"{asset.object_name}: matching keypoints")
    lifted = _match(capture, track, asset.mesh, observation, _loaded(matcher, config.weights), config)
    scale_range = _scale_range(shape, observation)
    votes = vote(lifted, shape.diameter, scale_range, rng)
    progress.at(0.5, f"{asset.object_name}: trying poses")
    boxes = box_hypotheses(shape, observation, track, capture.room.manhattan_yaw_rad)
    proposals = settle(boxes, shape, observation, config.settled, outlines=track.kind != "front")
    proposals += [Hypothesis(pose, _upright_axis(shape, pose), "features") for pose in votes.hypotheses]
    trials = _try(proposals, shape, observation, track, lifted, scale_range, config, progress.part(0.55, 0.95))
    if not trials:
        raise PlacementFailed(
            f"{asset.object_name}: no pose of {asset.candidate_id} fits the visible size",
            hint="choose another candidate, or check the mask",
        )
    best = _finish(trials[0], shape, observation, track, lifted)
    if best.judgement.iou < config.least_iou:
        raise PlacementFailed(
            f"{asset.object_name}: the best pose of {asset.candidate_id} covers the mask with IoU {best.judgement.iou:.2f}, "
            f"{config.least_iou:.2f} needed",
            hint="choose another candidate, or add a click on a frame that shows more of the object",
        )
    return _placement(best, trials, lifted, votes, shape, observation, track, asset, matcher)


@cache
def _loaded(matcher: str, weights: str) -> Matcher:
    """The matcher, kept for the next object: learned ones take seconds to load."""
    backend: Matcher = MATCHERS.load(matcher, weights=weights)
    return backend


def _require_evidence(observation: Observation, track: MaskTrack) -> None:
    """Raise where there is nothing to place against."""
    if not observation.views:
        raise PlacementFailed(f"{track.name}: no frame shows enough of the object", hint="add a click on a nearer frame")
    if len(observation.points_world) < 30 and not len(known_corners(track)):
        raise PlacementFailed(
            f"{track.name}: {len(observation.points_world)} depth points inside the masks, 30 needed",
            hint="film it from nearer, or click frames where its depth is measured",
        )


def _match(
    capture: Capture, track: MaskTrack, mesh: TexturedMesh, observation: Observation, matcher: Matcher, config: AlignConfig
) -> list[Lifted]:
    """Matches between the photos and rendered views of the mesh, as points."""
    photos = _larger_views(capture, track, observation, config)
    renders, centre, radius = render_views(mesh, count=config.match_views, size_px=config.match_px)
    features = [matcher.describe(r.image, r.depth > 0) for r in renders]
    return match_views(photos, renders, features, matcher, centre, radius)


def _larger_views(capture: Capture, track: MaskTrack, observation: Observation, config: AlignConfig) -> tuple[View, ...]:
    """The views with the largest masks again, at the size keypoints need."""
    order = sorted(observation.views, key=lambda v: -int(np.count_nonzero(v.mask)))[: config.match_photos]
    return tuple(
        look_at(capture, track, capture.frame(v.frame_index), observation.centre_world, config.match_px) for v in order
    )


def _scale_range(shape: Shape, observation: Observation) -> tuple[float, float]:
    """Scales at which the mesh is as large as what is seen, to three times that (the rest may be hidden)."""
    likely = observation.size_m / shape.diameter
    return 0.65 * likely, 3.0 * likely


def _upright_axis(shape: Shape, pose: Similarity3) -> np.ndarray | None:
    """The mesh direction that a pose nearly makes vertical, if it is one the thing may stand along."""
    up = pose.rotation.T @ np.array([0.0, 0.0, 1.0])
    nearest = max(shape.ups, key=lambda u: float(u @ up))
    return nearest if nearest @ up > np.cos(np.radians(5)) else None


def _try(
    proposals: list[Hypothesis],
    shape: Shape,
    observation: Observation,
    track: MaskTrack,
    lifted: list[Lifted],
    scale_range: tuple[float, float],
    config: AlignConfig,
    progress: Progress,
) -> list[Trial]:
    """Render and compare all proposals in some views, refine the best different ones, and order them by score."""
    front = track.front if track.kind == "front" else None
    few = observation.views[::2] if len(observation.views) > 5 else observation.views
    rough = []
    for k, proposal in enumerate(proposals):
        progress.at(0.5 * k / max(len(proposals), 1), f"{track.name}: pose {k + 1}/{len(proposals)}")
        if scale_range[0] <= proposal.pose.scale <= scale_range[1]:
            rough.append(Trial(hypothesis=proposal, judgement=judge(proposal.pose, shape, few, front)))
    rough.sort(key=lambda t: -t.judgement.score)
    trials = []
    for k, trial in enumerate(_different(rough, 10.0)[: config.refined]):
        progress.at(0.5 + 0.5 * k / config.refined, f"{track.name}: refining pose {k + 1}")
        anchors = anchors_for(track, shape, trial.hypothesis.up_mesh)
        pose = refine(trial.hypothesis.pose, shape, observation, anchors, lifted, free_scale=True, iterations=8, loose=0.06)
        if scale_range[0] <= pose.scale <= scale_range[1]:
            trials.append(
                Trial(hypothesis=trial.hypothesis._replace(pose=pose), judgement=judge(pose, shape, observation.views, front))
            )
    return sorted(trials, key=lambda t: -t.judgement.score)


def _different(trials: list[Trial], angle_deg: float) -> list[Trial]:
    """The best of each group of poses that agree in rotation and scale."""
    kept: list[Trial] = []
    for trial in trials:
        a = trial.hypothesis.pose
        if all(
            _angle_deg(a, k.hypothesis.pose) > angle_deg or abs(np.log(a.scale / k.hypothesis.pose.scale)) > 0.1 for k in kept
        ):
            kept.append(trial)
    return kept


def _finish(trial: Trial, shape: Shape, observation: Observation, track: MaskTrack, lifted: list[Lifted]) -> Trial:
    """Joint refit with scale free, closest points with scale frozen, and colours for what is still loose."""
    anchors = anchors_for(track, shape, trial.hypothesis.up_mesh)
    pose = refine(trial.hypothesis.pose, shape, observation, anchors, lifted, free_scale=True, iterations=10, loose=0.02)
    pose = refine(pose, shape, observation, anchors, lifted, free_scale=False, iterations=4, loose=0.012)
    pose = sweep_loosest(pose, shape, observation, anchors, lifted)
    judgement = judge(pose, shape, observation.views, anchors.front)
    if judgement.score < trial.judgement.score - 0.01:
        return trial
    return Trial(hypothesis=trial.hypothesis._replace(pose=pose), judgement=judgement)


def _placement(
    best: Trial,
    trials: list[Trial],
    lifted: list[Lifted],
    votes: Votes,
    shape: Shape,
    observation: Observation,
    track: MaskTrack,
    asset: MeshAsset,
    matcher: str,
) -> Placement:
    """Gather the evidence for the chosen pose."""
    pose = best.hypothesis.pose
    rival = _rival(best, trials, shape)
    rms = _rms(pose, shape, observation)
    matched = _matched(lifted, pose, shape)
    spread = spread_of(pose, shape, observation, anchors_for(track, shape, best.hypothesis.up_mesh), lifted)
    doubts = _doubts(best, rival, trials, spread, track.front)
    placement = Placement(
        object_name=asset.object_name,
        candidate_id=asset.candidate_id,
        world_from_mesh=pose,
        matches=len(matched.inlier),
        inliers=int(np.count_nonzero(matched.inlier)),
        votes=votes.by_frame,
        rms_m=rms,
        mask_iou=best.judgement.iou,
        condition=point_condition(pose, shape, observation),
        unsure=bool(doubts),
        runner_up=None if rival is None else float(np.clip(rival.judgement.score / max(best.judgement.score, 1e-6), 0, 1)),
        method=f"{best.hypothesis.source} + {matcher}",
        warnings=(),
        spread=spread,
        runner_up_turn_deg=None if rival is None else _angle_deg(pose, rival.hypothesis.pose),
        matched=matched,
    )
    return replace(placement, warnings=(*doubts, *_warnings(placement, observation)))


def _matched(lifted: list[Lifted], pose: Similarity3, shape: Shape) -> MatchedPoints:
    """All matches as one list of pairs, and which of them the pose explains."""
    if not lifted:
        return NO_MATCHES
    mesh, world = np.concatenate([m.points_mesh for m in lifted]), np.concatenate([m.points_world for m in lifted])
    noise_m = np.concatenate([m.noise_m for m in lifted])
    return MatchedPoints(
        frame_index=np.repeat([m.frame_index for m in lifted], [len(m.points_mesh) for m in lifted]).astype(np.int64),
        points_mesh=mesh,
        points_world=world,
        noise_m=noise_m,
        inlier=inliers_of(pose, mesh, world, 3.0 * noise_m, shape.diameter),
    )


def _rms(pose: Similarity3, shape: Shape, observation: Observation) -> float:
    """Root mean square distance of the observed points to the placed mesh, without the farthest tenth (mask leaks)."""
    if not len(observation.points_world):
        return float("nan")
    distance = np.sort(surface_distance(pose, shape, observation.points_world))
    return float(np.sqrt((distance[: max(int(0.9 * len(distance)), 1)] ** 2).mean()))


def _rival(best: Trial, trials: list[Trial], shape: Shape) -> Trial | None:
    """The best pose that is turned differently; a turn about the axis of a round thing is no difference."""
    for trial in trials:
        if _angle_deg(best.hypothesis.pose, trial.hypothesis.pose) < 20.0:
            continue
        turn = trial.hypothesis.pose.rotation.T @ best.hypothesis.pose.rotation
        if spins_alike(shape, Rotation.from_matrix(turn).as_rotvec()):
            continue
        return trial
    return None


def _doubts(best: Trial, rival: Trial | None, others: list[Trial], spread: Spread, front: FrontPanel | None) -> tuple[str, ...]:
    """Why the pose may be wrong, a line each; none where it can be trusted."""
    lines = []
    if rival is not None and ties(best.judgement, rival.judgement):
        turn = _angle_deg(best.hypothesis.pose, rival.hypothesis.pose)
        lines.append(f"another orientation ({turn:.0f} degrees) fits about as well: check which side is the front")
    resized = _resized(best, others)
    if resized is not None:
        share = resized.hypothesis.pose.scale / best.hypothesis.pose.scale - 1.0
        lines.append(f"{abs(share):.0%} {'larger' if share > 0 else 'smaller'} it fits about as well: check its size")
    if best.judgement.iou < _TRUSTED_IOU:
        lines.append(f"the placed mesh covers the masks poorly (IoU {best.judgement.iou:.2f})")
    return (*lines, *loose_ends(spread, front))


def _resized(best: Trial, others: list[Trial]) -> Trial | None:
    """A pose turned alike, of another size, that fits as well."""
    pose = best.hypothesis.pose
    for trial in others:
        other = trial.hypothesis.pose
        alike = _angle_deg(pose, other) < 20.0 and abs(np.log(other.scale / pose.scale)) > 0.04
        if alike and ties(best.judgement, trial.judgement):
            return trial
    return None


def _warnings(placement: Placement, observation: Observation) -> tuple[str, ...]:
    """What else a person should know, a line each."""
    lines = []
    allowed = max(0.015, 0.03 * observation.size_m)
    if not placement.rms_m <= allowed:
        lines.append(f"scan and mesh are {placement.rms_m * 1000:.0f} mm apart (rms; {allowed * 1000:.0f} mm expected at most)")
    if placement.condition > 30000:
        lines.append("the visible surface is flat or round: where it could slide or turn, outlines alone hold it")
    if len(observation.views) < 3:
        lines.append(f"only {len(observation.views)} frames show the object")
    return tuple(lines)


def _angle_deg(a: Similarity3, b: Similarity3) -> float:
    """Angle between the rotations of two poses."""
    cosine = (np.trace(a.rotation.T @ b.rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
