"""Scale and pose hypotheses from matched points, voted over frames (paper eq. 2-7, corrected by method.md rows 1-7)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.align.lift import Lifted, depth_at, lift_render
from r2c2r_core.align.observe import placing_noise
from r2c2r_core.align.protocol import Features, Matcher
from r2c2r_core.align.render import MeshView
from r2c2r_core.align.view import View
from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import unproject
from r2c2r_core.geometry.consensus import similarity_consensus
from r2c2r_core.geometry.registration import SimilarityFit, refit
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned inlier thresholds of the vote."""

    relative: float = param(
        0.05,
        "ratio",
        "Maximum distance of an inlier relative to the scaled mesh's size",
        source="with an absolute limit alone, a tiny scale wins",
    )


class Votes(NamedTuple):
    """Pose hypotheses from features and their inlier counts."""

    hypotheses: tuple[Similarity3, ...]  # world_from_mesh, best first
    by_frame: dict[int, int]  # Frame.index -> inliers of that frame's hypothesis over all frames


def vote(lifted: list[Lifted], size: float, scale_range: tuple[float, float], rng: np.random.Generator) -> Votes:
    """RANSAC hypotheses of each frame and of all together, scored by the inliers of all and refitted on them with free scale.

    `size` is the mesh's diagonal in its own unit. Departs from eq. 2-7: scale, rotation and translation are estimated together
    (errors of a scale fixed first leak into the rest), frames are summed, where eq. 7 leaves its index, and frames too poor to
    vote alone still count in the joint estimate.
    """
    params = tuned(Params)
    by_frame = {m.frame_index: 0 for m in lifted}
    if not sum(len(m.points_mesh) for m in lifted):
        return Votes((), by_frame)
    mesh = np.concatenate([m.points_mesh for m in lifted])
    world = np.concatenate([m.points_world for m in lifted])
    limit = np.concatenate([3.0 * m.noise_m for m in lifted])
    judged: list[tuple[int, SimilarityFit]] = []
    for m in [*lifted, None]:
        source, target, allowed = (mesh, world, limit) if m is None else (m.points_mesh, m.points_world, 3.0 * m.noise_m)
        own = similarity_consensus(
            source, target, threshold=allowed, rng=rng, scale_range=scale_range, relative_threshold=params.relative
        )
        if own is None:
            continue
        agrees = inliers_of(own.target_from_source, mesh, world, limit, size)
        joint = refit(mesh, world, agrees, limit, params.relative * size, 4) or own
        if not scale_range[0] <= joint.target_from_source.scale <= scale_range[1]:
            continue
        count = int(np.count_nonzero(inliers_of(joint.target_from_source, mesh, world, limit, size)))
        if m is not None:
            by_frame[m.frame_index] = count
        judged.append((count, joint))
    judged.sort(key=lambda pair: -pair[0])
    return Votes(tuple(fit.target_from_source for _, fit in judged[:5]), by_frame)


def inliers_of(pose: Similarity3, mesh: Points, world: Points, limit: np.ndarray, size: float) -> np.ndarray:
    """Inlier mask of a pose's matches, within the depth noise and a fraction of the placed size."""
    residual = np.linalg.norm(pose.apply(mesh) - world, axis=1)
    return np.asarray(residual < np.minimum(limit, tuned(Params).relative * size * pose.scale))


def match_views(
    photos: tuple[View, ...],
    renders: tuple[MeshView, ...],
    render_features: list[Features],
    matcher: Matcher,
    centre: np.ndarray,
    radius: float,
    *,
    best_views: int = 5,
) -> list[Lifted]:
    """Each photo's matches with the rendered views that share the most matches, lifted to points."""
    return [_lift_photo(p, renders, render_features, matcher, centre, radius, best_views) for p in photos]


def _lift_photo(
    photo: View,
    renders: tuple[MeshView, ...],
    render_features: list[Features],
    matcher: Matcher,
    centre: np.ndarray,
    radius: float,
    best_views: int,
) -> Lifted:
    """Lifted matches of one photo."""
    own = matcher.describe(photo.colour.clip(0, 255).astype(np.uint8), photo.mask)
    depth = depth_at(own.uv_px, photo.depth_m)
    points_world = photo.world_from_camera.apply(unproject(own.uv_px, depth, photo.camera))
    pairs = matcher.match_many(own, render_features)
    order = sorted(range(len(pairs)), key=lambda k: -len(pairs[k].first))[:best_views]
    mesh_points, photo_rows = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for k in order:
        lifted, hit = lift_render(renders[k], render_features[k].uv_px[pairs[k].second], centre, radius)
        hit &= depth[pairs[k].first] > 0
        mesh_points.append(lifted[hit])
        photo_rows.append(pairs[k].first[hit])
    rows = np.concatenate(photo_rows)
    rays = points_world[rows] - photo.world_from_camera.translation
    rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-9)
    return Lifted(
        photo.frame_index,
        np.concatenate(mesh_points),
        points_world[rows],
        placing_noise(photo.noise, depth[rows]),
        rays,
        depth[rows] / photo.camera.fx,
    )
