"""Levelling of a room: up direction, floor height, Manhattan yaw and walls."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import OverrideError
from r2c2r_core.geometry.transforms import Rigid3, rotation_between
from r2c2r_core.ingest.planes import Plane, SurfaceSample, find_planes
from r2c2r_core.ingest.up import choose_up
from r2c2r_core.model.capture import Room, Wall
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.tuning import param, tuned

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of levelling."""

    aligned_deg: float = param(
        4.0, "deg", "Maximum angle of a plane from level, upright or the room's axes to count as aligned"
    )
    floor_below_camera_m: float = param(
        0.75,
        "m",
        "Minimum height of the median camera above the floor",
        source="people do not film from lower; keeps a table top from being taken for the floor",
    )
    lining_m: tuple[float, float] = param(
        (0.03, 0.18),
        "m",
        "Range of distances in front of a wall at which a parallel plane is its lining: panels, pipe casings, chimney breasts",
        source="more than the walls' unevenness, and less than the depth of any cupboard",
    )
    least_lining_m2: float = param(0.3, "m²", "Minimum visible area of a lining")


class Levelled(NamedTuple):
    """The levelled room, and the transform from the recording's own world to it."""

    world_from_capture: Rigid3
    room: Room
    notices: tuple[str, ...]


def level_room(
    sample: SurfaceSample,
    cameras: Sequence[Rigid3],
    file_up: Vector3 | None,
    overrides: Overrides | None,
    rng: np.random.Generator,
    *,
    other_ups: Sequence[Vector3] = (),
) -> Levelled:
    """Level a recording; `sample`, `cameras` (capture_from_camera) and `file_up` are in its own world.

    `other_ups`: alternative interpretations of the file's gravity.
    """
    said = overrides or Overrides(objects={})
    planes = find_planes(sample, rng)
    readings = () if file_up is None else (file_up, *other_ups)
    up = choose_up(planes, cameras, readings, said.up_capture)
    notices = [*up.notices]
    turn = Rigid3(rotation_between(up.direction, _UP), np.zeros(3))
    turned = [_turned(p, turn) for p in planes]
    centres = np.array([c.translation for c in cameras]) @ turn.rotation.T
    points = turn.apply(sample.points)
    floor_z = said.floor_m if said.floor_m is not None else find_floor(turned, points, centres)
    if floor_z is None:
        notices.append("no floor was found; heights start at the recording's own origin")
    shift = np.array([0.0, 0.0, -(floor_z or 0.0)])
    levelled = [_turned(p, Rigid3(np.eye(3), shift)) for p in turned]
    yaw = find_yaw(turn.turn(sample.normals), levelled) if said.manhattan_yaw_rad is None else said.manhattan_yaw_rad
    walls = find_walls(levelled, points + shift, centres + shift) if said.walls is None else _given_walls(said.walls)
    by_person = said.manhattan_yaw_rad is not None
    room = Room(
        up_source=up.source,
        up_spread_deg=_up_spread_deg(levelled),
        up_file_off_deg=up.file_off_deg,
        up_corrected=up.corrected,
        up_rival_capture=up.rival,
        floor_found=floor_z is not None,
        floor_source=None if floor_z is None else "surface" if said.floor_m is None else "person",
        floor_spread_m=None if floor_z is None else _floor_spread_m(levelled),
        manhattan_yaw_rad=float(np.mod(0.0 if yaw is None else yaw, np.pi / 2)),
        yaw_source="person" if by_person else "assumed" if yaw is None else "surface",
        yaw_spread_deg=None if yaw is None else _yaw_spread_deg(levelled, yaw),
        walls=walls,
        walls_source="surface" if said.walls is None else "person",
    )
    return Levelled(Rigid3(turn.rotation, shift), room, tuple(notices))


def find_floor(planes: Sequence[Plane], points: Points, centres: Points) -> float | None:
    """Height of the floor: the lowest level plane under the cameras with almost no points below it."""
    params = tuned(Params)
    camera_z = float(np.median(centres[:, 2]))
    level = [(float(np.median(p.points[:, 2])), p.area_m2) for p in planes if p.normal[2] > np.cos(np.radians(8.0))]
    for z, _ in sorted(level):
        # A floor bent by biased far depth splits into several planes: the largest of them represents all
        height = max((other for other in level if abs(other[0] - z) < 0.06), key=lambda other: other[1])[0]
        beneath = float((points[:, 2] < height - 0.08).mean())
        if camera_z - height > params.floor_below_camera_m and beneath < 0.03:
            return height
    return None


def find_yaw(normals: Points, planes: Sequence[Plane]) -> float | None:
    """Yaw in [0, pi/2) of one of the two dominant horizontal directions; None without upright surface.

    Normals of upright surface vote in a histogram of 1 deg bins, which is robust; the large planes near its peak then refine
    the yaw, as a plane's direction is far more accurate than a patch's.
    """
    upright = normals[np.abs(normals[:, 2]) < 0.2]
    fitted = [p for p in planes if abs(p.normal[2]) < 0.15]
    votes = np.mod(np.arctan2(upright[:, 1], upright[:, 0]), np.pi / 2)
    if not len(votes):
        return None
    histogram = np.histogram(votes, bins=90, range=(0.0, np.pi / 2))[0]
    smooth = sum(np.roll(histogram, shift) * share for shift, share in ((-2, 1), (-1, 2), (0, 3), (1, 2), (2, 1)))
    yaw = (int(np.argmax(smooth)) + 0.5) * np.pi / 180.0
    for reach_deg in (10.0, 6.0, 4.0):
        off = _off_axis(votes, yaw)
        yaw += float(off[np.abs(off) < np.radians(reach_deg)].mean())
    directions = np.array([np.arctan2(p.normal[1], p.normal[0]) for p in fitted])
    leverage = np.array([p.area_m2 * np.ptp(p.points @ np.cross(_UP, p.normal)) for p in fitted])
    off = _off_axis(directions, yaw)
    near = np.abs(off) < np.radians(4.0)
    if near.any():
        order = np.argsort(off[near])
        half = np.cumsum(leverage[near][order]) >= leverage[near].sum() / 2
        yaw += float(
            off[near][order][int(np.argmax(half))]
        )  # a median, as two fronts merged into one plane give a wrong direction
    return float(np.mod(yaw, np.pi / 2))


def _off_axis(directions: np.ndarray, yaw: float) -> np.ndarray:
    """Angle from the nearest of the four directions yaw + k * 90 deg, in [-45, 45) deg as radians."""
    return np.asarray(np.mod(directions - yaw + np.pi / 4, np.pi / 2) - np.pi / 4)


def find_walls(planes: Sequence[Plane], points: Points, centres: Points) -> tuple[Wall, ...]:
    """Large upright planes with almost no points behind them, and their linings.

    Furniture fronts are excluded, as they have a wall or a worktop behind them.
    """
    walls: list[Wall] = []
    upright = [_Upright.of(plane, centres) for plane in planes if abs(plane.normal[2]) <= np.sin(np.radians(8.0))]
    for sheet in upright:
        left, right = sheet.span_m
        low, high = np.quantile(sheet.plane.points[:, 2], (0.02, 0.98))
        if sheet.plane.area_m2 < 0.8 or right - left < 1.0 or high - low < 0.8:
            continue
        along = points @ np.cross(_UP, sheet.normal)
        beside = (along > left) & (along < right)
        behind = int((beside & (points @ sheet.normal < sheet.offset_m - 0.12)).sum())
        if behind > 0.1 * len(sheet.plane.points):
            continue
        if all(sheet.normal @ w.normal < 0.97 or abs(sheet.offset_m - w.offset_m) > 0.1 for w in walls):
            walls.append(sheet.wall())
    linings = [replace(sheet.wall(), span_m=sheet.span_m) for sheet in upright if any(_lines(sheet, wall) for wall in walls)]
    return (*walls, *linings)


class _Upright(NamedTuple):
    """An upright plane that faces the cameras."""

    plane: Plane
    normal: Vector3
    offset_m: float
    span_m: tuple[float, float]  # along up x normal

    @classmethod
    def of(cls, plane: Plane, centres: Points) -> "_Upright":
        normal = np.array([plane.normal[0], plane.normal[1], 0.0])
        normal /= np.linalg.norm(normal)
        offset = float(np.median(plane.points @ normal))
        if np.median(centres @ normal) < offset:
            normal, offset = -normal, -offset
        left, right = np.quantile(plane.points @ np.cross(_UP, normal), (0.02, 0.98))
        return cls(plane, normal, offset, (float(left), float(right)))

    def wall(self) -> Wall:
        spread_m = float(np.sqrt(np.mean((self.plane.points @ self.normal - self.offset_m) ** 2)))
        return Wall(normal=self.normal, offset_m=self.offset_m, area_m2=self.plane.area_m2, spread_m=spread_m)


def _lines(sheet: _Upright, wall: Wall) -> bool:
    """Whether a plane is parallel to a wall and closer in front of it than any furniture."""
    params = tuned(Params)
    before = sheet.offset_m - wall.offset_m
    parallel = float(sheet.normal @ wall.normal) > np.cos(np.radians(params.aligned_deg))
    return parallel and params.lining_m[0] < before < params.lining_m[1] and sheet.plane.area_m2 > params.least_lining_m2


def _given_walls(walls: Sequence[Vector3]) -> tuple[Wall, ...]:
    """Walls given manually as (x, y, offset): an upright plane's normal in plan, and its distance from the origin."""
    lengths = [float(np.linalg.norm(wall[:2])) for wall in walls]
    if not np.isfinite(np.array(walls)).all() or any(length < 1e-6 for length in lengths):
        raise OverrideError("overrides: a wall has no direction", hint="give [x, y, offset], such as [0, -1, -2.4]")
    return tuple(
        Wall(normal=np.array([w[0], w[1], 0.0]) / length, offset_m=float(w[2]) / length, area_m2=0.0)
        for w, length in zip(walls, lengths, strict=True)
    )


def _up_spread_deg(planes: Sequence[Plane]) -> float | None:
    """Area-weighted RMS angle of nearly level and nearly upright planes from level or upright."""
    off_level = np.degrees([np.arccos(min(abs(float(p.normal[2])), 1.0)) for p in planes])
    off = np.minimum(off_level, np.abs(90.0 - off_level))
    return _rms(off, np.array([p.area_m2 for p in planes]), off < tuned(Params).aligned_deg)


def _yaw_spread_deg(planes: Sequence[Plane], yaw: float) -> float | None:
    """Area-weighted RMS angle from the yaw of upright planes nearly aligned with it."""
    upright = [p for p in planes if abs(p.normal[2]) < 0.15]
    off = np.degrees(_off_axis(np.array([np.arctan2(p.normal[1], p.normal[0]) for p in upright]), yaw))
    return _rms(off, np.array([p.area_m2 for p in upright]), np.abs(off) < tuned(Params).aligned_deg)


def _floor_spread_m(planes: Sequence[Plane]) -> float | None:
    """Area-weighted RMS height of level planes within 6 cm of the floor."""
    heights = [p.points[:, 2] for p in planes if p.normal[2] > np.cos(np.radians(8.0))]
    near = [z for z in heights if abs(float(np.median(z))) < 0.06]
    return float(np.sqrt(np.mean(np.concatenate(near) ** 2))) if near else None


def _rms(values: np.ndarray, weights: np.ndarray, chosen: np.ndarray) -> float | None:
    total = float(weights[chosen].sum()) if len(weights) else 0.0
    return float(np.sqrt((weights[chosen] * values[chosen] ** 2).sum() / total)) if total > 0 else None


def _turned(plane: Plane, destination_from_source: Rigid3) -> Plane:
    normal = destination_from_source.rotation @ plane.normal
    return Plane(
        normal=normal,
        offset_m=plane.offset_m + float(normal @ destination_from_source.translation),
        area_m2=plane.area_m2,
        points=destination_from_source.apply(plane.points),
    )
