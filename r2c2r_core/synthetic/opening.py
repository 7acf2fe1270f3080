"""Schedule of a recording in which fronts are opened: which ones, when, how far, and their interiors.

After a walk past everything closed, fronts are opened one after the other, if possible two of them overlapping in time; one is
open when the film begins and one is left open when it ends. Some rest where they stop, the others turn back earlier.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.insides import Hollow, appliance_hollow, carcass_behind, unit_hollow
from r2c2r_core.synthetic.kitchen import Appliance, Furniture, Kitchen, Run
from r2c2r_core.synthetic.truth import TrueJoint, TrueObject, true_objects

WALK_FROM, WALK_TO = 0.12, 0.46  # fractions of the recording: walk past everything, before the first front is opened
START_CLOSED = 0.085  # fraction at which the initially open front is closed
_FRAMES_EACH = 38  # frames of the recording per opened front
_MOST = 7
_RARE = ("lateral", "appliance drawer", "bottom", "top", "pair")  # kinds that are preferred where a kitchen has them
_CLEAR_M = 0.01  # clearance from the room's walls
_HELD_SHARE = 0.6
_TOGETHER_M = 1.4  # maximum distance between two fronts in one view
_MISPLACED_SHARE = 0.25  # of doors that have their handle on the hinge's side, so that only filming shows the hinge


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Front:
    """One front that can move, in the kitchen's frame."""

    owner: str  # the object's name
    joint: TrueJoint
    kind: str
    corners: np.ndarray  # (8, 3) of its box, closed
    run: Run | None  # None: of a free-standing machine
    hollow_key: str  # of the compartment it closes, as named by build.py

    @property
    def middle(self) -> np.ndarray:
        """Centre of its box."""
        return np.asarray(self.corners.mean(axis=0))

    def pose(self, state: float) -> Rigid3:
        """Motion from its closed pose, in the kitchen's frame."""
        return joint_pose(self.joint, state)


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """Trajectory of one front: closed until `rises[0]`, widest from `rises[1]` to `falls[0]`, closed from `falls[1]` on.

    Times are fractions of the recording; a front open at its beginning rose before 0, one left open falls after 1.
    """

    joint: str
    widest: float  # rad or m
    rises: tuple[float, float]
    falls: tuple[float, float]

    def state(self, time: float) -> float:
        """State at a time, rad or m."""
        return self.widest * (_ease(time, *self.rises) - _ease(time, *self.falls))

    def moves(self, time: float) -> bool:
        """Whether a hand moves it at that time."""
        return self.rises[0] < time < self.rises[1] or self.falls[0] < time < self.falls[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Film:
    """All openings of one recording."""

    kitchen: Kitchen
    fronts: Mapping[str, Front]  # every front that could move, by its joint's name
    openings: tuple[Opening, ...]  # in the order of the camera's visits
    hollows: Mapping[str, Hollow]

    def states(self, time: float) -> dict[str, float]:
        """State of every front's joint, rad or m."""
        found = dict.fromkeys(self.fronts, 0.0)
        return found | {opening.joint: opening.state(time) for opening in self.openings}

    def frames_open(self, owner: str, frames: int) -> frozenset[int]:
        """Frames in which a front of that object is not closed."""
        mine = [opening for opening in self.openings if self.fronts[opening.joint].owner == owner]
        return frozenset(i for i in range(frames) if any(o.state(share_of(i, frames)) > 0 for o in mine))


def share_of(frame: int, frames: int) -> float:
    """A frame's time as a share of the recording."""
    return frame / max(frames - 1, 1)


def plan_film(kitchen: Kitchen, frames: int, rng: np.random.Generator) -> Film:
    """Film of a kitchen with that many frames: more frames, more fronts."""
    kitchen = _with_misplaced_handles(_with_lift(kitchen, rng), rng.spawn(1)[0])
    fronts = {front.joint.name: front for front in _fronts(kitchen)}
    free = [front for front in fronts.values() if _is_free(front, kitchen)]
    chosen = _choose(free, int(np.clip(frames // _FRAMES_EACH, 2, _MOST)), rng)
    openings = _schedule(kitchen, chosen, rng)
    hollows: dict[str, Hollow] = {}
    for opening in openings:
        key = fronts[opening.joint].hollow_key
        if key not in hollows:
            hollows |= _hollows_of(kitchen, fronts[opening.joint], rng)
    return Film(kitchen=kitchen, fronts=fronts, openings=openings, hollows=hollows)


def joint_pose(joint: TrueJoint, state: float) -> Rigid3:
    """Motion of a joint's part, in the frame of the joint."""
    if joint.type == "prismatic":
        return Rigid3(np.eye(3), state * joint.axis)
    rotation = np.asarray(Rotation.from_rotvec(state * joint.axis).as_matrix())
    return Rigid3(rotation, joint.origin - rotation @ joint.origin)


def _ease(time: float, start: float, end: float) -> float:
    """Minimum-jerk trajectory from 0 to 1, as a hand moves objects (Flash and Hogan 1985)."""
    t = float(np.clip((time - start) / (end - start), 0.0, 1.0))
    return t**3 * (10 - 15 * t + 6 * t**2)


def _with_lift(kitchen: Kitchen, rng: np.random.Generator) -> Kitchen:
    """The kitchen with one single-door wall unit of its first run hinged at the top, its handle at the lower edge."""
    run = kitchen.runs[0]
    single = [unit for unit in run.upper if len(unit.leaves) == 1 and not carcass_behind(run, unit).glazed]
    if not single:
        return kitchen
    chosen = single[int(rng.integers(len(single)))]
    leaf = chosen.leaves[0]
    handle = leaf.handle
    if handle is not None:
        length = min(handle.length_m, 0.7 * leaf.width_m)
        handle = replace(handle, vertical=False, length_m=length, x=leaf.width_m / 2, z=0.05)
    limit = round(float(np.radians(rng.uniform(75, 110))), 3)
    lifted = replace(chosen, leaves=(replace(leaf, hinge="top", handle=handle, open_limit=limit),))
    upper = tuple(lifted if unit is chosen else unit for unit in run.upper)
    return replace(kitchen, runs=(replace(run, upper=upper), *kitchen.runs[1:]))


def _with_misplaced_handles(kitchen: Kitchen, rng: np.random.Generator) -> Kitchen:
    """The kitchen with the handles of some of its single doors on the hinge's side."""

    def again(unit: Furniture) -> Furniture:
        leaf = unit.leaves[0]
        is_door = len(unit.leaves) == 1 and leaf.hinge in ("left", "right")
        if not is_door or leaf.handle is None or rng.random() >= _MISPLACED_SHARE:
            return unit
        handle = replace(leaf.handle, x=leaf.width_m - leaf.handle.x)
        return replace(unit, leaves=(replace(leaf, handle=handle),))

    runs = (replace(run, base=tuple(map(again, run.base)), upper=tuple(map(again, run.upper))) for run in kitchen.runs)
    return replace(kitchen, runs=tuple(runs))


def _fronts(kitchen: Kitchen) -> list[Front]:
    objects = {thing.name: thing for thing in true_objects(kitchen)}
    found = []
    for run in kitchen.runs:
        for unit in (*run.base, *run.upper):
            found += _unit_fronts(unit, run, objects[unit.name], kitchen.style.front_thickness_m)
    for machine in (kitchen.fridge, kitchen.microwave):
        if machine is not None:
            found += _machine_fronts(machine, objects[machine.name])
    return found


def _unit_fronts(unit: Furniture, run: Run, thing: TrueObject, thickness: float) -> list[Front]:
    fronts = []
    for leaf, joint in zip(unit.leaves, thing.joints, strict=True):
        low = np.array([leaf.x, -unit.depth_m, leaf.z])
        high = low + np.array([leaf.width_m, thickness, leaf.height_m])
        kind = "pair" if len(unit.leaves) > 1 else leaf.hinge or ("lateral" if leaf.slides else "drawer")
        corners = run.kitchen_from_run.apply(_corners(low, high))
        fronts.append(Front(owner=unit.name, joint=joint, kind=kind, corners=corners, run=run, hollow_key=unit.name))
    return fronts


def _machine_fronts(machine: Appliance, thing: TrueObject) -> list[Front]:
    (width, depth, height), doors = machine.size_m, machine.drawer_m > 0
    fronts = []
    for name, joint in zip(machine.fronts, thing.joints, strict=True):
        left, right, bottom, top = -width / 2, width / 2, -height / 2, height / 2
        if doors:
            is_drawer = name.endswith("_drawer")
            bottom, top = (bottom, bottom + machine.drawer_m) if is_drawer else (bottom + machine.drawer_m, top)
            left, right = (left, 0.0) if name.endswith("_left") else (0.0, right) if name.endswith("_right") else (left, right)
        elif machine.door_width_m < width:
            left, right = (
                (left, left + machine.door_width_m) if machine.hinge == "left" else (right - machine.door_width_m, right)
            )
        low, high = np.array([left, -depth / 2, bottom]), np.array([right, -depth / 2 + machine.door_thickness_m, top])
        kind = "appliance drawer" if name.endswith("_drawer") else "pair" if doors else machine.category
        corners = thing.kitchen_from_object.apply(_corners(low, high))
        key = machine.fronts[0] if name.endswith("_right") else name
        fronts.append(Front(owner=machine.name, joint=joint, kind=kind, corners=corners, run=None, hollow_key=key))
    return fronts


def _corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _is_free(front: Front, kitchen: Kitchen) -> bool:
    """Whether its sweep is free, it carries nothing, and a person with a phone can stand in front of it."""
    way = swept(front)
    x0, x1, y0, _, _ = kitchen.room
    if way[:, 0].min() < x0 + _CLEAR_M or way[:, 0].max() > x1 - _CLEAR_M or way[:, 1].min() < y0 + 0.5:
        return False
    if front.run is None:
        return front.kind != "microwave" or _worktop_is_clear(way, kitchen)
    if len(kitchen.runs) == 3 and front.run is kitchen.runs[1]:  # an island's far side is another room
        return False
    unit = next(u for u in (*front.run.base, *front.run.upper) if u.name == front.owner)
    return not _carries(unit, front.run) and not carcass_behind(front.run, unit).glazed


def swept(front: Front, upto: float | None = None) -> np.ndarray:
    """(n, 3) positions of the corners of a front on its way to a state, or to its limit."""
    states = np.linspace(0.0, front.joint.upper if upto is None else upto, 9)
    return np.concatenate([front.pose(float(state)).apply(front.corners) for state in states])


def _carries(unit: Furniture, run: Run) -> bool:
    """Whether a towel or a sheet of paper hangs on a unit's front: it would be left behind."""
    leaf = unit.leaves[0]
    return any(
        board.low[1] < -unit.depth_m - 1e-4
        and board.low[0] < leaf.x + leaf.width_m
        and board.high[0] > leaf.x
        and board.low[2] < leaf.z + leaf.height_m
        and board.high[2] > leaf.z
        for board in run.boards
    )


def _worktop_is_clear(way: np.ndarray, kitchen: Kitchen) -> bool:
    """Whether the sweep of a microwave's door over the worktop is free."""
    low, high = way[:, :2].min(axis=0) - 0.06, way[:, :2].max(axis=0) + 0.06
    standing = [(b.x, b.y) for b in kitchen.bottles] + [
        (p.x, p.y) for p in kitchen.runs[0].props if p.z == 0 and p.kind != "hob"
    ]
    return not any((low < place).all() and (place < high).all() for place in np.array(standing).reshape(-1, 2))


def _choose(free: list[Front], count: int, rng: np.random.Generator) -> list[list[Front]]:
    """Groups of fronts that open together, of as many kinds as possible: a pair's two leaves are one group."""
    kinds: dict[str, list[Front]] = {}
    for front in free:
        kinds.setdefault(front.kind, []).append(front)
    common = [kind for kind in kinds if kind not in _RARE]
    order = [kind for kind in _RARE if kind in kinds] + [common[i] for i in rng.permutation(len(common))]
    chosen: list[list[Front]] = []
    taken: set[str] = set()
    while sum(len(group) for group in chosen) < count and any(kinds.values()):
        for kind in order:
            rest = [front for front in kinds[kind] if front.owner not in taken and front.hollow_key not in taken]
            kinds[kind] = rest
            if not rest or sum(len(group) for group in chosen) >= count:
                continue
            first = rest[int(rng.integers(len(rest)))]
            group = [front for front in rest if front.owner == first.owner] if kind == "pair" else [first]
            taken.add(first.owner)
            kinds[kind] = [front for front in rest if front not in group and not _shares_carcass(front, first)]
            chosen.append(group)
    return chosen


def _shares_carcass(a: Front, b: Front) -> bool:
    """Whether two doors slide past each other and close one compartment."""
    return a.kind == b.kind == "lateral" and a.run is b.run


def _schedule(kitchen: Kitchen, groups: list[list[Front]], rng: np.random.Generator) -> tuple[Opening, ...]:
    """One group already open at the start, the others in turn after the walk; the last stays open."""
    single = [group for group in groups if len(group) == 1 and (group[0].run is None or group[0].run is kitchen.runs[0])]
    start = single[int(rng.integers(len(single)))] if len(groups) > 1 and single else None
    turns = _overlapped(_in_reach([group for group in groups if group is not start], kitchen))
    openings = []
    if start is not None:
        (front,) = start
        widest = round(float(rng.uniform(0.55, 0.85)) * front.joint.upper, 3)
        openings.append(Opening(joint=front.joint.name, widest=widest, rises=(-2.0, -1.0), falls=(0.035, START_CLOSED)))
    length = (1.0 - WALK_TO) / max(len(turns), 1)
    for number, group in enumerate(turns):
        at, last = WALK_TO + number * length, number == len(turns) - 1
        for leaf, front in enumerate(group):
            held = last or bool(rng.random() < _HELD_SHARE)
            openings.append(_turn(front, at + 0.1 * leaf * length, length, held, last, rng))
    return tuple(openings)


def _turn(front: Front, at: float, length: float, held: bool, last: bool, rng: np.random.Generator) -> Opening:
    """One opening within its part of the film: approach, opening, an optional rest, and closing."""
    pace = float(rng.uniform(0.8, 1.05))
    out = at + 0.28 * length, at + (0.28 + 0.26 * pace) * length
    rest = float(rng.uniform(0.16, 0.22)) * length if held else 0.0
    back = (3.0, 4.0) if last else (out[1] + rest, out[1] + rest + 0.26 * pace * length)
    widest = front.joint.upper if held else round(float(rng.uniform(0.5, 0.85)) * front.joint.upper, 3)
    return Opening(joint=front.joint.name, widest=widest, rises=out, falls=back)


def _in_reach(groups: list[list[Front]], kitchen: Kitchen) -> list[list[Front]]:
    """The groups in nearest-neighbour order, from the main run's middle on."""
    here, rest, order = np.array([sum(kitchen.runs[0].ends) / 2, -1.5]), list(groups), []
    while rest:
        nearest = min(rest, key=lambda group: float(np.linalg.norm(group[0].middle[:2] - here)))
        here = nearest[0].middle[:2]
        order.append(nearest)
        rest = [group for group in rest if group is not nearest]
    return order


def _overlapped(groups: list[list[Front]]) -> list[list[Front]]:
    """The groups; if none has two fronts, the first two that fit one view without collision are merged."""
    if any(len(group) > 1 for group in groups):
        return groups
    for (number, (a,)), (other, (b,)) in combinations(enumerate(groups), 2):
        near = float(np.linalg.norm(a.middle - b.middle)) < _TOGETHER_M
        if near and a.run is b.run and _apart(swept(a), swept(b)):
            rest = [group for position, group in enumerate(groups) if position not in (number, other)]
            return [*rest[:number], [a, b], *rest[number:]]
    return groups


def _apart(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether the bounding boxes of two sweeps are disjoint."""
    return bool(((one.max(axis=0) < other.min(axis=0)) | (other.max(axis=0) < one.min(axis=0))).any())


def _hollows_of(kitchen: Kitchen, front: Front, rng: np.random.Generator) -> dict[str, Hollow]:
    """The compartment behind a front; french doors share one."""
    if front.run is not None:
        unit = next(u for u in (*front.run.base, *front.run.upper) if u.name == front.owner)
        return {front.hollow_key: unit_hollow(kitchen, front.run, unit, rng)}
    machine = kitchen.fridge if front.owner == kitchen.fridge.name else kitchen.microwave
    assert machine is not None
    return {front.hollow_key: appliance_hollow(machine, front.hollow_key, rng)}
