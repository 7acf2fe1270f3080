"""Visibility tests of known points against depth images, with the depth noise model."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import DepthMetres, Points
from r2c2r_core.geometry.camera import Intrinsics, project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned

Lengths = np.ndarray | np.floating | float  # metres, one or an array of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of visibility tests."""

    sure: float = param(
        3.0,
        "σ",
        "Number of standard deviations of depth noise within which two depths agree",
        source="of normal noise 0.1 % lies further out on one side",
    )
    nearest_m: float = param(
        0.1,
        "m",
        "Minimum distance from a camera at which a point is looked up",
        source="no phone's depth camera measures closer (ARKit LiDAR and Kinect: 0.2 to 0.4 m)",
    )


class Sighting(NamedTuple):
    """Projection of points into one camera with the measured depth."""

    z_m: np.ndarray  # (n,) depth of the points along the optical axis
    seen_m: np.ndarray  # (n,) depth measured in their pixels; 0 where unknown, outside the image or too near to be seen
    inside: np.ndarray  # (n,) bool: in front of the camera and inside the image


def look_up(points_world: Points, world_from_camera: Rigid3, camera: Intrinsics, depth_m: DepthMetres) -> Sighting:
    """Depth of world points (n, 3) in a camera, and the measured depth at their pixels; `camera` has the image's size."""
    local = world_from_camera.inverse.apply(points_world)
    measured, inside = sample_nearest(depth_m, project(local, camera))
    inside &= local[:, 2] > tuned(Params).nearest_m
    return Sighting(local[:, 2], np.where(inside, measured, 0.0), inside)


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthNoise:
    """Standard deviation of a recording's depth at distance z: floor_m + per_m * z, metres (estimated at ingest).

    The defaults are a phone's LiDAR: 4 mm plus 3 mm per metre.
    """

    floor_m: float = 0.004
    per_m: float = 0.003

    def sigma(self, z_m: Lengths) -> np.ndarray:
        """One standard deviation at z-depths (...), metres."""
        return np.asarray(self.floor_m + self.per_m * z_m)

    def reach(self, z_m: Lengths, margin_m: float) -> np.ndarray:
        """Difference (...) up to which two depths agree, by a margin and the noise."""
        return np.asarray(margin_m + tuned(Params).sure * self.sigma(z_m))

    def agrees(self, seen_m: Lengths, z_m: Lengths, margin_m: float) -> np.ndarray:
        """Mask where depth was measured and equals z within a margin and the noise. Arrays (...), 0 for unknown depth."""
        return np.asarray((seen_m > 0) & (np.abs(seen_m - z_m) < self.reach(z_m, margin_m)))

    def occluded(self, seen_m: Lengths, z_m: Lengths, margin_m: float) -> np.ndarray:
        """Mask where the measured depth is nearer than z by more than a margin and the noise."""
        return np.asarray((seen_m > 0) & (seen_m < z_m - self.reach(z_m, margin_m)))

    def seen_through(self, seen_m: Lengths, z_m: Lengths, margin_m: float) -> np.ndarray:
        """Mask where the measured depth is behind z by more than a margin and the noise: nothing opaque is at z."""
        return np.asarray((seen_m > 0) & (seen_m > z_m + self.reach(z_m, margin_m)))  # z < 0: behind the camera
