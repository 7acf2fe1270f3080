"""Multi-view label fusion: masks vote for the vertices of the fused surface they cover (method.md row 13)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Mask, Points
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.graphs import components
from r2c2r_core.geometry.masks import PackedMask, unpack_mask
from r2c2r_core.geometry.meshes import face_areas
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the vote."""

    frames: int = param(
        48, "count", "Maximum number of frames that vote", source="more change nothing and cost 30 ms each", ge=1
    )
    least_votes: int = param(2, "count", "Minimum number of votes on a vertex")
    near_m: float = param(0.03, "m", "Minimum distance of a point behind the measured depth for it to be hidden")
    behind_m: float = param(
        0.06,
        "m",
        "Minimum distance of a point in front of the measured depth for it to be seen through",
        source="a handle and a pose error together",
    )
    small_part: float = param(
        0.1, "ratio", "Minimum area of a part relative to the largest: parts that an occluder separates stay, fragments go"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Part of the fused surface that is the object, in the world; empty where the scan has no surface for it."""

    vertices: Points
    faces: Faces

    @property
    def exists(self) -> bool:
        """Whether there is enough surface to be evidence."""
        return len(self.faces) >= 8

    @property
    def area_m2(self) -> float:
        """Area of the surface."""
        corners = self.vertices[self.faces]
        return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2)


def agreed_body(scene: Scene, masks: Mapping[int, PackedMask]) -> Body:
    """Faces that more than half of the frames observing them put inside the mask, without small fragments."""
    surface = scene.capture.surface
    inside, seen = vote(scene, masks, surface.vertices_world)
    kept = (seen >= min(tuned(Params).least_votes, len(masks))) & (inside > 0.5 * seen)
    faces = surface.faces[kept[surface.faces].all(axis=1)] if len(surface.faces) else surface.faces
    faces = _without_crumbs(surface.vertices_world, faces)
    used, renumbered = np.unique(faces, return_inverse=True)
    return Body(surface.vertices_world[used], renumbered.reshape(-1, 3))


def vote(scene: Scene, masks: Mapping[int, PackedMask], points_world: Points) -> tuple[np.ndarray, np.ndarray]:
    """Number of voting frames per point whose mask covers it, and number in which it is in view.

    A point that the sensor sees through is empty space, even where the mask covers it, as at the side of a box's front.
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
    """Up to `most` frames, evenly spread over those with a mask."""
    known = sorted(masks)
    return [known[round(k)] for k in np.linspace(0, len(known) - 1, min(most, len(known)))]


def in_view(scene: Scene, frame: Frame, points_world: Points) -> tuple[np.ndarray, Mask, Mask]:
    """Pixels (n, 2) of world points in a colour image, mask of the unoccluded ones, and mask of those seen through."""
    params = tuned(Params)
    local = frame.world_from_camera.inverse.apply(points_world)
    depth = local[:, 2]
    ahead = depth > 0.1
    uv = project(np.where(ahead[:, None], local, 1.0), frame.rgb_camera)
    measured = scene.filled_depth(frame.index)
    scale = np.array([measured.shape[1] / frame.rgb_camera.width, measured.shape[0] / frame.rgb_camera.height])
    known, within = sample_nearest(measured, uv * scale)
    hidden = scene.noise.occluded(known, depth, params.near_m)
    sensed, _ = sample_nearest(scene.depth(frame.index), uv * scale)  # sensor depth only: holes in glass show the background
    through = scene.noise.seen_through(sensed, depth, params.behind_m)
    return uv, ahead & within & ~hidden, through


def _without_crumbs(vertices: Points, faces: Faces) -> Faces:
    if not len(faces):
        return faces
    part = components(len(vertices), np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))
    sizes = np.bincount(part[faces[:, 0]], weights=face_areas(vertices, faces))
    return faces[sizes[part[faces[:, 0]]] > tuned(Params).small_part * sizes.max()]
