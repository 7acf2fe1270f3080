"""Symmetric distance between the finished, closed model and the scan's depth (the metric set's "Shape").

Both directions use the same frames: from the depth points inside an object's mask to its mesh, and from the pixels where
the mesh is visible to the nearest of those points. Unobserved surface and pixels without depth are excluded, so the figures
need no ground truth and are comparable between real and synthetic kitchens. They include the sensor's noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from r2c2r_core.arrays import Faces, Mask, Points
from r2c2r_core.export.looks import HIDDEN_M, Look, Looks, showing, spread
from r2c2r_core.export.plan import Plan
from r2c2r_core.export.preview import Soup, soup_faces
from r2c2r_core.failing import apart
from r2c2r_core.geometry.camera import depth_points, sample_through
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.geometry.meshes import distances_to_mesh
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress

FRAMES = 8
_POINTS = 6000  # per direction and object
_DENSE_POINTS = (
    60_000  # of the scan, as distance targets: 6000 on a refrigerator are 2 cm apart, and half a perfect mesh 1 cm off them
)
_FEWEST_POINTS = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanFit:
    """Distances between one object's mesh and the scan."""

    median_m: float  # from scan to mesh
    p95_m: float
    f_score_1cm: float  # 0..1, harmonic mean of the shares of points and of visible surface within 1 cm of the other
    f_score_2cm: float
    points: int


def scan_fits(reconstruction: Reconstruction, plan: Plan, looks: Looks, *, progress: Progress = SILENT) -> dict[str, ScanFit]:
    """The fit of every object by its name; objects with too few depth points, or whose fit fails, are left out."""
    found = {}
    for track in progress.each(reconstruction.tracks, "comparing with the scan"):
        bodies = plan.numbers(track.name)
        if not bodies:
            continue
        with apart("export", track.name, {}):
            frames = _frames(looks, track)
            sides = [_sides(looks.at(frame), frame, track, bodies) for frame in frames]
            scan, surface = (np.concatenate([np.zeros((0, 3)), *(side[k] for side in sides)]) for k in (0, 1))
            if len(scan) >= _FEWEST_POINTS:
                found[track.name] = _fit(scan, surface, looks.soup, _turned_to(frames, looks.soup, bodies))
    return found


def _fit(scan: Points, surface: Points, soup: Soup, faces: Faces) -> ScanFit:
    to_mesh = distances_to_mesh(_thinned(scan, _POINTS), soup.corners, faces)
    dense = cKDTree(_thinned(scan, _DENSE_POINTS))
    to_scan = dense.query(_thinned(surface, _POINTS))[0] if len(surface) else np.full(1, np.inf)
    return ScanFit(
        median_m=float(np.median(to_mesh)),
        p95_m=float(np.quantile(to_mesh, 0.95)),
        f_score_1cm=f_score(to_mesh, to_scan, 0.01),
        f_score_2cm=f_score(to_mesh, to_scan, 0.02),
        points=len(to_mesh),
    )


def _turned_to(frames: Sequence[Frame], soup: Soup, bodies: list[int]) -> Faces:
    """The bodies' faces turned to a camera: a point behind a door must not match the door's back."""
    corner, normal = soup.corners[::3], soup.normals[::3]
    own = np.isin(np.rint(soup.ids[::3]), bodies)
    towards = [np.einsum("ij,ij->i", normal, frame.world_from_camera.translation - corner) > 0 for frame in frames]
    return soup_faces(soup)[own & np.any(towards, axis=0)]


def f_score(to_mesh_m: np.ndarray, to_scan_m: np.ndarray, within_m: float) -> float:
    """Harmonic mean of recall (scan near mesh) and precision (mesh near scan), 0..1 (Knapitsch et al. 2017)."""
    recall, precision = float(np.mean(to_mesh_m < within_m)), float(np.mean(to_scan_m < within_m))
    return 2 * precision * recall / max(precision + recall, 1e-12)


def _frames(looks: Looks, track: MaskTrack) -> Sequence[Frame]:
    """Frames that show the object large and closed: from the shared ones, rendered only once, if they suffice."""
    some = showing(looks.shared, track)
    return spread(some if len(some) >= FRAMES // 2 else showing(looks.frames, track), FRAMES)


def _sides(seen: Look, frame: Frame, track: MaskTrack, bodies: list[int]) -> tuple[Points, Points]:
    """World points of one frame: the scan's inside the mask, and the mesh's where it is visible and depth is known."""
    inside = _inside(unpack_mask(track.masks[frame.index]), frame) & seen.known
    shows = np.isin(seen.bodies, bodies)
    judged = shows & ~_rim(shows) & seen.known & (seen.drawn_m < seen.measured_m + HIDDEN_M)
    return _in_world(frame, seen.measured_m, inside), _in_world(frame, seen.drawn_m, judged)


def _inside(mask: Mask, frame: Frame) -> Mask:
    """The mask in the depth image without its border, where the sensor mixes two surfaces."""
    values, within = sample_through(mask, frame.rgb_camera, frame.depth_camera)
    inside = values & within
    return inside & ~_rim(inside)


def _rim(mask: Mask) -> Mask:
    """Pixels of a mask with a neighbour outside it."""
    return np.asarray(mask & (cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0))


def _in_world(frame: Frame, depth_m: np.ndarray, chosen: Mask) -> Points:
    return frame.world_from_camera.apply(depth_points(depth_m.astype(np.float64), frame.depth_camera)[chosen])


def _thinned(points: Points, count: int) -> Points:
    if len(points) <= count:
        return points
    return points[np.random.default_rng(0).choice(len(points), count, replace=False)]
