"""Placement of a candidate in the scan (paper §4.3, corrected by method.md rows 1-7): by search, or at a known pose.

The search: geometry proposes (all rotations of the mesh's box onto the measured box), features add proposals, and one score
decides: rendered masks, depth and colours against the photos. It uses only the mesh's surface and texture.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from r2c2r_core.align.hypotheses import Hypothesis, box_hypotheses, settle
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation, observe
from r2c2r_core.align.protocol import MATCHERS, Matcher
from r2c2r_core.align.record import record_placement
from r2c2r_core.align.render import render_views
from r2c2r_core.align.search import Case, Trial, finish_contenders, finish_known, try_poses
from r2c2r_core.align.shape import Shape, prepare_shape
from r2c2r_core.align.view import View, known_corners, look_at
from r2c2r_core.align.voting import Votes, match_views, vote
from r2c2r_core.errors import PlacementFailed
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import CandidateSet, MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.track import MaskTrack, at_rest
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.tuning import Changes


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignConfig:
    """Sizes of the pose search. Pixel sizes are of our own small views, not of a camera."""

    views: int = setting(9, "number of photos that a pose is compared with", ge=1, le=200)
    view_px: int = setting(128, "side of the rendered views that are compared, in px", ge=16, le=1024)
    match_photos: int = setting(6, "number of photos in which keypoints are matched", ge=1, le=200)
    match_views: int = setting(100, "number of rendered views for matching keypoints (200 in the paper)", ge=1, le=1000)
    match_px: int = setting(200, "side of the views for keypoint matching, in px", ge=16, le=1024)
    points: int = setting(1600, "maximum number of observed points", ge=10, le=1_000_000)
    surface_points: int = setting(8000, "number of points sampled on the mesh", ge=10, le=1_000_000)
    face_limit: int = setting(6000, "maximum number of triangles of a simplified candidate", ge=100, le=1_000_000)
    settled: int = setting(36, "number of pose hypotheses rendered and compared", ge=1, le=10_000)
    refined: int = setting(8, "number of the best hypotheses that are refined", ge=1, le=1000)
    least_iou: float = setting(0.2, "minimum IoU with the masks of a trustworthy pose", ge=0, le=1)
    weights: str = setting(
        "", "learned matcher's weights, folder or hub id; empty: R2C2R_<NAME>_WEIGHTS, else its default", max_length=4000
    )
    params: Changes = tuned_numbers("align")


@dataclass(frozen=True, slots=True)
class Placer:
    """Placement of any candidate with these settings."""

    matcher: str = MATCHERS.default
    config: AlignConfig = AlignConfig()
    seed: int = 0

    def __call__(self, capture: Capture, track: MaskTrack, asset: MeshAsset, *, progress: Progress = SILENT) -> Placement:
        """Placement of a candidate with its evidence; raises PlacementFailed."""
        config, capture = self.config, at_rest(capture, track)
        rng = np.random.default_rng(self.seed)
        progress.at(0.0, f"{asset.object_name}: selecting views")
        observation = observe(capture, track, view_count=config.views, size_px=config.view_px, point_count=config.points)
        _require_evidence(observation, track)
        shape = prepare_shape(asset.mesh, point_count=config.surface_points, face_limit=config.face_limit, rng=rng)
        if asset.world_from_mesh is not None:
            return _place_known(
                asset, asset.world_from_mesh, Case(shape=shape, observation=observation, track=track, lifted=[]), config
            )
        progress.at(0.15, f"{asset.object_name}: matching keypoints")
        lifted = _match(capture, track, asset.mesh, observation, _loaded(self.matcher, config.weights), config)
        case = Case(shape=shape, observation=observation, track=track, lifted=lifted)
        scale_range = _scale_range(shape, observation)
        votes = vote(lifted, shape.diameter, scale_range, rng)
        progress.at(0.5, f"{asset.object_name}: trying poses")
        boxes = box_hypotheses(shape, observation, track, capture.room.manhattan_yaw_rad)
        proposals = settle(boxes, shape, observation, config.settled, outlines=track.kind != "front")
        proposals += [Hypothesis(pose, _upright_axis(shape, pose), "features") for pose in votes.hypotheses]
        trials = try_poses(proposals, case, scale_range, config.refined, progress.part(0.55, 0.9))
        if not trials:
            raise PlacementFailed(
                f"{asset.object_name}: no pose of {asset.candidate_id} fits the visible size",
                hint="choose another candidate, or check the mask",
            )
        progress.at(0.9, f"{asset.object_name}: finishing")
        best, *others = finish_contenders(trials, case)
        _require_cover(best, asset, config)
        return record_placement(best, others, case, votes, asset, f"{best.hypothesis.source} + {self.matcher}")


def place_candidate(
    capture: Capture, track: MaskTrack, found: CandidateSet, candidate_id: str, place: Placer, *, progress: Progress = SILENT
) -> Placement:
    """Placement of one of an object's candidates; raises PlacementFailed."""
    return place(capture, track, found.candidate(candidate_id), progress=progress)


def _place_known(asset: MeshAsset, pose: Similarity3, case: Case, config: AlignConfig) -> Placement:
    """Placement at the generator's own pose."""
    best = finish_known(Hypothesis(pose, _upright_axis(case.shape, pose), "generator"), case)
    _require_cover(best, asset, config)
    return record_placement(best, [], case, Votes((), {}), asset, "generator's pose")


def _require_cover(best: Trial, asset: MeshAsset, config: AlignConfig) -> None:
    """Raise if even the best pose does not cover the masks."""
    if best.judgement.iou < config.least_iou:
        raise PlacementFailed(
            f"{asset.object_name}: the best pose of {asset.candidate_id} covers the mask with IoU {best.judgement.iou:.2f}, "
            f"expected at least {config.least_iou:.2f}",
            hint="choose another candidate, or add a click on a frame that shows more of the object",
        )


@cache
def _loaded(matcher: str, weights: str) -> Matcher:
    """The matcher, cached for the next object: learned ones take seconds to load."""
    return MATCHERS.load(matcher, weights=weights)


def _require_evidence(observation: Observation, track: MaskTrack) -> None:
    """Raise if there is no evidence to place against."""
    if not observation.views:
        raise PlacementFailed(f"{track.name}: no frame shows enough of the object", hint="add a click on a nearer frame")
    if len(observation.points_world) < 30 and not len(known_corners(track)):
        raise PlacementFailed(
            f"{track.name}: {len(observation.points_world)} depth points inside the masks, expected at least 30",
            hint="film it from nearer, or click frames in which it has depth",
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
    """The views with the largest masks again, at the size that keypoints need."""
    order = sorted(observation.views, key=lambda v: -int(np.count_nonzero(v.mask)))[: config.match_photos]
    return tuple(
        look_at(capture, track, capture.frame(v.frame_index), observation.centre_world, config.match_px) for v in order
    )


def _scale_range(shape: Shape, observation: Observation) -> tuple[float, float]:
    """Scales at which the mesh is about as large as the visible part, up to three times that (the rest may be hidden)."""
    likely = observation.size_m / shape.diameter
    return 0.65 * likely, 3.0 * likely


def _upright_axis(shape: Shape, pose: Similarity3) -> np.ndarray | None:
    """Mesh direction that a pose makes nearly vertical, if the object may stand along it."""
    up = pose.rotation.T @ np.array([0.0, 0.0, 1.0])
    nearest = max(shape.ups, key=lambda u: float(u @ up))
    return nearest if nearest @ up > np.cos(np.radians(5)) else None
