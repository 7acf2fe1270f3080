"""Result record of a chosen pose: its evidence, and reasons for doubt in words."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.align.certainty import loose_ends, spread_of, ties
from r2c2r_core.align.refine import point_condition
from r2c2r_core.align.residuals import anchors_for
from r2c2r_core.align.search import Case, Trial, angle_deg, lean_deg, resized, turned_otherwise
from r2c2r_core.align.shape import surface_distance
from r2c2r_core.align.voting import Votes, inliers_of
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.model.placement import NO_MATCHES, MatchedPoints, Placement, Spread
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned thresholds of doubtful placements."""

    trusted_iou: float = param(0.6, "score", "Mask IoU below which a placement is doubtful")


def record_placement(best: Trial, others: list[Trial], case: Case, votes: Votes, asset: MeshAsset, method: str) -> Placement:
    """Placement of `asset` at the best pose; `others` are the refined losing trials, ordered by score."""
    rival = next((t for t in others if turned_otherwise(t, best, case.shape)), None)
    other_size = next((t for t in others if resized(t, best)), None)
    matched = _matched(case, best.pose)
    anchors = anchors_for(case.track, case.shape, best.hypothesis.up_mesh)
    spread = spread_of(best.pose, case.shape, case.observation, anchors, case.lifted)
    rms_m, condition = _rms(best.pose, case), point_condition(best.pose, case.shape, case.observation)
    doubts = _doubts(best, rival, other_size, spread, case)
    return Placement(
        object_name=asset.object_name,
        candidate_id=asset.candidate_id,
        world_from_mesh=best.pose,
        matches=len(matched.inlier),
        inliers=int(np.count_nonzero(matched.inlier)),
        votes=votes.by_frame,
        rms_m=rms_m,
        mask_iou=best.judgement.iou,
        condition=condition,
        unsure=bool(doubts),
        runner_up=None if rival is None else float(np.clip(rival.judgement.score / max(best.judgement.score, 1e-6), 0, 1)),
        method=method,
        warnings=(*doubts, *_warnings(best.pose, rms_m, condition, case)),
        spread=spread,
        runner_up_turn_deg=None if rival is None else angle_deg(best.pose, rival.pose),
        matched=matched,
    )


def _matched(case: Case, pose: Similarity3) -> MatchedPoints:
    """All matches as one list of pairs, with a mask of the pose's inliers."""
    lifted = case.lifted
    if not lifted:
        return NO_MATCHES
    mesh, world = np.concatenate([m.points_mesh for m in lifted]), np.concatenate([m.points_world for m in lifted])
    noise_m = np.concatenate([m.noise_m for m in lifted])
    return MatchedPoints(
        frame_index=np.repeat([m.frame_index for m in lifted], [len(m.points_mesh) for m in lifted]).astype(np.int64),
        points_mesh=mesh,
        points_world=world,
        noise_m=noise_m,
        inlier=inliers_of(pose, mesh, world, 3.0 * noise_m, case.shape.diameter),
    )


def _rms(pose: Similarity3, case: Case) -> float:
    """RMS distance of the observed points to the placed mesh, without the farthest tenth (mask leaks)."""
    if not len(case.observation.points_world):
        return float("nan")
    distance = np.sort(surface_distance(pose, case.shape, case.observation.points_world))
    return float(np.sqrt((distance[: max(int(0.9 * len(distance)), 1)] ** 2).mean()))


def _doubts(best: Trial, rival: Trial | None, other_size: Trial | None, spread: Spread, case: Case) -> tuple[str, ...]:
    """Reasons why the pose may be wrong, a line each; empty for a trustworthy one."""
    lines = []
    if rival is not None and ties(best.judgement, rival.judgement):
        turn = angle_deg(best.pose, rival.pose)
        lines.append(f"another orientation ({turn:.0f}°) fits about as well: check which side is the front")
    if other_size is not None and ties(best.judgement, other_size.judgement):
        share = other_size.pose.scale / best.pose.scale - 1.0
        lines.append(f"{abs(share):.0%} {'larger' if share > 0 else 'smaller'} it fits about as well: check its size")
    if best.judgement.iou < tuned(Params).trusted_iou:
        lines.append(f"the placed mesh covers the masks poorly (IoU {best.judgement.iou:.2f})")
    if len(case.observation.views) < 2:
        lines.append("only one frame shows the object: its position and size are unconfirmed")
    return (*lines, *loose_ends(spread, case.track.front))


def _warnings(pose: Similarity3, rms_m: float, condition: float, case: Case) -> tuple[str, ...]:
    """Further warnings for a person, a line each."""
    lines = []
    allowed = max(0.015, 0.03 * case.observation.size_m)
    if np.isnan(rms_m):
        lines.append("the scan has no depth inside its masks: it was placed by its outlines only")
    elif rms_m > allowed:
        lines.append(f"scan and mesh are {rms_m * 1000:.0f} mm apart (rms; {allowed * 1000:.0f} mm allowed)")
    if condition > 30000:
        lines.append("it is flat or round: only its outlines tell how far it slid or turned; compare them with the photos")
    if len(case.observation.views) == 2:
        lines.append("only 2 frames show the object")
    lean = lean_deg(pose, case)
    if lean > 0:
        lines.append(f"it is tilted by {lean:.0f}° from every stable pose")
    return tuple(lines)
