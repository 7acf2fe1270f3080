"""Camera path of a person with a phone around several runs: along each, out at eye level and back lower."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.synthetic.kitchen import Kitchen, Run

_STEPS = 7
_HEIGHTS_M = (1.52, 1.30)
_LEVELS_M, _LOW_LEVELS_M = (0.50, 1.55), (0.45, 0.85)  # alternating target heights; the latter without wall units
_LEAD_M = 0.45  # distance of the target ahead or back


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A walk along one run, in its frame."""

    run: Run
    start: float  # x of the eye
    end: float
    away_m: float  # from the fronts
    height_m: float


def round_poses(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Eye positions and target points in the kitchen's frame, in order."""
    second = kitchen.runs[1]
    if not second.has_wall:
        return _round_island(kitchen, rng)
    if second.yaw_rad == np.pi:
        return _along_galley(kitchen, rng)
    return _along_corner(kitchen, rng)


def _along_corner(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """From the main run's free end into the corner, out along the wing, and back."""
    main, wing = kitchen.runs
    depth = kitchen.base_depth_m
    near, far = _x_range(kitchen)
    wing_length = wing.ends[1] - wing.ends[0]
    corner_is_right = wing.yaw_rad < 0
    clear = depth + 1.25  # of the wing's wall
    main_span = (near + 0.2, far - clear) if corner_is_right else (far - 0.2, near + clear)
    wing_span = (wing.ends[0] + 1.0, wing.ends[1] + 0.2) if corner_is_right else (wing.ends[1] - 1.0, wing.ends[0] - 0.2)
    if wing_length < 1.2:
        wing_span = (sum(wing.ends) / 2, sum(wing.ends) / 2)
    middle = sum(main.ends) / 2
    eyes = [np.array([middle, -depth - 2.2, 1.55])]
    targets = [np.array([middle, -0.4, 1.1])]
    for height, forth in zip(_HEIGHTS_M, (True, False), strict=True):
        legs = [
            Leg(run=main, start=main_span[0], end=main_span[1], away_m=1.35, height_m=height),
            Leg(run=wing, start=wing_span[0], end=wing_span[1], away_m=1.25, height_m=height),
        ]
        for leg in legs if forth else [_reversed(each) for each in reversed(legs)]:
            _walk_leg(kitchen, leg, eyes, targets, rng)
    return np.array(eyes), np.array(targets)


def _along_galley(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One side, a view out of the aisle, the other side, and again lower."""
    main, wing = kitchen.runs
    aisle = -wing.place[1] - 2 * kitchen.base_depth_m
    near, far = _x_range(kitchen)
    eyes: list[np.ndarray] = []
    targets: list[np.ndarray] = []
    for height in _HEIGHTS_M:
        there = Leg(run=main, start=near + 0.2, end=far - 0.2, away_m=0.75 * aisle, height_m=height)
        back = Leg(run=wing, start=wing.ends[0] + 0.1, end=wing.ends[1] - 0.1, away_m=0.75 * aisle, height_m=height)
        for leg, beyond in ((there, 1.2), (back, -1.2)):
            _walk_leg(kitchen, leg, eyes, targets, rng)
            eyes.append(eyes[-1] * [1.0, 0.0, 1.0] + [0.0, -kitchen.base_depth_m - aisle / 2, 0.0])
            targets.append(eyes[-1] + [beyond, 0.0, -0.4])
    return np.array(eyes[:-1]), np.array(targets[:-1])


def _round_island(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Along the island's outer side, around its end, along the main run, and back along its inner side."""
    main, outer, inner = kitchen.runs
    depth = kitchen.base_depth_m
    aisle = -outer.place[1] - 2 * depth
    left, right = (outer.place[0] + x for x in outer.ends)
    middle = (left + right) / 2
    eyes = [np.array([middle, outer.place[1] - depth - 1.4, 1.6])]
    targets = [np.array([middle, -0.4, 1.0])]
    for height, (start, end) in zip(_HEIGHTS_M, ((left, right), (right, left)), strict=True):
        shift = outer.place[0]
        _walk_leg(
            kitchen,
            Leg(run=outer, start=start - shift, end=end - shift, away_m=1.25, height_m=height),
            eyes,
            targets,
            rng,
        )
    eyes += [np.array([left - 0.6, outer.place[1] - depth - 0.8, 1.5]), np.array([left - 0.7, outer.place[1], 1.5])]
    targets += [np.array([left + 0.3, outer.place[1] - 0.3, 0.6]), np.array([left + 0.4, -0.4, 0.9])]
    near, far = _x_range(kitchen)
    _walk_leg(kitchen, Leg(run=main, start=near + 0.3, end=far - 0.3, away_m=0.75 * aisle, height_m=1.5), eyes, targets, rng)
    eyes.append(np.array([far - 0.3, -depth - aisle / 2, 1.45]))
    targets.append(eyes[-1] + [1.2, -0.3, -0.5])
    span = (inner.ends[0] - 0.1, inner.ends[1] + 0.1)
    _walk_leg(kitchen, Leg(run=inner, start=span[0], end=span[1], away_m=0.75 * aisle, height_m=1.35), eyes, targets, rng)
    return np.array(eyes), np.array(targets)


def _walk_leg(kitchen: Kitchen, leg: Leg, eyes: list[np.ndarray], targets: list[np.ndarray], rng: np.random.Generator) -> None:
    """Append the leg's poses: ahead and back, up and down in turn."""
    low = min(carcass.x for carcass in leg.run.base_carcasses)
    high = max(carcass.x + carcass.width_m for carcass in leg.run.base_carcasses)
    direction = np.sign(leg.end - leg.start) or 1.0
    levels = _LEVELS_M if leg.run.upper_carcasses or leg.run.fixed else _LOW_LEVELS_M
    first = round(2 * leg.height_m)  # the lower pass looks up where the higher one looked down
    eye_run, target_run = [], []
    for step, x in enumerate(np.linspace(leg.start, leg.end, _STEPS)):
        away = leg.away_m + float(rng.uniform(-0.06, 0.06))
        eye_run.append([x, -kitchen.base_depth_m - away, leg.height_m + float(rng.uniform(-0.06, 0.06))])
        aim = x + direction * (_LEAD_M if step % 4 in (1, 2) else -_LEAD_M) * float(rng.uniform(0.5, 1.0))
        aim = float(np.clip(aim, low + 0.15, high - 0.15))
        target_run.append([aim, -0.5, levels[(step + first) % 2] + float(rng.uniform(-0.06, 0.06))])
    eyes += list(leg.run.kitchen_from_run.apply(np.array(eye_run)))
    targets += list(leg.run.kitchen_from_run.apply(np.array(target_run)))


def _reversed(leg: Leg) -> Leg:
    return Leg(run=leg.run, start=leg.end, end=leg.start, away_m=leg.away_m, height_m=leg.height_m)


def _x_range(kitchen: Kitchen) -> tuple[float, float]:
    """From the left end of the main run, or of the refrigerator beside it, to the right end."""
    (left, right), fridge = kitchen.runs[0].ends, kitchen.fridge
    return min(left, fridge.centre[0] - fridge.size_m[0] / 2), max(right, fridge.centre[0] + fridge.size_m[0] / 2)
