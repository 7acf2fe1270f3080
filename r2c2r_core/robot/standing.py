"""Search of base positions on the floor from which an arm opens each joint: reachable and collision-free."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import shapely

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.robot.arm import Arm, Stand
from r2c2r_core.robot.grasps import STATIONS_OF_A_LEG, Way, overlaps, stations
from r2c2r_core.robot.kinematics import ease, matrices, solve
from r2c2r_core.robot.motion import Hold, Travel
from r2c2r_core.robot.panda import LIFTS_M, PEDESTAL_RADIUS_M, REACH_M, SHOULDER_M
from r2c2r_core.robot.rig import corners_of, find_contacts

GRID_M = 0.1
_NEAR_M = 0.25  # minimum horizontal distance of the base from a tool pose
_OFF_M, _OFF_RAD = 0.002, 0.01
_FIRST, _NEXT = 35, 15  # iterations
_LEAST_EASE = 0.01  # own choice: below it the springs pulled the test kitchen's doors with 200 N
_JUMP_RAD = 1.2  # maximum joint step between two successive poses
_ELBOWS = ((0.0, 0.0), (0.8, 0.0), (-0.8, 0.0), (0.0, 0.6))  # offsets of the third and the second joint from rest
_ABOVE_FLOOR_M = 0.02
_FLIP = Rigid3(np.diag([1.0, -1.0, -1.0]))  # the tool turned over, as its fingers are interchangeable


class Reach(NamedTuple):
    """Reachability of a joint from a base position."""

    start: np.ndarray  # (7,) angles in front of the handle
    flipped: bool
    ease: float  # minimum along the motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Floor:
    """Grid of base positions, and furniture outlines."""

    stands: tuple[Stand, ...]
    furniture: Any  # shapely polygons, the world's x and y


def free_floor(model: Any, data: Any, own: frozenset[int], handles: list[Vector3]) -> Floor:
    """Grid positions within reach of a handle where the pedestal is collision-free; the arm faces the nearby handles."""
    furniture = shapely.union_all(list(_footprints(model, data, own)))
    if not handles:
        return Floor(stands=(), furniture=furniture)
    at = np.array([handle[:2] for handle in handles])
    first, last = np.floor((at.min(axis=0) - REACH_M) / GRID_M), np.ceil((at.max(axis=0) + REACH_M) / GRID_M)
    xs, ys = (GRID_M * np.arange(first[k], last[k] + 1) for k in (0, 1))
    shapely.prepare(furniture)
    found = []
    for x, y in ((x, y) for y in ys for x in xs):
        away = at - (x, y)
        near = np.linalg.norm(away, axis=1) < REACH_M
        if near.any() and not furniture.distance(shapely.Point(x, y)) <= PEDESTAL_RADIUS_M:  # NaN without furniture
            dx, dy = away[near].mean(axis=0)
            found.append(Stand(round(float(x), 3), round(float(y), 3), float(np.arctan2(dy, dx)), LIFTS_M[0]))
    return Floor(stands=tuple(found), furniture=furniture)


def reaches(arm: Arm, travel: Travel, way: Way, stands: tuple[Stand, ...]) -> dict[Stand, Reach]:
    """Base positions from which the arm can open and close the joint, with every other joint closed."""
    import mujoco

    steps = list(stations(travel, way))
    poses, tried = [pose for pose, _, _ in steps], _nearby(stands, [pose.translation for pose, _, _ in steps])
    found: dict[Stand, Reach] = {}
    scratch = mujoco.MjData(arm.model)
    probe = replace(arm, data=scratch)
    for stand, flipped, angles in _reached(arm, poses, tried):
        if stand not in found and not _meets(probe, travel, stand, angles, steps):
            easy = ease(arm.chain, angles)
            if easy > _LEAST_EASE:
                found[stand] = Reach(angles[0], flipped, easy)
    return found


def flipped(way: Way) -> Way:
    """The same plan with the tool turned over."""

    def turned(hold: Hold | None) -> Hold | None:
        return None if hold is None else replace(hold, body_from_tool=hold.body_from_tool @ _FLIP)

    opens = turned(way.opens)
    assert opens is not None
    return replace(way, opens=opens, closes=turned(way.closes), presses=turned(way.presses))


def fewest_places(reached: dict[str, dict[Stand, Reach]]) -> dict[Stand, list[str]]:
    """Greedy set cover: base positions that together serve all reachable joints.

    Ties are resolved by the largest distance of the joints from their limits.
    """
    left = {joint for joint, stands in reached.items() if stands}
    places: dict[Stand, list[str]] = {}
    while left:
        served = {stand: [j for j in reached if j in left and stand in reached[j]] for j in left for stand in reached[j]}
        best = max(served, key=lambda stand: (len(served[stand]), min(reached[j][stand].ease for j in served[stand]), stand))
        places[best] = served[best]
        left -= set(served[best])
    return places


def _nearby(stands: tuple[Stand, ...], tools: list[Vector3]) -> list[Stand]:
    """Base positions and lifts from which all poses are within arm length of the shoulder, and not too near."""
    at, found = np.array(tools), []
    for stand in stands:
        across = np.linalg.norm(at[:, :2] - stand[:2], axis=1)
        for lift_m in LIFTS_M:
            if across.min() > _NEAR_M and np.hypot(across, at[:, 2] - lift_m - SHOULDER_M).max() < REACH_M:
                found.append(stand._replace(lift_m=lift_m))
    return found


def _reached(arm: Arm, poses: list[Rigid3], stands: list[Stand]) -> Iterator[tuple[Stand, bool, np.ndarray]]:
    """Base positions from which the tool reaches every pose in turn without a joint jump, with angles (poses, 7)."""
    world_from_tool = matrices(poses)
    trials = [(stand, flip, elbow) for stand in stands for elbow in _ELBOWS for flip in (False, True)]
    if not trials:
        return
    base_from_world = np.stack([stand.world_from_base.inverse.matrix for stand, _, _ in trials])
    over = np.stack([_FLIP.matrix if flip else np.eye(4) for _, flip, _ in trials])
    angles = np.stack(
        [_bent(arm, base @ world_from_tool[0], elbow) for base, (_, _, elbow) in zip(base_from_world, trials, strict=True)]
    )
    alive, history = np.arange(len(trials)), list[np.ndarray]()
    for number, pose in enumerate(world_from_tool):
        wanted = base_from_world[alive] @ pose @ over[alive]
        begins = number % STATIONS_OF_A_LEG == 0
        solved = solve(arm.chain, wanted, angles, _FIRST if begins else _NEXT)
        good = (solved.off_m < _OFF_M) & (solved.off_rad < _OFF_RAD)
        if not begins:
            good &= np.abs(solved.angles - angles).max(axis=1) < _JUMP_RAD
        alive, angles = alive[good], solved.angles[good]
        history = [*(past[good] for past in history), angles]
    for row, trial in enumerate(alive):
        stand, flip, _ = trials[trial]
        yield stand, flip, np.stack([past[row] for past in history])


def _bent(arm: Arm, base_from_tool: np.ndarray, elbow: tuple[float, float]) -> np.ndarray:
    """Start angles of the IK: at rest, turned towards the tool's target."""
    angles = arm.chain.rest.copy()
    angles[0] = np.arctan2(base_from_tool[1, 3], base_from_tool[0, 3])
    angles[1] += elbow[1]
    angles[2] += elbow[0]
    return angles


def _meets(probe: Arm, travel: Travel, stand: Stand, angles: np.ndarray, steps: list[tuple[Rigid3, float, float]]) -> bool:
    """Whether the arm overlaps anything at any of the poses, except its pads on the part."""
    import mujoco

    for bent, (_, width, position) in zip(angles, steps, strict=True):
        mujoco.mj_resetData(probe.model, probe.data)
        probe.stand(stand, bent)
        probe.bend(bent, width)
        probe.data.qpos[travel.address] = position
        find_contacts(probe.model, probe.data)
        if any(True for _ in overlaps(probe, travel.part.body)) or probe.meets_itself():
            return True
    return False


def _footprints(model: Any, data: Any, own: frozenset[int]) -> Iterator[Any]:
    """Floor outlines of all obstacles of the pedestal, including closed doors."""
    for geom in range(model.ngeom):
        if geom in own or not model.geom_contype[geom] or model.geom_type[geom] == 0:
            continue
        corners = corners_of(model, data, geom)
        if corners[:, 2].max() > _ABOVE_FLOOR_M and corners[:, 2].min() < LIFTS_M[-1]:
            yield shapely.MultiPoint(corners[:, :2]).convex_hull
