"""Camera path of a person who films fronts being opened: past everything, then in front of each front in turn."""

import numpy as np

from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.opening import WALK_FROM, WALK_TO, Film, Front, Opening, swept
from r2c2r_core.synthetic.path import Shot, even_pace, film_along, key_poses

_ASIDE_DEG = (10, -10, 22, -22, 34, -34, 46, -46, 58, -58)  # from the normal of a front
_AWAY_M = (1.55, 1.35, 1.75, 1.2, 1.05, 0.9)  # from its closed face, in order of preference
_EYE_M = (1.15, 1.55)  # heights of the phone, lower for wall units
_FROM_LEAF_M, _FROM_UNITS_M, _FROM_WALLS_M = 0.45, 0.3, 0.3
_SWAY_M = 0.13


def walk_and_open(film: Film, frames: int, rng: np.random.Generator) -> list[Shot]:
    """Shots of a film: the walk takes place between the closing of the initially open front and the first opening."""
    eyes, targets = key_poses(film.kitchen, rng)
    knots = WALK_FROM + (WALK_TO - WALK_FROM) * even_pace(eyes, targets)
    before = [o for o in film.openings if o.rises[0] < 0]
    poses = [pose for opening in before for pose in _visit(film, (opening,), (0.0, WALK_FROM - 0.03), rng)]
    poses += list(zip(knots.tolist(), eyes, targets, strict=True))
    for turn in _turns([o for o in film.openings if o.rises[0] >= 0]):
        ends = min(o.rises[0] for o in turn), min(max(o.falls[1] for o in turn), 1.0)
        poses += _visit(film, turn, ends, rng)
    poses = [pose for n, pose in enumerate(poses) if n == 0 or pose[0] > poses[n - 1][0] + 1e-3]
    return film_along(
        np.array([pose[0] for pose in poses]),
        np.array([pose[1] for pose in poses]),
        np.array([pose[2] for pose in poses]),
        frames,
        rng,
    )


def _turns(openings: list[Opening]) -> list[tuple[Opening, ...]]:
    """Openings grouped so that those that overlap in time are filmed together."""
    turns: list[tuple[Opening, ...]] = []
    for opening in sorted(openings, key=lambda each: each.rises[0]):
        if turns and opening.rises[0] < turns[-1][0].rises[1]:
            turns[-1] = (*turns[-1], opening)
        else:
            turns.append((opening,))
    return turns


def _visit(
    film: Film, turn: tuple[Opening, ...], ends: tuple[float, float], rng: np.random.Generator
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Times, eyes and targets of a stay in front of fronts that open together: a slow step to the side, and back."""
    fronts = [film.fronts[opening.joint] for opening in turn]
    ways = np.concatenate([swept(front, opening.widest) for front, opening in zip(fronts, turn, strict=True)])
    closed = np.concatenate([front.corners for front in fronts])
    out = _outwards(fronts[0])
    eye = _stand(film.kitchen, fronts, ways, closed, out, rng)
    aim = 0.6 * closed.mean(axis=0) + 0.4 * (ways.min(axis=0) + ways.max(axis=0)) / 2
    across = np.cross(out, [0.0, 0.0, 1.0]) * float(rng.choice((-1.0, 1.0)))
    times = np.linspace(ends[0], ends[1], 4)
    sway = (0.0, 1.0, -0.4, 0.6)
    return [
        (float(t), eye + _SWAY_M * s * across + [0, 0, 0.05 * s], aim + 0.05 * s * across)
        for t, s in zip(times, sway, strict=True)
    ]


def _outwards(front: Front) -> np.ndarray:
    """Horizontal direction from the closed front into the room."""
    if front.run is None:
        return np.array([0.0, -1.0, 0.0])
    return front.run.kitchen_from_run.turn(np.array([0.0, -1.0, 0.0]))


def _stand(
    kitchen: Kitchen, fronts: list[Front], ways: np.ndarray, closed: np.ndarray, out: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Best eye position clear of walls, units and the swept leaves."""
    face = closed.mean(axis=0) * [1, 1, 0]
    high = closed[:, 2].mean() > 1.2
    height = _EYE_M[0] if high else _EYE_M[1]
    first = float(rng.choice((-1.0, 1.0)))
    places = []
    for rank, away in enumerate(_AWAY_M):
        for turn, aside in enumerate(_ASIDE_DEG):
            angle = np.radians(first * aside)
            across = np.cross(out, [0.0, 0.0, 1.0])
            place = face + away * (out + np.tan(angle) * across)
            places.append((rank + 0.7 * turn, [*place[:2], height + 0.1 * float(rng.uniform(-1, 1))]))
    eyes = np.array([place for _, place in places])
    liked = np.array([cost for cost, _ in places])
    x0, x1, y0, _, _ = kitchen.room
    room = _FROM_WALLS_M
    outside = (eyes[:, 0] < x0 + room) | (eyes[:, 0] > x1 - room) | (eyes[:, 1] < y0 + room)
    leaf = np.linalg.norm(eyes[:, None, :2] - ways[None, :, :2], axis=2).min(axis=1)
    lost = np.maximum(_FROM_LEAF_M - leaf, 0) + np.maximum(_FROM_UNITS_M - _clearance(kitchen, eyes), 0)
    return np.asarray(eyes[np.argmin(liked + 100 * lost + 1000 * outside)])


def _clearance(kitchen: Kitchen, eyes: np.ndarray) -> np.ndarray:
    """Distance of each eye, in plan, from the nearest run or the refrigerator; negative inside one."""
    fridge = np.array(kitchen.fridge.centre[:2]), np.array(kitchen.fridge.size_m[:2]) / 2
    nearest = _from_rectangle(eyes[:, :2], fridge[0] - fridge[1], fridge[0] + fridge[1])
    for run in kitchen.runs:
        local = run.kitchen_from_run.inverse.apply(eyes)
        low, high = min(c.x for c in run.base_carcasses), max(c.x + c.width_m for c in run.base_carcasses)
        plan = np.array([low, -kitchen.base_depth_m]), np.array([high, 0.0])
        nearest = np.minimum(nearest, _from_rectangle(local[:, :2], *plan))
    return nearest


def _from_rectangle(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Distances of points (n, 2) from a rectangle; negative inside it."""
    beyond = np.maximum(low - points, points - high)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(np.where(outside > 0, outside, beyond.max(axis=1)))
