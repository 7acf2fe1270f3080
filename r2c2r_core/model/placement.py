"""Placement of a candidate in the world."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Similarity3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchedPoints:
    """Keypoints matched between photos and rendered views of the candidate, lifted to points; n pairs over all frames."""

    frame_index: np.ndarray  # (n,) int, Frame.index of the photo
    points_mesh: Points
    points_world: Points
    noise_m: np.ndarray  # (n,) expected standard deviation of the world point
    inlier: np.ndarray  # (n,) bool, inlier of the pose


NO_MATCHES = MatchedPoints(
    frame_index=np.zeros(0, np.int64),
    points_mesh=np.zeros((0, 3)),
    points_world=np.zeros((0, 3)),
    noise_m=np.zeros(0),
    inlier=np.zeros(0, bool),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spread:
    """Standard deviations of a pose from all the evidence, each along its least constrained direction."""

    turn_deg: float  # excluding rotations under which the shape is invariant
    turn_axis_world: Vector3
    shift_m: float  # of the mesh's centre
    shift_axis_world: Vector3
    scale: float  # share


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """A candidate's pose and scale, with the evidence for them."""

    object_name: str
    candidate_id: str
    world_from_mesh: Similarity3
    matches: int  # keypoint correspondences over all frames
    inliers: int
    votes: dict[int, int]  # Frame.index -> inliers of that frame's hypothesis over all frames
    rms_m: float  # observed points to the placed mesh, after ICP
    mask_iou: float  # rendered silhouette against the visible masks, mean over the frames used
    condition: float  # of the ICP normal matrix; large = the surface slides in some direction
    unsure: bool
    runner_up: float | None  # score of the best different hypothesis over the winner's, 0..1
    method: str
    warnings: tuple[str, ...]
    spread: Spread | None = None
    runner_up_turn_deg: float | None = None  # rotation between the runner-up and the winner
    matched: MatchedPoints = NO_MATCHES
