"""Place a candidate of unknown pose and scale in the scan (paper §4.3, mended by method.md rows 1-7).

Geometry proposes (all turns of the mesh's box onto the measured box), features add proposals, and one score decides:
rendered masks, depth and colours against the photos. Nothing but the mesh's surface and texture is used of the asset.
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
from r2c2r_core.align.search import Case, finish_contenders, try_poses
from r2c2r_core.align.shape import Shape, prepare_shape
from r2c2r_core.align.view import View, known_corners, look_at
from r2c2r_core.align.voting import match_views, vote
from r2c2r_core.errors import PlacementFailed
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress


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
    if best.judgement.iou < config.least_iou:
        raise PlacementFailed(
            f"{asset.object_name}: the best pose of {asset.candidate_id} covers the mask with IoU {best.judgement.iou:.2f}, "
            f"{config.least_iou:.2f} needed",
            hint="choose another candidate, or add a click on a frame that shows more of the object",
        )
    return record_placement(best, others, case, votes, asset, matcher)


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
