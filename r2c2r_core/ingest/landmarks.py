"""SIFT keypoints with depth, and the rigid motion between two frames estimated from their matches."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import sample_nearest, unproject
from r2c2r_core.geometry.consensus import similarity_consensus
from r2c2r_core.geometry.descriptors import mutual_pairs
from r2c2r_core.geometry.registration import DegenerateFitError, umeyama
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of landmarks."""

    width_px: int = param(
        480,
        "px",
        "Width to which images are scaled for detection",
        source="larger ones take longer without more repeatable points",
        ge=64,
    )
    most: int = param(600, "count", "Maximum number of landmarks of an image", ge=8)
    ratio: float = param(
        0.8, "ratio", "Maximum ratio of the nearest to the second-nearest descriptor distance of a match", source="Lowe 2004"
    )
    least: int = param(12, "count", "Minimum number of inlier matches of a motion", source="by chance a handful agrees", ge=4)


class Landmarks(NamedTuple):
    """SIFT keypoints with depth: positions in the camera frame, and RootSIFT descriptors."""

    points: Points
    descriptors: np.ndarray  # (n, 128), unit length


class Motion(NamedTuple):
    """Relative pose of two cameras, and its number of inlier landmarks."""

    first_from_second: Rigid3
    agreeing: int


def find_landmarks(frame: Frame, images: FrameImages, far_m: float) -> Landmarks:
    """The frame's landmarks within `far_m`."""
    params = tuned(Params)
    grey = cv2.cvtColor(images.rgb(frame.index), cv2.COLOR_RGB2GRAY)
    height = round(grey.shape[0] * params.width_px / grey.shape[1])
    small = cv2.resize(grey, (params.width_px, height), interpolation=cv2.INTER_AREA)
    found, descriptors = cv2.SIFT.create(nfeatures=params.most, contrastThreshold=0.02).detectAndCompute(small, None)
    if not found:
        return Landmarks(np.zeros((0, 3)), np.zeros((0, 128), np.float32))
    camera = frame.depth_camera
    uv = (np.array([p.pt for p in found]) + 0.5) * [camera.width / params.width_px, camera.height / height]
    depth, inside = sample_nearest(images.depth(frame.index).metres, uv)
    known = inside & (depth > 0) & (depth < far_m)
    root = np.sqrt(descriptors[known] / np.maximum(descriptors[known].sum(axis=1, keepdims=True), 1e-9))
    return Landmarks(unproject(uv[known], depth[known].astype(np.float64), camera), root)


def motion_between(first: Landmarks, second: Landmarks, rng: np.random.Generator) -> Motion | None:
    """The rigid motion with most inliers among their landmark matches; None with fewer than a dozen."""
    params = tuned(Params)
    there, here = _common(first, second)
    if len(there) < params.least:
        return None
    noise_m = 0.01 + 0.006 * first.points[there, 2] ** 2  # of one depth pixel of a Kinect, with the key point a pixel off
    fit = similarity_consensus(
        second.points[here],
        first.points[there],
        threshold=noise_m,
        rng=rng,
        scale_range=(0.97, 1.03),
        minimum_inliers=params.least,
    )
    if fit is None:
        return None
    try:
        rigid = umeyama(second.points[here][fit.inliers], first.points[there][fit.inliers], scale=1.0)
    except DegenerateFitError:
        return None
    return Motion(Rigid3(rigid.rotation, rigid.translation), int(fit.inliers.sum()))


def _common(first: Landmarks, second: Landmarks) -> tuple[np.ndarray, np.ndarray]:
    """Indices of mutual nearest-neighbour matches that pass the ratio test."""
    params = tuned(Params)
    if min(len(first.points), len(second.points)) < params.least:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    here, there = mutual_pairs(second.descriptors, first.descriptors, params.ratio)
    return there, here
