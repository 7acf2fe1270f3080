"""Observed fraction of each side of an object; unobserved sides are marked as a guess.

A side is the surface visible orthographically from that side of the object's box, which excludes the inside of a cabinet.
The underside is left out. A surface point is observed in a frame if the model shows it there, not at too grazing an angle,
and no measured surface occludes it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.export.looks import HIDDEN_M, Look, Looks, showing
from r2c2r_core.export.plan import Plan
from r2c2r_core.failing import apart
from r2c2r_core.geometry.camera import Intrinsics, depth_points, project, sample_nearest
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.reconstruction import Reconstruction

Side: TypeAlias = Literal["front", "back", "left", "right", "top"]

_OUTWARD: Mapping[Side, Vector3] = {  # object frame: the front is at -Y
    "front": np.array([0.0, -1.0, 0.0]),
    "back": np.array([0.0, 1.0, 0.0]),
    "left": np.array([-1.0, 0.0, 0.0]),
    "right": np.array([1.0, 0.0, 0.0]),
    "top": np.array([0.0, 0.0, 1.0]),
}
_SPOTS = 64  # sample points along the object's longest side
_AWAY = 8.0  # viewing distance in object sizes: rays are then parallel to 4 degrees
_SLANT = 0.2  # minimum cosine between viewing direction and surface normal
_OWN_M = 0.015  # maximum distance to the model rendered into a frame for a point to be visible
_LEAST = 0.25  # minimum observed fraction of a side to be called seen


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Observed fractions of one object's surface, 0 to 1."""

    share: float  # of all sides together, by their area
    sides: dict[Side, float]  # a side without visible surface is left out

    @property
    def unseen(self) -> tuple[Side, ...]:
        """The sides that were not observed."""
        return tuple(side for side, share in self.sides.items() if share < _LEAST)


def seen_sides(reconstruction: Reconstruction, plan: Plan, looks: Looks) -> dict[str, Seen]:
    """Observed fractions of every prompted object, by name; objects for which this fails are left out."""
    poses = {item.name: item.world_from_object for item in reconstruction.scene.objects}
    found = {}
    for track in reconstruction.tracks:
        bodies = plan.numbers(track.name)
        frames = showing(looks.shared, track) or showing(looks.frames, track)
        if not bodies or not frames:
            continue
        with apart("export", track.name, {}):
            found[track.name] = _seen(looks, frames, bodies, poses[track.name].rotation)
    return found


def unseen_words(unseen: Sequence[str]) -> str:
    """Description of the unobserved sides in words; empty where all were observed."""
    if set(unseen) >= {"back", "left", "right"} and "front" not in unseen:
        return "seen from the front only"
    return f"not seen: {', '.join(unseen)}" if unseen else ""


class _Spots(NamedTuple):
    """Surface points in the world with outward normals."""

    points: Points
    normals: Points


def _seen(looks: Looks, frames: Sequence[Frame], bodies: Sequence[int], world_from_object: np.ndarray) -> Seen:
    spots = {side: _spots(looks, bodies, world_from_object @ outward) for side, outward in _OUTWARD.items()}
    flags = {side: _are_seen(looks, frames, bodies, shown) for side, shown in spots.items() if len(shown.points)}
    every = np.concatenate([np.zeros(0, bool), *flags.values()])
    return Seen(share=float(every.mean()), sides={side: float(seen.mean()) for side, seen in flags.items()})


def _spots(looks: Looks, bodies: Sequence[int], outward: Vector3) -> _Spots:
    """Surface points of the bodies visible from far away in a direction, sampled on a uniform image grid."""
    own = np.isin(np.rint(looks.soup.ids[::3]), bodies)
    corners, normals = (values.reshape(-1, 3, 3)[own].reshape(-1, 3) for values in (looks.soup.corners, looks.soup.normals))
    low, high = corners.min(axis=0), corners.max(axis=0)
    size, middle = float(np.linalg.norm(high - low)), (low + high) / 2
    upward = np.array([0.0, 0.0, 1.0]) if abs(outward[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    across = np.cross(outward, upward) / np.linalg.norm(np.cross(outward, upward))
    eye = Rigid3(np.column_stack([across, np.cross(-outward, across), -outward]), _AWAY * outward)
    side_px = 2 * _SPOTS
    focal = _AWAY * _SPOTS * size / float((high - low).max())
    camera = Intrinsics(fx=focal, fy=focal, cx=side_px / 2, cy=side_px / 2, width=side_px, height=side_px)
    faces = np.arange(len(corners)).reshape(-1, 3)
    picture = rasterize((corners - middle) / size, faces, normals, camera, eye.inverse)
    shows = picture.depth_m > 0
    spots = eye.apply(depth_points(picture.depth_m.astype(np.float64), camera)[shows]) * size + middle
    return _Spots(spots, picture.attributes[shows])


def _are_seen(looks: Looks, frames: Sequence[Frame], bodies: Sequence[int], spots: _Spots) -> np.ndarray:
    """Mask (n,) of the points that at least one frame observes."""
    seen = np.zeros(len(spots.points), dtype=bool)
    for frame in frames:
        left = np.flatnonzero(~seen)
        if len(left) == 0:
            break
        seen[left] = _sees(looks.at(frame), frame, bodies, spots.points[left], spots.normals[left])
    return seen


def _sees(look: Look, frame: Frame, bodies: Sequence[int], points: Points, normals: Points) -> np.ndarray:
    local = frame.world_from_camera.inverse.apply(points)
    towards = frame.world_from_camera.translation - points
    faces_eye = np.einsum("ij,ij->i", towards, normals) > _SLANT * np.linalg.norm(towards, axis=1)
    uv = project(local, frame.depth_camera)
    drawn, inside = sample_nearest(look.drawn_m, uv)
    body, _ = sample_nearest(look.bodies, uv)
    measured, _ = sample_nearest(look.measured_m, uv)
    known, _ = sample_nearest(look.known, uv)
    shown = inside & (local[:, 2] > 0) & np.isin(body, bodies) & (np.abs(drawn - local[:, 2]) < _OWN_M)
    return np.asarray(shown & faces_eye & (~known | (measured > local[:, 2] - HIDDEN_M)))
