"""Log-likelihood ratios of a leaf's states given a frame's depth, relative to an unknown scene.

A beam model (Thrun et al. 2005, 6.3): depth is measured on the leaf, on an occluder in front of it, or anywhere as an outlier.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.hypotheses import Hypothesis
from r2c2r_core.segment.motion.leaf import Leaf, edge_points, face_points, rim_points
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the beam model of depth on a leaf."""

    hit: float = param(0.6, "share", "Probability that a reading towards a leaf is on the leaf")
    before: float = param(
        0.95, "ratio", "Likelihood of an occluder in front of a leaf relative to one without the leaf: occlusion is no evidence"
    )
    wild: float = param(0.05, "share", "Probability that a reading is an outlier: gloss, glass, flying pixels")
    range_m: float = param(3.0, "m", "Depth range over which readings of an unknown scene are uniform", gt=0)
    floor_m: float = param(0.006, "m", "Standard deviation of a front's position: poses, warp, profile", gt=0)
    same: float = param(2.0, "σ", "Maximum residual of depth beyond an edge for it to be of the same surface")
    rim_cost: float = param(1.5, "log", "Cost of a point beyond a free edge where the leaf should have ended")
    rim_free_m: float = param(
        0.06, "m", "Distance from the closed plane within which neighbouring fronts explain surface beyond the leaf's edges"
    )
    seen_past: float = param(
        -1.0, "log", "Log-likelihood ratio of a reading below which it looks past the leaf's place", ge=-10, le=0
    )
    told_apart: float = param(0.25, "share", "Fraction of a frame's readings that count: their errors are correlated", gt=0)
    flattest: float = param(
        0.12, "cosine", "Minimum cosine between the viewing ray and the normal of a leaf for its readings to count"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Points of a leaf in each state (q, n, 3), world frame, with their normals and areas."""

    points: np.ndarray
    outward: np.ndarray  # (q, 3) unit normal of their face
    spread_m: np.ndarray  # (n,) standard deviation along the normal from the step between tested states
    area_m2: float  # of the face around each point
    on_plane: np.ndarray  # (q, n) bool: close enough to the closed plane for adjacent fronts to explain the depth there
    beside: np.ndarray  # (q, n) bool: outside the closed leaf's outline, as seen by a person facing it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class States:
    """Sample points of a hypothesis: the leaf in each state."""

    leaf: Leaf
    hypothesis: Hypothesis
    faces: tuple[Samples, Samples]  # the outer face and the back
    edges: tuple[Samples, ...]  # the narrow faces of its free edges: all that is visible of a leaf seen edge-on
    rim: Samples  # beyond its free edges
    covered: np.ndarray  # (q, n) bool: closed points that a leaf sliding within its plane still covers


def lay_out(leaf: Leaf, hypothesis: Hypothesis) -> States:
    """Sample points of every tested state."""
    fixed = hypothesis.way if hypothesis.turns else None
    face, rim = face_points(leaf), rim_points(leaf, fixed)
    area = leaf.width_m * leaf.height_m / len(face)
    outward = np.array([0.0, -1.0, 0.0])
    along = face[None, :, 0] - hypothesis.states[:, None] * hypothesis.axis[0]
    return States(
        leaf=leaf,
        hypothesis=hypothesis,
        faces=(_moved(leaf, hypothesis, face, outward, area), _moved(leaf, hypothesis, face + leaf.behind, outward, area)),
        edges=tuple(_moved(leaf, hypothesis, *edge) for edge in edge_points(leaf, fixed)),
        rim=_moved(leaf, hypothesis, rim, outward, area),
        covered=np.abs(along) < leaf.half_m[0],
    )


def _moved(leaf: Leaf, hypothesis: Hypothesis, points: Points, outward: Vector3, area_m2: float) -> Samples:
    """Points of the closed leaf (front frame) in every state."""
    place, (half_w, half_h) = leaf.world_from_front, leaf.half_m
    rotations, shifts = hypothesis.poses()
    step = float(hypothesis.states[1] - hypothesis.states[0]) / np.sqrt(12)
    velocity = np.cross(hypothesis.axis, points - hypothesis.pivot) if hypothesis.turns else hypothesis.axis[None]
    local = points @ rotations.transpose(0, 2, 1) + shifts[:, None]
    return Samples(
        points=place.apply(local.reshape(-1, 3)).reshape(local.shape),
        outward=place.turn(rotations @ outward),
        spread_m=np.broadcast_to(np.abs(velocity @ outward) * step, len(points)),
        area_m2=area_m2,
        on_plane=np.abs(local[..., 1]) < tuned(Params).rim_free_m,
        beside=(np.abs(local[..., 0]) > half_w) | (np.abs(local[..., 2]) > half_h),
    )


def closed_counts(leaf: Leaf, frames: Sequence[Frame], scene: Scene) -> np.ndarray:
    """Counts (frames, 4) of the closed leaf's points where depth agrees, looks past, is of an occluder, or is missing."""
    points = leaf.world_from_front.apply(face_points(leaf))
    looks = [look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index)) for frame in frames]
    z, seen = np.stack([look.z_m for look in looks]), np.stack([look.seen_m for look in looks])
    margin = 2 * tuned(Params).floor_m
    agrees = scene.noise.agrees(seen, z, margin)
    through = scene.noise.seen_through(seen, z, margin)
    silent = np.stack([look.inside for look in looks]) & (seen == 0)
    return np.stack([agrees, through, (seen > 0) & ~agrees & ~through, silent]).sum(axis=2).T


def in_view(leaf: Leaf, pose: Rigid3, scene: Scene, frame: Frame) -> bool:
    """Whether a frame shows a part of the leaf in a pose (front_from_leaf)."""
    points = leaf.world_from_front.apply(pose.apply(face_points(leaf)))
    z, seen, inside = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
    return bool((inside & ~scene.noise.occluded(seen, z, 2 * tuned(Params).floor_m)).any())


def evidence(states: States, scene: Scene, frame: Frame, *, edges: bool = False) -> np.ndarray:
    """Log-likelihood ratio of each state (q,) in a frame, relative to an unknown scene.

    `edges` adds the leaf's narrow faces, which helps where states are closer together than a board's thickness.
    """
    params = tuned(Params)
    if states.hypothesis.lateral:
        return _lateral(states, scene, frame)
    seen = _towards(frame.world_from_camera.translation, *states.faces)
    face, rim = _readings(seen, scene, frame), _readings(states.rim, scene, frame)
    told = np.where(seen.on_plane & seen.beside, np.minimum(face.ratio, 0.0), face.ratio)
    total = (told * face.weight).sum(axis=1) - params.rim_cost * (rim.agrees * ~states.rim.on_plane * rim.weight).sum(axis=1)
    for edge in states.edges if edges else ():
        read = _readings(edge, scene, frame, facing=True)
        total = total + (read.ratio * read.weight).sum(axis=1)
    return np.asarray(params.told_apart * total)


def static_evidence(states: States, scene: Scene, frames: Sequence[Frame]) -> np.ndarray:
    """Mean evidence (q,) for each state in frames that show the leaf closed: of surfaces that stand where it would be open.

    Points near the closed plane are left out, where the closed leaf itself is.
    """
    found = [np.zeros(len(states.hypothesis.states))]
    for frame in frames:
        seen = _towards(frame.world_from_camera.translation, *states.faces)
        read = _readings(seen, scene, frame)
        told = (np.where(seen.on_plane, 0.0, read.ratio) * read.weight).sum(axis=1)
        found.append(np.maximum(tuned(Params).told_apart * told, 0.0))
    return np.asarray(sum(found) / max(len(frames), 1))


def _towards(camera: Vector3, front: Samples, back: Samples) -> Samples:
    """Face visible to a camera in each state."""
    is_back = ((camera - front.points[:, 0]) * front.outward).sum(axis=1)[:, None] < 0
    return replace(
        front,
        points=np.where(is_back[..., None], back.points, front.points),
        on_plane=np.where(is_back, back.on_plane, front.on_plane),
        beside=np.where(is_back, back.beside, front.beside),
    )


def _lateral(states: States, scene: Scene, frame: Frame) -> np.ndarray:
    """Lateral states by the closed place alone (others may stand beside it): covered points agree, vacated are seen past."""
    params, front = tuned(Params), states.faces[0]
    read = _readings(replace(front, points=front.points[:1], outward=front.outward[:1]), scene, frame)
    vacated = np.where(read.agrees, np.log(params.wild), np.where(read.ratio < params.seen_past, -np.log(params.hit), 0.0))
    each = np.where(states.covered, read.ratio, vacated) * read.weight
    return np.asarray(params.told_apart * each.sum(axis=1))


class _Readings(NamedTuple):
    """Depth evidence at points (q, n)."""

    ratio: np.ndarray  # log-likelihood ratios
    agrees: np.ndarray  # bool
    weight: np.ndarray  # weight of each reading


def _readings(samples: Samples, scene: Scene, frame: Frame, *, facing: bool = False) -> _Readings:
    """Depth readings at the samples' pixels, by their distance from the samples' face along its normal."""
    params, camera = tuned(Params), frame.world_from_camera.translation
    shape, flat = samples.points.shape[:2], samples.points.reshape(-1, 3)
    z, seen, _ = look_up(flat, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
    known = np.flatnonzero(seen > 0)  # most frames show few of the possible poses of a leaf
    state, point = np.divmod(known, shape[1])
    z, seen, ray = z[known], seen[known], flat[known] - camera
    towards = ((camera - samples.points[:, 0]) * samples.outward).sum(axis=1)  # one per state: a face is flat
    height = np.abs(towards)[state]  # of the camera over the face
    cosine = height / np.sqrt(np.einsum("ij,ij->i", ray, ray))
    behind_m = (seen / z - 1) * height
    sigma = np.sqrt((scene.noise.sigma(z) * height / z) ** 2 + params.floor_m**2 + samples.spread_m[point] ** 2)
    shows = (cosine > params.flattest) & ((towards[state] > 0) | (not facing))
    density = np.exp(-0.5 * (behind_m / sigma) ** 2) / (np.sqrt(2 * np.pi) * sigma) * params.range_m * height / z
    ratio = np.log(params.hit * density + params.before * (behind_m < 0) + params.wild)
    # Readings are pixels: a leaf seen at a flat angle or from afar has fewer than it has points.
    pixels = samples.area_m2 * frame.depth_camera.fx * frame.depth_camera.fy * cosine / z**2
    found = _Readings(np.zeros(shape), np.zeros(shape, bool), np.zeros(shape))
    for grid, values in zip(found, (ratio, np.abs(behind_m) < params.same * sigma, np.minimum(pixels, 1.0)), strict=True):
        grid.reshape(-1)[known] = np.where(shows, values, 0)
    return found
