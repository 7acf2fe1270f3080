"""Estimate of the up direction from recorded gravity, level and upright planes, and typical camera handling."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import OverrideError
from r2c2r_core.geometry.least_squares import cauchy
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.planes import Plane
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the up direction."""

    least_correction_deg: float = param(
        1.0,
        "deg",
        "Minimum deviation of the planes for the file's gravity to be corrected",
        source="a phone's gravity is better than fitted planes",
    )
    few_planes_deg: float = param(
        3.0, "deg", "Maximum correction by a level surface and few planes", source="the real kitchen's file is off by 2.1"
    )
    widest_deg: float = param(12.0, "deg", "Initial search angle for planes around the file's gravity")
    agree_deg: float = param(
        1.5, "deg", "Maximum RMS disagreement of the planes that determine up", source="a Kinect's bent walls give 0.8"
    )
    many: int = param(3, "count", "Minimum number of level and upright planes that override the file's gravity")
    many_m2: float = param(
        2.0, "m²", "Minimum total area of the planes that override the file's gravity", source="three fronts and a worktop"
    )
    many_share: float = param(0.6, "share", "Minimum fraction of all planes' area that those planes make up")
    aligned_deg: float = param(2.5, "deg", "Maximum angle from level or upright for a plane to support an up direction")
    level_m2: float = param(0.3, "m²", "Minimum level area for planes to correct the file's gravity")
    clear_share: float = param(
        0.2, "share", "Minimum lead in supporting plane area for another reading of the file to replace the first"
    )
    walks_within_m: float = param(
        0.25,
        "m",
        "Standard deviation of camera height above which an up direction is implausible",
        source="0.02 to 0.10 m on four real recordings, 0.5 to 1.0 m of the same on their side",
    )
    held_within_deg: float = param(
        8.0,
        "deg",
        "Mean camera roll above which an up direction is implausible",
        source="2 to 5 degrees on four real recordings, 11 to 26 of the same on their side",
    )


class Up(NamedTuple):
    """The up direction in the capture's own frame, and its evidence."""

    direction: Vector3
    source: Literal["file", "floor", "person", "assumed"]
    notices: tuple[str, ...] = ()
    file_off_deg: float | None = None  # of the file's gravity from what its planes say; None: they do not settle it
    corrected: bool = False  # whether the planes were taken in its place
    rival: Vector3 | None = None  # up if the images are stored sideways, where nothing rules that out


def choose_up(
    planes: Sequence[Plane],
    cameras: Sequence[Rigid3],
    readings: Sequence[Vector3],
    said_up: Vector3 | None,
) -> Up:
    """Up as given manually, else by the file unless planes contradict it, else by planes, else by the cameras.

    `readings`: possible interpretations of the file's gravity, the likeliest first; empty where it has none.
    """
    params = tuned(Params)
    if said_up is not None:
        length = float(np.linalg.norm(said_up))
        if not np.isfinite(length) or length < 1e-6:
            raise OverrideError("overrides: 'up' has no direction", hint="give three numbers, such as [0, 1, 0]")
        return Up(np.asarray(said_up) / length, "person")
    if readings:
        return _from_file(planes, _supported(planes, readings, params), params)
    return _without_gravity(planes, cameras, params)


def find_up(planes: Sequence[Plane], guess: Vector3, within_deg: float) -> tuple[Vector3, float] | None:
    """The direction near `guess` that makes planes horizontal or vertical, and their RMS angular residual (deg).

    None when the planes do not determine it: no level plane, and no two upright ones that face differently.
    """
    up = guess / np.linalg.norm(guess)
    for reach_deg in (within_deg + 5.0, within_deg + 2.0, 4.0, 4.0, 4.0):
        matrix, weight_sum, miss, area_m2 = np.zeros((3, 3)), 0.0, 0.0, 0.0
        for plane in planes:
            off_deg, sign = _off_deg(plane, up)
            if off_deg > reach_deg:
                continue
            weight = plane.area_m2 * float(cauchy(off_deg, 1.5))
            matrix += sign * weight * np.outer(plane.normal, plane.normal)
            weight_sum += weight
            area_m2 += plane.area_m2
            miss += weight * off_deg**2
        values, vectors = np.linalg.eigh(matrix)
        # The best must clearly beat the second best: one wall alone leaves a circle of directions
        if area_m2 < 0.5 or values[2] - values[1] < 0.15:
            return None
        found = vectors[:, 2]
        up = found if found @ up > 0 else -found
    return up, float(np.sqrt(miss / weight_sum))


def _from_file(planes: Sequence[Plane], file_up: Vector3, params: Params) -> Up:
    """The file's gravity, corrected where planes agree; large corrections need many planes."""
    found = find_up(planes, file_up, params.widest_deg)
    if found is None or found[1] > params.agree_deg:
        far = _up_from_planes(planes, file_up)
        found = None if far is None or not _many(planes, far, params) else find_up(planes, far, params.few_planes_deg)
    if found is None:
        return Up(file_up, "file")
    off_deg = _angle_deg(found[0], file_up)
    level_m2 = sum(p.area_m2 for p in planes for off, sign in (_off_deg(p, found[0]),) if sign > 0 and off < params.aligned_deg)
    believed = off_deg <= params.few_planes_deg and level_m2 >= params.level_m2
    if off_deg <= params.least_correction_deg or not (believed or _many(planes, found[0], params)):
        return Up(file_up, "file", file_off_deg=off_deg)
    notice = f"the recording's gravity was corrected by {off_deg:.1f}° to fit its level and upright planes"
    source: Literal["file", "floor"] = "file" if off_deg <= params.few_planes_deg else "floor"
    return Up(found[0], source, (notice,), off_deg, corrected=True)


def _many(planes: Sequence[Plane], up: Vector3, params: Params) -> bool:
    """Whether enough level and upright planes support a direction to override the file's gravity."""
    aligned = [(p, sign) for p in planes for off, sign in (_off_deg(p, up),) if off < params.aligned_deg]
    area = sum(p.area_m2 for p, _ in aligned)
    level = sum(p.area_m2 for p, sign in aligned if sign > 0)
    enough = len(aligned) >= params.many and area >= params.many_m2 and level >= params.level_m2
    return enough and level < area and area >= params.many_share * sum(p.area_m2 for p in planes)


def _supported(planes: Sequence[Plane], readings: Sequence[Vector3], params: Params) -> Vector3:
    """The first reading, unless the planes clearly support another."""
    shares = [_share(planes, reading, params.few_planes_deg + params.aligned_deg) for reading in readings]
    best = int(np.argmax(shares))
    return readings[best] if shares[best] > shares[0] + params.clear_share else readings[0]


def _share(planes: Sequence[Plane], up: Vector3, within_deg: float) -> float:
    """Fraction of the planes' area that is level or upright; level area counts double, as a wall suits two directions."""
    offs = [_off_deg(p, up) for p in planes]
    areas = np.array([p.area_m2 * (2.0 if sign > 0 else 1.0) for p, (_, sign) in zip(planes, offs, strict=True)])
    near = np.array([off < within_deg for off, _ in offs])
    return float(areas[near].sum() / max(sum(p.area_m2 for p in planes), 1e-9)) if len(offs) else 0.0


def _without_gravity(planes: Sequence[Plane], cameras: Sequence[Rigid3], params: Params) -> Up:
    """Up by planes near the images' top, or near another image side if the camera's height and roll clearly favour it."""
    ends = [way for side in (0, 2) if (way := _way(planes, cameras, side)) is not None]  # as stored, or upside down
    stored = max(ends, key=lambda way: way.seen_from_above_m2, default=None) if _on_its_head(ends) else _way(planes, cameras, 0)
    found = [way for side in (1, 3) if (way := _way(planes, cameras, side)) is not None]  # a quarter turn to either side
    if stored is None and not found:
        up = _mean_side(cameras, 0)
        return Up(up, "assumed", ("neither the recording nor its planes show which way is up; check it",))
    chosen = stored if stored is not None else found[0]
    better = [way for way in found if way.clear_of(chosen, params, both=True)]
    if better:
        best = max(better, key=lambda way: way.seen_from_above_m2)
        notice = "the recording has no gravity, and its images lie on their side: up was estimated from its planes and path"
        return Up(best.up, "floor", (notice,), rival=chosen.up)
    rivals = [way for way in found if way is not chosen and not chosen.clear_of(way, params, both=False)]
    head = ", and its images are upside down" if _on_its_head(ends) else ""
    notice = f"the recording has no gravity{head}; up was estimated from its level and upright planes"
    rival = max(rivals, key=lambda way: way.seen_from_above_m2).up if rivals else None
    return Up(chosen.up, "floor", (notice,), rival=rival)


class _Way(NamedTuple):
    """A candidate up direction, with the camera's roll and height spread under it."""

    up: Vector3
    height_spread_m: float  # one sigma
    roll_deg: float  # mean
    seen_from_above_m2: float  # level surface that faces up, less what faces down: floors are filmed, ceilings rarely

    def clear_of(self, other: "_Way", params: Params, *, both: bool) -> bool:
        """Whether this candidate is clearly more plausible than the other by height spread, by roll, or by both."""
        level = other.height_spread_m > params.walks_within_m and self.height_spread_m < 0.5 * other.height_spread_m
        held = other.roll_deg > params.held_within_deg and self.roll_deg < 0.5 * other.roll_deg
        return (level and held) if both else (level or held)


def _on_its_head(ends: "Sequence[_Way]") -> bool:
    """Whether the images are stored upside down: as stored, nearly all level surfaces face down."""
    return len(ends) == 2 and ends[0].up @ ends[1].up < 0 and ends[0].seen_from_above_m2 < 0 < ends[1].seen_from_above_m2


def _way(planes: Sequence[Plane], cameras: Sequence[Rigid3], side: int) -> _Way | None:
    """Candidate up by planes near a side of the images: 0 top, 1 right, 2 bottom, 3 left."""
    up = _up_from_planes(planes, _mean_side(cameras, side))
    if up is None:
        return None
    across = np.array([np.cross(_side(c, side), c.rotation[:, 2]) for c in cameras])
    roll = np.degrees(np.abs(np.arcsin(np.clip(across @ up, -1.0, 1.0))))
    heights = np.array([c.translation for c in cameras]) @ up
    facing = sum(p.area_m2 * np.sign(p.normal @ up) for p in planes if _off_deg(p, up)[1] > 0)
    return _Way(up, float(np.std(heights)), float(roll.mean()), float(facing))


def _up_from_planes(planes: Sequence[Plane], camera_up: Vector3) -> Vector3 | None:
    """The direction near the cameras' up that makes most area level or upright."""
    candidates = [s * p.normal for p in planes for s in (1.0, -1.0)]
    large = planes[:6]
    candidates += [s * np.cross(a.normal, b.normal) for i, a in enumerate(large) for b in large[:i] for s in (1.0, -1.0)]
    best, best_score = None, 0.0
    for candidate in candidates:
        length = float(np.linalg.norm(candidate))
        if length < 0.5 or candidate @ camera_up < length * np.cos(np.radians(60.0)):
            continue
        found = find_up(planes, candidate / length, 4.0)
        if found is None:
            continue
        up = found[0]
        cosines = np.array([float(p.normal @ up) for p in planes])
        areas = np.array([p.area_m2 for p in planes])
        # Area facing up counts double: floors and worktops are seen from above, ceilings and undersides rarely
        share = areas @ ((np.abs(cosines) < 0.1) + 2.0 * (cosines > 0.995) + 0.5 * (cosines < -0.995))
        score = float(share) * (0.5 + float(up @ camera_up))
        if score > best_score:
            best, best_score = up, score
    return best


def _mean_side(cameras: Sequence[Rigid3], side: int) -> Vector3:
    total = np.array([_side(c, side) for c in cameras]).mean(axis=0)
    return np.asarray(total / max(float(np.linalg.norm(total)), 1e-9))


def _side(camera: Rigid3, side: int) -> Vector3:
    """The direction of an image's top, right, bottom or left in the capture's frame."""
    return np.asarray((-camera.rotation[:, 1], camera.rotation[:, 0], camera.rotation[:, 1], -camera.rotation[:, 0])[side])


def _off_deg(plane: Plane, up: Vector3) -> tuple[float, float]:
    """Angle (deg) of a plane from level (then 1) or upright (then -1), whichever is nearer."""
    off_level = float(np.degrees(np.arccos(min(abs(float(plane.normal @ up)), 1.0))))
    return (off_level, 1.0) if off_level < 45.0 else (90.0 - off_level, -1.0)


def _angle_deg(a: Vector3, b: Vector3) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0))))
