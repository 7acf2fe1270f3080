"""Kitchens of the second generator, filmed while fronts are opened.

    python benchmarks/second_opened.py PATH/make_kitchen.py OUT --seed N [--frames F] [--size WxH] [--look-in]

PATH/make_kitchen.py is that generator, deliberately independent of the project; its layouts, paints, light and shading are used
unchanged, and nothing of the project's own generator is used. The moving parts, the space behind them, the camera path and the
hands are drawn here: hinges inside their boards, motion with a pause, drawers and shelves of other sizes, and a quarter of the
cabinets' doors with their handle on the hinge's side, so that only filming shows the hinge. OUT has capture.r3d,
prompts.json, truth.json and truth_masks/, laid out as `r2c2r sample --opened` writes them.
"""

import argparse
import importlib
import importlib.util
import json
import sys
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

Triple = tuple[float, float, float]
Motion = Literal["revolute", "prismatic"]

_FRONT_M, _GAP_M = 0.02, 0.0015  # as the generator makes its fronts
_CAPTURE_FROM_WORLD = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # ARKit: y up
_WALK = 0.42  # fraction of the film at which the walk past all fronts ends; fronts open at the start are closed before
_START = 0.09
_FRAMES_EACH, _MOST = 36, 6
_MISPLACED_SHARE = 0.25  # of cabinets' doors that have their handle on the hinge's side
_MIN_SEEN_PX, _MIN_SEEN_SHARE = 400, 0.25
_DEPTH_SIZE = (256, 192)


@dataclass(kw_only=True)
class Leaf:
    """One moving front, in world coordinates; `parts` are indices into the scene's parts."""

    name: str  # of its joint
    owner: int  # object number
    kind: str
    type: Motion
    axis: np.ndarray
    origin: np.ndarray
    upper: float
    hinge: str | None
    corners: np.ndarray  # (8, 3) of the closed front
    out: np.ndarray  # horizontal, into the room
    inside: dict[str, Any]
    front_parts: list[int] = field(default_factory=list)
    body_parts: list[int] = field(default_factory=list)

    def pose(self, state: float) -> np.ndarray:
        """4x4 motion from the closed pose."""
        moved = np.eye(4)
        if self.type == "prismatic":
            moved[:3, 3] = state * self.axis
        else:
            moved[:3, :3] = Rotation.from_rotvec(state * self.axis).as_matrix()
            moved[:3, 3] = self.origin - moved[:3, :3] @ self.origin
        return moved


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Opening and closing times of one leaf (fractions of the film), and its end position."""

    leaf: Leaf
    widest: float
    out: tuple[float, float]
    back: tuple[float, float]
    thinks: float  # fraction of the way at which the hand pauses; 0: no pause

    def state(self, time: float) -> float:
        """Joint position (rad or m) at a time."""
        return self.widest * (_way(time, *self.out, self.thinks) - _way(time, *self.back, 0.0))

    def moves(self, time: float) -> bool:
        """Whether a hand moves it."""
        return self.out[0] < time < self.out[1] or self.back[0] < time < self.back[1]


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw and film one kitchen."""
    parser = argparse.ArgumentParser(description="A kitchen of the second generator, filmed while fronts are opened.")
    parser.add_argument("generator", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=240)
    parser.add_argument("--size", default="960x720")
    parser.add_argument("--look-in", action="store_true", help="open drawers first, and film what lies in them from nearby")
    options = parser.parse_args(arguments)
    width, height = (int(value) for value in options.size.split("x"))
    film(_load(options.generator), options.out, options.seed, options.frames, width, height, look_in=options.look_in)


def film(generator: ModuleType, out: Path, seed: int, frames: int, width: int, height: int, *, look_in: bool = False) -> None:
    """Write the recording and its truth."""
    rng = np.random.default_rng([seed, 41])
    leaves: list[Leaf] = []
    generator.unit = _units(generator.unit, leaves, rng)
    scene, run, length, _ = generator.build(seed)
    turns = _turns([leaf for leaf in leaves if leaf.kind == "drawer"] if look_in else leaves, frames, rng)
    sleeves = {turn.leaf.name: _sleeve(scene) for turn in turns}
    focal = 0.78 * width
    camera = np.array([[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1]])
    eyes, targets = _path(turns, run, length, frames, rng, look_in=look_in)
    lights = [((run @ [0.3 * length, -1.5, 2.4, 1])[:3], 0.9), ((run @ [0.9 * length, -2.2, 2.3, 1])[:3], 0.6)]
    names = [thing["name"] for thing in scene.objects]
    for name in names:
        (out / "truth_masks" / name).mkdir(parents=True, exist_ok=True)
    tally: list[dict[str, tuple[int, float]]] = []
    clicks: dict[int, list[tuple[float, int, float, float]]] = {}
    poses = []
    with zipfile.ZipFile(out / "capture.r3d", "w", zipfile.ZIP_STORED) as recording:
        for number in range(frames):
            time = number / max(frames - 1, 1)
            world_from_camera = _looking(eyes[number], targets[number], rng)
            _move(scene, turns, sleeves, time, world_from_camera)
            drawn, hit, depth = _draw(generator, scene, camera, (width, height), world_from_camera, lights)
            _store(recording, number, drawn, depth, rng)
            poses.append(_arkit(world_from_camera))
            owners = np.array([part["obj"] for part in scene.parts] + [-1])[hit]
            owners[_uncovered(leaves, hit, depth, camera, world_from_camera)] = -1
            for index in np.unique(owners[owners >= 0]):
                cv2.imwrite(str(out / "truth_masks" / names[index] / f"{number:06d}.png"), np.uint8(255) * (owners == index))
                _propose(clicks, int(index), number, hit, owners == index, leaves, rng)
            states = {turn.leaf.name: turn.state(time) for turn in turns}
            tally.append(
                {leaf.name: _seen(leaf, states.get(leaf.name, 0.0), hit, camera, world_from_camera) for leaf in leaves}
            )
        recording.writestr("metadata", json.dumps(_metadata(camera, width, height, poses)))
    times = [number / max(frames - 1, 1) for number in range(frames)]
    shown = [thing for index, thing in enumerate(scene.objects) if index in clicks or "carried_by" not in thing]
    entries = [entry for entry in _truth(scene, leaves, turns, times, tally) if entry["name"] in {t["name"] for t in shown}]
    _write(out / "truth.json", {"version": 1, "objects": entries})
    _write(out / "prompts.json", {"version": 1, "objects": _prompts(scene, clicks, rng)})


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_kitchen", path)
    if spec is None or spec.loader is None or not path.exists():
        raise SystemExit(f"{path}: no such program; give the path of make_kitchen.py")
    if importlib.util.find_spec("liblzfse") is None:  # the project's environment has the same codec by another name
        sys.modules["liblzfse"] = importlib.import_module("lzfse")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _units(plain: Callable[..., None], leaves: list[Leaf], rng: np.random.Generator) -> Callable[..., None]:
    """The generator's `unit`, made hollow, with its leaves recorded; some hinged below or above, in pairs, or over a drawer."""
    given: dict[str, int] = {}
    handles = rng.spawn(1)[0]

    def unit(
        scene: Any,
        name: str,
        category: str,
        run: np.ndarray,
        x: float,
        width: float,
        z: float,
        height: float,
        depth: float,
        colour: Triple,
        texture: str,
        hinge: str | None = None,
    ) -> None:
        first, owner = len(scene.parts), len(scene.objects)
        plain(scene, name, category, run, x, width, z, height, depth, colour, texture, hinge=hinge)
        panel = [part for part in scene.parts[first + 3 :]]  # a microwave's controls, which do not move
        del scene.parts[first:]
        scene.parts += panel
        way = _way_of(category, hinge, width, given, rng)
        scene.objects[owner]["category"] = {"pair": "double_door_cabinet", "bottom": "dishwasher"}.get(way, category)
        cell = Cell(
            scene=scene, run=run, owner=owner, name=name, colour=colour, texture=texture, x=x, z=z, width=width, height=height,
            depth=depth,
        )  # fmt: skip
        if way == "freezer":
            share = float(rng.uniform(0.3, 0.38)) * height
            _leaf(cell.part(0, share), "drawer", "_drawer", leaves, rng)
            _leaf(cell.part(share, height), hinge or "left", "_door", leaves, rng)
        elif way == "pair":
            middle = width / 2
            inside = _carcass(cell, rng, drawer=False)
            _board(cell.span(0, middle), "left", "_left", inside, leaves, rng)
            _board(cell.span(middle, width), "right", "_right", inside, leaves, rng)
        else:
            is_door = way in ("left", "right") and category in ("cabinet", "wall_cabinet")
            misplaced = is_door and handles.random() < _MISPLACED_SHARE
            _leaf(cell, way, "", leaves, rng, misplaced=misplaced)

    return unit


def _way_of(category: str, hinge: str | None, width: float, given: dict[str, int], rng: np.random.Generator) -> str:
    """Way in which a unit opens; each of the rarer ways is used at most once per kitchen."""
    rarer = {"cabinet": "bottom" if width < 0.5 else "pair", "wall_cabinet": "top", "refrigerator": "freezer"}.get(category)
    if rarer is not None and not given.get(rarer) and rng.random() < 0.75:
        given[rarer] = 1
        return rarer
    return "drawer" if category == "drawer" else hinge or "left"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One compartment's bounds in its run: x along it, y from the front (0) to the wall, z up."""

    scene: Any
    run: np.ndarray
    owner: int
    name: str
    colour: Triple
    texture: str
    x: float
    z: float
    width: float
    height: float
    depth: float

    def part(self, low: float, high: float) -> "Cell":
        """The part of the cell between two heights."""
        return Cell(**{**self.__dict__, "z": self.z + low, "height": high - low})

    def span(self, left: float, right: float) -> "Cell":
        """The part of the cell between two x positions."""
        return Cell(**{**self.__dict__, "x": self.x + left, "width": right - left})

    def box(self, low: Triple, high: Triple, colour: Any, texture: str = "paint", owner: int | None = None) -> int:
        """Add a box in the run's frame; return its number among the parts."""
        number = self.owner if owner is None else owner
        self.scene.box(low, high, self.run, number, np.asarray(colour), texture, False)
        return len(self.scene.parts) - 1


def _leaf(cell: Cell, way: str, suffix: str, leaves: list[Leaf], rng: np.random.Generator, *, misplaced: bool = False) -> None:
    inside = _carcass(cell, rng, drawer=way == "drawer")
    _board(cell, way, suffix, inside, leaves, rng, misplaced=misplaced)


def _carcass(cell: Cell, rng: np.random.Generator, *, drawer: bool) -> dict[str, Any]:
    """Add five boards and shelves; return their clear lengths."""
    wall, back = float(rng.uniform(0.012, 0.022)), cell.depth - float(rng.uniform(0.01, 0.05))
    x0, x1, z0, z1 = cell.x, cell.x + cell.width, cell.z, cell.z + cell.height
    y0, y1 = _FRONT_M + 0.001, cell.depth
    shade = np.array(cell.colour) * 0.9
    for low, high in (
        ((x0, y0, z0), (x0 + wall, y1, z1)),
        ((x1 - wall, y0, z0), (x1, y1, z1)),
        ((x0 + wall, y0, z0), (x1 - wall, y1, z0 + wall)),
        ((x0 + wall, y0, z1 - wall), (x1 - wall, y1, z1)),
        ((x0 + wall, back, z0 + wall), (x1 - wall, y1, z1 - wall)),
    ):
        cell.box(low, high, shade, cell.texture)
    clear = cell.height - 2 * wall
    shelves = (
        [] if drawer or clear < 0.35 else sorted(clear * rng.uniform(0.25, 0.75, 1 + int(clear > 0.55 and rng.random() < 0.5)))
    )
    shelves = shelves[:1] if len(shelves) > 1 and shelves[1] - shelves[0] < 0.12 else shelves
    for level in shelves:
        z = z0 + wall + float(level)
        cell.box((x0 + wall, y0 + 0.03, z - wall), (x1 - wall, back, z), (0.7, 0.7, 0.68), owner=-1)
        for _ in range(2):  # tins
            tin = x0 + cell.width * float(rng.uniform(0.2, 0.8))
            cell.box((tin - 0.04, back - 0.14, z), (tin + 0.04, back - 0.06, z + 0.09), rng.uniform(0.1, 0.8, 3), "label", -1)
    return {
        "depth_m": back - _FRONT_M,
        "width_m": cell.width - 2 * wall,
        "height_m": clear,
        "shelves_m": [float(level) for level in shelves],
        "board_m": wall,
        "front_m": _FRONT_M,
    }


def _board(
    cell: Cell,
    way: str,
    suffix: str,
    inside: dict[str, Any],
    leaves: list[Leaf],
    rng: np.random.Generator,
    *,
    misplaced: bool = False,
) -> None:
    """Add the front with its handle, a drawer's box, and the joint that moves them; `misplaced`: handle beside the hinge."""
    x0, x1, z0, z1 = cell.x + _GAP_M, cell.x + cell.width - _GAP_M, cell.z + _GAP_M, cell.z + cell.height - _GAP_M
    front = [cell.box((x0, 0, z0), (x1, _FRONT_M, z1), cell.colour, cell.texture)]
    grip = {"left": "right", "right": "left"}[way] if misplaced else way
    front.append(cell.box(*_handle(grip, x0, x1, z0, z1, cell.name), (0.75, 0.75, 0.78), "metal"))
    body: list[int] = []
    axis, origin, upper = _joint(cell, way, rng)
    if way == "drawer":
        inside, body = _drawer(cell, f"{cell.name}_joint{suffix}", inside, upper, rng)
    corners = np.array([[x, y, z, 1.0] for x in (x0, x1) for y in (0.0, _FRONT_M) for z in (z0, z1)])
    leaves.append(
        Leaf(
            name=f"{cell.name}_joint{suffix}",
            owner=cell.owner,
            kind="pair" if suffix in ("_left", "_right") else way if not suffix else f"refrigerator{suffix}",
            type="prismatic" if way == "drawer" else "revolute",
            axis=cell.run[:3, :3] @ axis,
            origin=(cell.run @ np.append(origin, 1))[:3],
            upper=upper,
            hinge=None if way == "drawer" else way,
            corners=(corners @ cell.run.T)[:, :3],
            out=-cell.run[:3, 1],
            inside=inside,
            front_parts=front,
            body_parts=body,
        )
    )


def _handle(way: str, x0: float, x1: float, z0: float, z1: float, name: str) -> tuple[Triple, Triple]:
    middle, high = (x0 + x1) / 2, z1 - z0
    if way in ("drawer", "bottom", "top"):
        z = z0 + 0.05 if way == "top" else z0 + 0.72 * high if way == "drawer" else z1 - 0.07
        return (middle - 0.08, -0.03, z), (middle + 0.08, -0.018, z + 0.012)
    x = x1 - 0.05 if way == "left" else x0 + 0.05
    length = min(0.18, 0.5 * high)
    z = z0 + 0.04 if name.startswith("wall") else z1 - 0.06 - length if high < 1.0 else z0 + 0.45 * high
    return (x - 0.006, -0.03, z), (x + 0.006, -0.018, z + length)


def _joint(cell: Cell, way: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """Axis, a point on it and the limit, in the run's frame: hinges lie a little inside the edge and behind the face."""
    middle = np.array([cell.x + cell.width / 2, 0.0, cell.z + cell.height / 2])
    inset, behind = float(rng.uniform(0.002, 0.014)), float(rng.uniform(0.0, 0.009))
    if way == "drawer":
        return np.array([0.0, -1.0, 0.0]), middle, round(float(rng.uniform(0.55, 0.85)) * (cell.depth - 0.06), 3)
    if way in ("left", "right"):
        sign = -1.0 if way == "left" else 1.0
        x = cell.x + inset if way == "left" else cell.x + cell.width - inset
        return np.array([0.0, 0.0, sign]), np.array([x, behind, middle[2]]), round(float(rng.uniform(1.45, 2.0)), 3)
    sign, z = (1.0, cell.z + inset) if way == "bottom" else (-1.0, cell.z + cell.height - inset)
    limit = rng.uniform(1.4, 1.57) if way == "bottom" else rng.uniform(1.2, 1.75)
    return np.array([sign, 0.0, 0.0]), np.array([middle[0], behind, z]), round(float(limit), 3)


def _drawer(
    cell: Cell, joint: str, carcass: dict[str, Any], travel: float, rng: np.random.Generator
) -> tuple[dict[str, Any], list[int]]:
    """Add the box that moves with a drawer's front, with two cartons in it; return its clear lengths."""
    wall, floor, slide = float(rng.uniform(0.01, 0.018)), 0.006, 0.014
    side = carcass["board_m"] + slide
    x0, x1 = cell.x + side, cell.x + cell.width - side
    z0 = cell.z + carcass["board_m"] + 0.008
    z1 = z0 + float(rng.uniform(0.45, 0.8)) * (carcass["height_m"] - 0.01)
    rear = min(_FRONT_M + travel + float(rng.uniform(0.02, 0.07)), _FRONT_M + carcass["depth_m"] - 0.004)
    colour = (0.8, 0.79, 0.75)
    boxes = [
        ((x0, _FRONT_M, z0), (x1, rear, z0 + floor)),
        ((x0, _FRONT_M, z0 + floor), (x0 + wall, rear, z1)),
        ((x1 - wall, _FRONT_M, z0 + floor), (x1, rear, z1)),
        ((x0 + wall, rear - wall, z0 + floor), (x1 - wall, rear, z1)),
    ]
    parts = [cell.box(low, high, colour) for low, high in boxes]
    sizes, clear = rng.spawn(1)[0], np.array([(x1 - x0) / 2 - wall, rear - wall - _FRONT_M, z1 - z0 - floor])
    for half in range(2):  # cartons that move along; the first is an object
        at = np.array([rng.uniform(0.25, 0.7), rng.uniform(0.2, 0.7), 0.0])
        size = np.minimum(sizes.uniform((0.09, 0.12, 0.05), (0.18, 0.24, 0.14)), [0.85, 0.6, 0.9] * clear)
        low = np.array([x0 + wall + half * clear[0], _FRONT_M, z0 + floor]) + (clear - size) * at
        owner = _carton(cell, joint, low, size) if half == 0 else -1
        parts.append(cell.box(tuple(low), tuple(low + size), rng.uniform(0.1, 0.9, 3), "label", owner))
    inside = {
        "depth_m": rear - wall - _FRONT_M,
        "width_m": x1 - x0 - 2 * wall,
        "height_m": z1 - z0 - floor,
        "shelves_m": [],
        "board_m": wall,
        "front_m": _FRONT_M,
    }
    return inside, parts


def _carton(cell: Cell, joint: str, low: np.ndarray, size: np.ndarray) -> int:
    """Add the entry of a carton in a drawer to the scene's objects; return its number."""
    objects, pose = cell.scene.objects, cell.run.copy()
    pose[:3, 3] = (cell.run @ [*(low + size / 2), 1.0])[:3]
    name = f"box_{sum(thing['category'] == 'box' for thing in objects)}"
    entry = {"name": name, "category": "box", "dims": size.tolist(), "T_world_object": pose.tolist(), "joint": None}
    objects.append({**entry, "carried_by": joint})
    return len(objects) - 1


def _turns(leaves: list[Leaf], frames: int, rng: np.random.Generator) -> list[Turn]:
    """Schedule of openings: one or two open from the start, the others in sequence, a pair together, the last until the end."""
    count = int(np.clip(frames // _FRAMES_EACH, 2, _MOST))
    chosen = _chosen([leaf for leaf in leaves if not leaf.name.startswith("microwave")], count, rng)
    early = 2 if count > 4 and rng.random() < 0.5 else 1
    singles = [group for group in chosen if len(group) == 1]
    starting = singles[:early]
    later = [group for group in chosen if group not in starting]
    turns = []
    for (leaf,) in starting:
        widest = round(float(rng.uniform(0.5, 0.9)) * leaf.upper, 3)
        turns.append(Turn(leaf=leaf, widest=widest, out=(-2.0, -1.0), back=(0.03, _START), thinks=0.0))
    slot = (1.0 - _WALK) / max(len(later), 1)
    for number, group in enumerate(later):
        begin, last = _WALK + number * slot, number == len(later) - 1
        for k, leaf in enumerate(group):
            rests = last or bool(rng.random() < 0.55)
            out = begin + (0.25 + 0.12 * k) * slot, begin + (0.5 + 0.12 * k) * slot
            back_at = out[1] + (float(rng.uniform(0.15, 0.2)) * slot if rests else 0.0)
            back = (3.0, 4.0) if last else (back_at, back_at + 0.2 * slot)
            widest = leaf.upper if rests else round(float(rng.uniform(0.45, 0.85)) * leaf.upper, 3)
            thinks = float(rng.uniform(0.35, 0.6)) if rng.random() < 0.4 else 0.0
            turns.append(Turn(leaf=leaf, widest=widest, out=out, back=back, thinks=thinks))
    return turns


def _chosen(leaves: list[Leaf], count: int, rng: np.random.Generator) -> list[list[Leaf]]:
    """Groups that open together, of as many different kinds as possible."""
    rest = [leaves[i] for i in rng.permutation(len(leaves))]
    groups: list[list[Leaf]] = []
    while rest and sum(len(group) for group in groups) < count:
        seen = [group[0].kind for group in groups]
        first = min(rest, key=lambda leaf: seen.count(leaf.kind))
        group = [leaf for leaf in rest if leaf.owner == first.owner] if first.kind == "pair" else [first]
        groups.append(group)
        rest = [leaf for leaf in rest if leaf not in group and leaf.owner != first.owner]
    return groups


def _way(time: float, start: float, end: float, thinks: float) -> float:
    """Progress from 0 to 1 along half a cosine; with a pause in between, along two of them."""
    t = float(np.clip((time - start) / (end - start), 0.0, 1.0))
    if not thinks:
        return 0.5 - 0.5 * float(np.cos(np.pi * t))
    first, second = min(t / 0.42, 1.0), max((t - 0.58) / 0.42, 0.0)
    return thinks * (0.5 - 0.5 * float(np.cos(np.pi * first))) + (1 - thinks) * (0.5 - 0.5 * float(np.cos(np.pi * second)))


def _path(
    turns: list[Turn], run: np.ndarray, length: float, frames: int, rng: np.random.Generator, *, look_in: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Eyes and targets in world coordinates: before each front while it moves, along the run in between."""
    from scipy.interpolate import PchipInterpolator

    knots: list[tuple[float, np.ndarray, np.ndarray]] = []
    starting = [turn for turn in turns if turn.out[0] < 0]
    for turn in starting[:1]:
        knots += [
            (t, *_before(turn.leaf, run, s, look_in=look_in)) for t, s in ((0.0, 0.0), (0.5 * _START, 0.12), (_START, -0.08))
        ]
    reach = length + 0.7
    for s in np.linspace(0.0, 1.0, 9):
        phase = 2 * np.pi * s
        eye = [reach * (0.5 - 0.55 * np.cos(phase)), -1.9 - 0.45 * np.sin(1.5 * phase), 1.4 + 0.2 * np.sin(3 * phase)]
        aim = [reach * (0.5 - 0.42 * np.cos(phase)), 0.2, 0.95 + 0.35 * np.sin(2 * phase + 1)]
        knots.append((_START + 0.04 + (_WALK - _START - 0.04) * s, (run @ [*eye, 1])[:3], (run @ [*aim, 1])[:3]))
    groups: dict[float, list[Turn]] = {}
    for turn in turns:
        if turn.out[0] >= 0:
            at = max(
                (start for start in groups if abs(start - turn.out[0]) < 0.2 * (turn.out[1] - turn.out[0]) + 0.03),
                default=turn.out[0],
            )
            groups.setdefault(at, []).append(turn)
    for group in groups.values():
        begin, end = min(t.out[0] for t in group), min(max(t.back[1] for t in group), 1.0)
        side = float(rng.choice((-1.0, 1.0)))
        for t, s in zip(np.linspace(begin - 0.01, end, 4), (0.0, 0.13, -0.06, 0.1), strict=True):
            views = [_before(turn.leaf, run, side * s, look_in=look_in) for turn in group]
            knots.append((float(t), np.mean([v[0] for v in views], axis=0), np.mean([v[1] for v in views], axis=0)))
    knots = sorted(knots, key=lambda knot: knot[0])
    knots = [knot for n, knot in enumerate(knots) if n == 0 or knot[0] > knots[n - 1][0] + 1e-4]
    times = np.array([knot[0] for knot in knots])
    at = np.clip(np.linspace(0, 1, frames), times[0], times[-1])
    eyes = PchipInterpolator(times, np.array([knot[1] for knot in knots]))(at)
    targets = PchipInterpolator(times, np.array([knot[2] for knot in knots]))(at)
    return eyes + rng.normal(0, 0.003, eyes.shape), targets + rng.normal(0, 0.004, targets.shape)


def _before(leaf: Leaf, run: np.ndarray, step: float, *, look_in: bool) -> tuple[np.ndarray, np.ndarray]:
    """An eye to one side of a front, and its target; from a drawer's side the camera looks down into it."""
    middle, across = leaf.corners.mean(axis=0), run[:3, 0]
    if look_in:
        return middle + 0.95 * leaf.out + (0.15 + step) * across + [0.0, 0.0, 0.95], middle + 0.2 * leaf.out
    aside = {"left": 0.45, "right": -0.45}.get(leaf.hinge or "", 0.35)
    high = middle[2] > 1.2
    eye = middle + (1.75 if leaf.hinge else 1.5) * leaf.out + (aside + step) * across
    eye[2] = 1.2 if high else 1.5
    return eye, middle + 0.2 * leaf.out + [0, 0, 0.15 if high else 0.0]


def _looking(eye: np.ndarray, target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """4x4 pose of a nearly level camera (x right, y down, z ahead)."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("z", rng.normal(0, 1.0), degrees=True).as_matrix()
    pose[:3, 3] = eye
    return pose


def _sleeve(scene: Any) -> int:
    """A dark arm along +z with its hand at the origin, labelled as no object."""
    import trimesh

    arm = trimesh.creation.capsule(radius=0.048, height=0.5, count=[12, 12])
    fist = trimesh.creation.icosphere(subdivisions=2, radius=0.06)
    mesh = trimesh.util.concatenate([fist, arm])
    scene.parts.append(
        {"mesh": mesh, "obj": -1, "color": np.array([0.07, 0.06, 0.06]), "tex": "paint", "T": np.eye(4), "moving": True}
    )
    return len(scene.parts) - 1


def _move(scene: Any, turns: list[Turn], sleeves: dict[str, int], time: float, world_from_camera: np.ndarray) -> None:
    """Set every part's current pose as `now`; a hand that moves nothing is put under the floor."""
    for part in scene.parts:
        part["now"] = np.eye(4)
    for turn in turns:
        pose = turn.leaf.pose(turn.state(time))
        for number in (*turn.leaf.front_parts, *turn.leaf.body_parts):
            scene.parts[number]["now"] = pose
        arm = np.eye(4)
        arm[2, 3] = -20.0
        if turn.moves(time):
            grip = pose[:3, :3] @ scene.parts[turn.leaf.front_parts[-1]]["mesh"].vertices.mean(axis=0) + pose[:3, 3]
            shoulder = world_from_camera[:3, 3] + world_from_camera[:3, :3] @ [0.22, 0.35, 0.0]
            along = (shoulder - grip) / np.linalg.norm(shoulder - grip)
            arm[:3, :3] = Rotation.align_vectors([along], [[0, 0, 1]])[0].as_matrix()
            arm[:3, 3] = grip
        scene.parts[sleeves[turn.leaf.name]]["now"] = arm


def _uncovered(
    leaves: list[Leaf], hit: np.ndarray, depth: np.ndarray, camera: np.ndarray, world_from_camera: np.ndarray
) -> np.ndarray:
    """Pixels (h, w) behind a front's closed place: masks cover what moves, and the uncovered interior has no label."""
    v, u = np.indices(depth.shape)
    local = np.stack([(u - camera[0, 2]) / camera[0, 0], (v - camera[1, 2]) / camera[1, 1], np.ones(depth.shape)], -1)
    points = (np.nan_to_num(depth)[..., None] * local) @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]
    found = np.zeros(depth.shape, bool)
    for leaf in leaves:
        up = np.array([0.0, 0.0, 1.0])
        axes = np.stack([np.cross(up, leaf.out), leaf.out, up], axis=1)
        low, high = (leaf.corners @ axes).min(axis=0), (leaf.corners @ axes).max(axis=0)
        place = points @ axes
        behind = (place[..., 1] < high[1] - 1e-3) & ((place > low) & (place < high))[..., [0, 2]].all(axis=-1)
        found |= behind & ~np.isin(hit, [*leaf.front_parts, *leaf.body_parts])
    return found


class _Moved:
    """The scene as `shade` reads it, with textures that move with their parts."""

    def __init__(self, scene: Any) -> None:
        self.parts = [{**part, "T": part["now"] @ part["T"]} for part in scene.parts]


def _draw(
    generator: ModuleType,
    scene: Any,
    camera: np.ndarray,
    size: tuple[int, int],
    world_from_camera: np.ndarray,
    lights: list[Any],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Colour 0..1, part number of every pixel (-1: none), and z-depth (nan: none)."""
    import open3d as o3d

    rays = o3d.t.geometry.RaycastingScene()
    for part in scene.parts:
        now = part["now"]
        vertices = (part["mesh"].vertices @ now[:3, :3].T + now[:3, 3]).astype(np.float32)
        rays.add_triangles(o3d.core.Tensor(vertices), o3d.core.Tensor(part["mesh"].faces.astype(np.uint32)))
    (width, height), eye = size, world_from_camera[:3, 3]
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    flat = np.stack([(u - camera[0, 2]) / camera[0, 0], (v - camera[1, 2]) / camera[1, 1], np.ones_like(u, float)], -1)
    towards = flat.reshape(-1, 3) @ world_from_camera[:3, :3].T
    found = rays.cast_rays(o3d.core.Tensor(np.hstack([np.broadcast_to(eye, towards.shape), towards]).astype(np.float32)))
    depth, hit = found["t_hit"].numpy(), found["geometry_ids"].numpy().astype(np.int64)
    there = np.isfinite(depth)
    hit[~there] = -1
    points = eye + towards * np.where(there, depth, 0)[:, None]
    normals = found["primitive_normals"].numpy()
    normals[(normals * towards).sum(1) > 0] *= -1
    lit = []
    for place, _ in lights:
        shadow = np.hstack([points + 2e-3 * normals, place - points]).astype(np.float32)
        lit.append(1.0 - rays.test_occlusions(o3d.core.Tensor(shadow), tnear=0.0, tfar=1.0).numpy())
    back = -towards / np.linalg.norm(towards, axis=1, keepdims=True)
    image = generator.shade(_Moved(scene), hit, points, normals, back, lights, lit)
    image[~there] = 0.5
    return image.reshape(height, width, 3), hit.reshape(height, width), np.where(there, depth, np.nan).reshape(height, width)


def _store(recording: zipfile.ZipFile, number: int, image: np.ndarray, depth: np.ndarray, rng: np.random.Generator) -> None:
    """Write one frame as Record3D does: blurred and grainy colour, smooth, biased and torn depth."""
    import liblzfse

    soft = cv2.GaussianBlur(image, (3, 3), 0.6) + rng.normal(0, 0.012, image.shape)
    photo = (np.clip(soft, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)
    recording.writestr(
        f"rgbd/{number}.jpg", cv2.imencode(".jpg", photo[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes()
    )
    small = cv2.resize(depth.astype(np.float32), _DEPTH_SIZE, interpolation=cv2.INTER_AREA)
    edge = np.abs(cv2.Laplacian(cv2.medianBlur(np.nan_to_num(small, nan=5.0), 3), cv2.CV_32F)) > 0.05
    bias = cv2.resize(rng.normal(0, 1, (12, 16)).astype(np.float32), _DEPTH_SIZE, interpolation=cv2.INTER_CUBIC)
    low = cv2.GaussianBlur(small, (3, 3), 0.8) * (1 + 0.0035 * bias + rng.normal(0, 0.0015, small.shape))
    low[rng.random(low.shape) < 0.01] = np.nan
    sure = np.full(low.shape, 2, np.uint8)
    sure[cv2.dilate(edge.astype(np.uint8), np.ones((3, 3))) > 0] = 1
    sure[~np.isfinite(low)] = 0
    recording.writestr(f"rgbd/{number}.depth", liblzfse.compress(np.ascontiguousarray(low, np.float32).tobytes()))
    recording.writestr(f"rgbd/{number}.conf", liblzfse.compress(sure.tobytes()))


def _arkit(world_from_camera: np.ndarray) -> list[float]:
    """Qx qy qz qw tx ty tz of an OpenGL camera in a y-up world."""
    turn = _CAPTURE_FROM_WORLD[:3, :3] @ world_from_camera[:3, :3] @ np.diag([1.0, -1, -1])
    place = _CAPTURE_FROM_WORLD[:3, :3] @ world_from_camera[:3, 3]
    return [*Rotation.from_matrix(turn).as_quat().tolist(), *place.tolist()]


def _metadata(camera: np.ndarray, width: int, height: int, poses: list[list[float]]) -> dict[str, Any]:
    focal, cx, cy = camera[0, 0], camera[0, 2], camera[1, 2]
    return {
        "K": [focal, 0, 0, 0, focal, 0, cx, cy, 1],
        "w": width,
        "h": height,
        "dw": _DEPTH_SIZE[0],
        "dh": _DEPTH_SIZE[1],
        "fps": 10,
        "poses": poses,
        "initPose": [0, 0, 0, 1, 0, 0, 0],
        "perFrameIntrinsicCoeffs": [[focal, focal, cx, cy]] * len(poses),
        "cameraType": 1,
        "frameTimestamps": [i / 10 for i in range(len(poses))],
    }


def _seen(leaf: Leaf, state: float, hit: np.ndarray, camera: np.ndarray, world_from_camera: np.ndarray) -> tuple[int, float]:
    """Number of visible pixels of a front, and their fraction of its whole outline."""
    pixels = int(np.isin(hit, leaf.front_parts).sum())
    pose = np.linalg.inv(world_from_camera) @ leaf.pose(state)
    corners = leaf.corners @ pose[:3, :3].T + pose[:3, 3]
    if corners[:, 2].min() < 0.05:
        return pixels, 0.0
    uv = (corners[:, :2] / corners[:, 2:] * camera[0, 0]).astype(np.float32)
    whole = float(cv2.contourArea(cv2.convexHull(uv)))
    return pixels, round(min(pixels / whole, 1.0), 4) if whole else 0.0


def _propose(
    clicks: dict[int, list[tuple[float, int, float, float]]],
    index: int,
    frame: int,
    hit: np.ndarray,
    mask: np.ndarray,
    leaves: list[Leaf],
    rng: np.random.Generator,
) -> None:
    """Add a plausible click on an object in this frame: well inside its front, in its current position."""
    boards = [leaf.front_parts[0] for leaf in leaves if leaf.owner == index]
    face = np.isin(hit, boards) if boards else mask
    if np.count_nonzero(face) < 200:
        return
    inner = cv2.distanceTransform(np.pad(face.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    rows, columns = np.nonzero(inner > 0.6 * inner.max())
    pick = int(rng.integers(len(rows)))
    border = face[0].any() or face[-1].any() or face[:, 0].any() or face[:, -1].any()
    score = np.count_nonzero(face) * (0.2 if border else 1.0)
    kept = [*clicks.get(index, []), (float(score), frame, float(columns[pick]), float(rows[pick]))]
    clicks[index] = sorted(kept, reverse=True)[:6]


def _prompts(
    scene: Any, clicks: dict[int, list[tuple[float, int, float, float]]], rng: np.random.Generator
) -> list[dict[str, Any]]:
    """One click per object, in one of its clearest views, closed or open."""
    entries = []
    for index, thing in enumerate(scene.objects):
        if clicks.get(index):
            _, frame, x, y = clicks[index][int(rng.integers(len(clicks[index])))]
            point = {"frame": frame, "x": x, "y": y, "label": 1}
            entries.append({"name": thing["name"], "category": thing["category"], "points": [point]})
    return entries


def _truth(
    scene: Any, leaves: list[Leaf], turns: list[Turn], times: list[float], tally: list[dict[str, tuple[int, float]]]
) -> list[dict[str, Any]]:
    entries = []
    for index, thing in enumerate(scene.objects):
        joints = [_joint_entry(leaf, turns, times, tally) for leaf in leaves if leaf.owner == index]
        hinges = {joint["hinge"] for joint in joints}
        bottle = thing["category"] == "bottle"
        entries.append(
            {
                "name": thing["name"],
                "category": thing["category"],
                "dimensions_m": [float(value) for value in thing["dims"]],
                "capture_from_object": (_CAPTURE_FROM_WORLD @ np.array(thing["T_world_object"])).tolist(),
                "joint": joints[0] if joints else None,
                "joints": joints,
                "hinge": hinges.pop() if len(hinges) == 1 else None,
                "symmetry": "axial" if bottle else None,
                "observed_axes": [True, bottle, True],
                "opened": [joint["name"] for joint in joints if any(joint["states"])] or None,
                "carried_by": thing.get("carried_by"),
            }
        )
    return entries


def _joint_entry(
    leaf: Leaf, turns: list[Turn], times: list[float], tally: list[dict[str, tuple[int, float]]]
) -> dict[str, Any]:
    turn = next((turn for turn in turns if turn.leaf is leaf), None)
    states = [0.0 if turn is None else round(turn.state(time), 6) for time in times]
    seen = [each[leaf.name] for each in tally]
    shown = [pixels >= _MIN_SEEN_PX and share >= _MIN_SEEN_SHARE for pixels, share in seen]
    return {
        "name": leaf.name,
        "type": leaf.type,
        "axis": (_CAPTURE_FROM_WORLD[:3, :3] @ leaf.axis).tolist(),
        "origin": (_CAPTURE_FROM_WORLD[:3, :3] @ leaf.origin).tolist(),
        "lower": 0.0,
        "upper": leaf.upper,
        "hinge": leaf.hinge,
        "states": states,
        "seen_px": [pixels for pixels, _ in seen],
        "seen_share": [share for _, share in seen],
        "largest": max((state for state, show in zip(states, shown, strict=True) if show), default=0.0),
        "inside": leaf.inside if any(states) else None,
    }


def _write(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
