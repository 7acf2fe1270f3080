"""Multi-view label fusion: masks vote for the vertices of the fused surface they cover (method.md row 13)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Mask, Points
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.masks import PackedMask, unpack_mask
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How masks vote for the surface."""

    frames: int = param(48, "count", "that vote", source="more change nothing and cost 30 ms each", ge=1)
    least_votes: int = param(2, "count", "of a vertex")
    near_m: float = param(0.03, "m", "behind what a frame measured: a point is hidden there")
    behind_m: float = param(
        0.06,
        "m",
        "before what a frame measured: it was seen through",
        source="as much as a handle and an error of pose together",
    )
    small_part: float = param(0.1, "ratio", "to the largest: parts an occluder cuts off stay, crumbs go")


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The part of the fused surface that is the object, in the world; empty where the scan has no surface for it."""

    vertices: Points
    faces: Faces

    @property
    def exists(self) -> bool:
        """Whether there is enough of it to say anything."""
        return len(self.faces) >= 8

    @property
    def area_m2(self) -> float:
        """Of its surface."""
        corners = self.vertices[self.faces]
        return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2)


def agreed_body(scene: Scene, masks: Mapping[int, PackedMask]) -> Body:
    """The faces that more than half of the frames that see them put inside the mask, without crumbs."""
    surface = scene.capture.surface
    inside, seen = vote(scene, masks, surface.vertices_world)
    kept = (seen >= min(tuned(Params).least_votes, len(masks))) & (inside > 0.5 * seen)
    faces = surface.faces[kept[surface.faces].all(axis=1)] if len(surface.faces) else surface.faces
    faces = _without_crumbs(surface.vertices_world, faces)
    used, renumbered = np.unique(faces, return_inverse=True)
    return Body(surface.vertices_world[used], renumbered.reshape(-1, 3))


def vote(scene: Scene, masks: Mapping[int, PackedMask], points_world: Points) -> tuple[np.ndarray, np.ndarray]:
    """For each point, in how many of the voting frames the mask covers it, and in how many it is in view.

    A point the sensor sees through is in the air, whatever is masked behind it: the side of a box beside its front.
    """
    params = tuned(Params)
    inside, seen = np.zeros(len(points_world), np.int32), np.zeros(len(points_world), np.int32)
    for index in voting_frames(masks, params.frames):
        frame = scene.frame(index)
        uv, shown, through = in_view(scene, frame, points_world)
        covered, _ = sample_nearest(unpack_mask(masks[index]), uv)
        seen += shown
        inside += shown & covered & ~through
    return inside, seen


def voting_frames(masks: Mapping[int, PackedMask], most: int) -> list[int]:
    """Up to `most` frames, spread over those with a mask."""
    known = sorted(masks)
    return [known[round(k)] for k in np.linspace(0, len(known) - 1, min(most, len(known)))]


def in_view(scene: Scene, frame: Frame, points_world: Points) -> tuple[np.ndarray, Mask, Mask]:
    """Pixels (n, 2) of world points in a colour image, which have nothing in front, and which the sensor sees through."""
    params = tuned(Params)
    local = frame.world_from_camera.inverse.apply(points_world)
    depth = local[:, 2]
    ahead = depth > 0.1
    uv = project(np.where(ahead[:, None], local, 1.0), frame.rgb_camera)
    measured = scene.filled_depth(frame.index)
    scale = np.array([measured.shape[1] / frame.rgb_camera.width, measured.shape[0] / frame.rgb_camera.height])
    known, within = sample_nearest(measured, uv * scale)
    hidden = scene.noise.occluded(known, depth, params.near_m)
    sensed, _ = sample_nearest(scene.depth(frame.index), uv * scale)  # only the sensor: holes in glass show what is behind
    through = scene.noise.seen_through(sensed, depth, params.behind_m)
    return uv, ahead & within & ~hidden, through


def _without_crumbs(vertices: Points, faces: Faces) -> Faces:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not len(faces):
        return faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(vertices), len(vertices)))
    _, part = connected_components(graph, directed=False)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sizes = np.bincount(part[faces[:, 0]], weights=area)
    return faces[sizes[part[faces[:, 0]]] > tuned(Params).small_part * sizes.max()]
