"""Render-and-compare score of a placed mesh against the masks, the depth and the colours of the views."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.align.observe import placing_noise
from r2c2r_core.align.shape import Shape
from r2c2r_core.align.view import Params as ViewParams
from r2c2r_core.align.view import View
from r2c2r_core.arrays import DepthMetres, Mask, Points
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3, Similarity3
from r2c2r_core.kitchen.fronts import front_y
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the render-and-compare score."""

    slab_m: float = param(0.015, "m", "Depth of a front that counts as its face", source="a door is 18-20 mm thick")
    forwards: float = param(
        0.7, "cosine", "Minimum cosine to a front's normal for a mesh face to be front-facing", source="45 degrees"
    )
    weights: tuple[float, float, float] = param((0.45, 0.35, 0.20), "score", "Weights of mask, depth and colour")


class Rendered(NamedTuple):
    """Rendering of the placed mesh in one view."""

    depth_m: DepthMetres  # of the whole mesh
    own: Mask  # expected mask: the face of a front, the whole mesh otherwise
    hidden: Mask  # occluded in the photo


class ViewScore(NamedTuple):
    """Agreement in one view, each 0..1 (colour -0.5..1)."""

    iou: float
    depth: float
    colour: float

    @property
    def total(self) -> float:
        """Weighted sum of the terms."""
        return float(np.dot(tuned(Params).weights, self))


class Judgement(NamedTuple):
    """Agreement over all views."""

    score: float
    iou: float
    views: tuple[ViewScore, ...]


def judge(pose: Similarity3, shape: Shape, views: tuple[View, ...], front: FrontPanel | None) -> Judgement:
    """Score of a mesh pose (world_from_mesh) over all views, weighted by the root of mask area."""
    vertices = pose.apply(shape.vertices)
    behind = behind_face(pose, shape, vertices, front)
    scores = [_judge_view(pose, shape, vertices, behind, view) for view in views]
    weight = np.sqrt(np.array([float(v.mask.sum()) + 1.0 for v in views]))
    weight /= weight.sum()
    return Judgement(
        score=float(weight @ [s.total for s in scores]), iou=float(weight @ [s.iou for s in scores]), views=tuple(scores)
    )


def render_pose(shape: Shape, vertices_world: Points, behind: np.ndarray, view: View) -> Rendered:
    """Rendering of the placed mesh in a view."""
    attributes = np.zeros((len(vertices_world), 3), np.float32)
    attributes[:, 0] = behind
    raster = rasterize(vertices_world, shape.faces, attributes, view.camera, view.world_from_camera.inverse)
    depth = raster.depth_m
    hit = depth > 0
    hidden = hit & ~view.mask & view.noise.occluded(view.depth_m, depth, tuned(ViewParams).occluder_gap_m)
    return Rendered(depth, hit & (raster.attributes[..., 0] < tuned(Params).slab_m), hidden | ~view.inside)


def behind_face(pose: Similarity3, shape: Shape, vertices_world: Points, front: FrontPanel | None) -> np.ndarray:
    """Distance of each vertex behind the mesh's own front face, metres; 0 everywhere if it is not a front.

    Recessed panels belong to the face at any depth: front-facing triangles are not behind it.
    """
    if front is None:
        return np.zeros(len(vertices_world))
    local = front.world_from_front.inverse.apply(vertices_world)
    behind = local[:, 1] - face_depth(pose, shape, front)
    if shape.oriented:
        a, b, c = (local[shape.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        forwards = -normals[:, 1] > tuned(Params).forwards * np.linalg.norm(normals, axis=1)
        panels = shape.faces[forwards]
        behind[panels] = np.minimum(behind[panels], 0.0)
    return np.asarray(behind)


def face_depth(pose: Similarity3, shape: Shape, front: FrontPanel) -> float:
    """Position of the mesh's front plane along the panel's +Y."""
    to_front = front.world_from_front.inverse
    return front_y(to_front.apply(pose.apply(shape.points)), to_front.turn(shape.normals @ pose.rotation.T))


def _judge_view(pose: Similarity3, shape: Shape, vertices: Points, behind: np.ndarray, view: View) -> ViewScore:
    """Agreement in one view."""
    rendered = render_pose(shape, vertices, behind, view)
    both = rendered.own & view.mask
    union = ((rendered.own & ~rendered.hidden) | view.mask) & view.inside
    overlap = float(both.sum())
    iou = overlap / max(float(union.sum()), 1.0)
    covered = overlap / max(float(view.mask.sum()), 1.0)
    return ViewScore(
        iou, covered * _depth_agreement(rendered, both, view), covered * _colour_agreement(pose, shape, rendered, view)
    )


def _depth_agreement(rendered: Rendered, both: Mask, view: View) -> float:
    """1 minus the mean truncated squared depth error, in units of three standard deviations."""
    inner = both & (view.depth_m > 0) & (view.signed_px < -min(1.5, 0.5 + 0.5 * view.depth_px))
    if np.count_nonzero(inner) < 6:
        return 0.0
    slope = cv2.dilate(rendered.depth_m, np.ones((3, 3))) - cv2.erode(rendered.depth_m, np.ones((3, 3)))
    sloped = np.minimum(0.25 * view.depth_px * slope[inner], 0.05)  # nearest depth pixel on a slanted surface
    sigma = np.hypot(placing_noise(view.noise, rendered.depth_m[inner]), sloped)
    error = (view.depth_m[inner] - rendered.depth_m[inner]) / (3.0 * sigma)
    return float(1.0 - np.minimum(error**2, 1.0).mean())


def _colour_agreement(pose: Similarity3, shape: Shape, rendered: Rendered, view: View) -> float:
    """Correlation of the mesh's colours with the photo's over the visible surface; near 0 where either is uniform."""
    camera_from_world: Rigid3 = view.world_from_camera.inverse
    points = camera_from_world.apply(pose.apply(shape.points))
    uv = project(points, view.camera)
    seen_depth, inside = sample_nearest(rendered.depth_m, uv)
    own, _ = sample_nearest(rendered.own & view.mask, uv)
    tolerance = 0.01 * shape.diameter * pose.scale + 0.002
    visible = inside & own & (points[:, 2] > 0) & (np.abs(points[:, 2] - seen_depth) < tolerance)
    if np.count_nonzero(visible) < 40:
        return 0.0
    photo, _ = sample_nearest(view.colour, uv[visible])
    mesh = shape.colours[visible]
    a, b = photo - photo.mean(axis=0), mesh - mesh.mean(axis=0)
    plain = 3 * 6.0**2  # a spread of 6 grey levels a channel is shading, not texture
    correlation = (a * b).sum(axis=1).mean() / np.sqrt(
        ((a**2).sum(axis=1).mean() + plain) * ((b**2).sum(axis=1).mean() + plain)
    )
    return float(np.clip(correlation, -0.5, 1.0))
