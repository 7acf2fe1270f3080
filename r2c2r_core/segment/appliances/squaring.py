"""An appliance's rectangle squared with its own body: sides and top that depth saw, where glass hides most of the front."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.segment.fronts.front import Front, front_middle
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.thing import ThingConfig, support_height
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When a rectangle is squared with its body."""

    stray_m: float = param(0.008, "m", "off a face, beyond which surface is something else", gt=0)
    least_noise_m: float = param(0.003, "m", "of fused depth, at least", gt=0)
    shell_m: float = param(0.05, "m", "how far the rectangle may be off")
    facing: float = param(0.85, "cosine", "with a face's direction", source="normals of noisy scans scatter")
    least_share: float = param(0.07, "share", "of a face that depth must have seen to measure anything by it")
    patch_m2: float = param(9e-4, "m²", "over which the noise of fused depth goes together", gt=0)
    sure_rad: float = param(float(np.radians(0.7)), "rad", "spread of a turn that is believed")
    most_rad: float = param(float(np.radians(8)), "rad", "of a turn that is believed")


@dataclass(frozen=True, slots=True, eq=False)
class _Faces:
    """Surface faces in the front frame at the rectangle's centre: x right, y back, z up."""

    centres: Points
    normals: Points
    areas: np.ndarray

    def where(self, member: np.ndarray) -> "_Faces":
        return _Faces(self.centres[member], self.normals[member], self.areas[member])

    def enough(self, width_m: float, height_m: float) -> bool:
        """Whether a good part of a face of that size was seen."""
        return bool(self.areas.sum() > tuned(Params).least_share * width_m * height_m)


def squared(front: Front, scene: Scene) -> Front:
    """The front turned and its edges moved to where the body's faces are; as it was where depth saw none of them."""
    params = tuned(Params)
    grid, cell = front.run.grid, front.cell
    middle = front_middle(front)
    centred = Rigid3(grid.world_from_plane.rotation, middle)
    half_w, half_h = cell.width * grid.cell_m / 2, cell.height * grid.cell_m / 2
    reach = np.array([half_w + params.shell_m, front.depth_m, half_h + params.shell_m])
    faces = _faces_inside(scene, centred, reach * [-1, 0, -1] - [0, 0.02, 0], reach)
    level = np.abs(faces.centres[:, 2]) < half_h - 0.02
    behind = (faces.centres[:, 1] > 0.03) & (faces.centres[:, 1] < front.depth_m)
    x, y = faces.centres[:, 0], faces.centres[:, 1]
    face = faces.where((faces.normals[:, 1] < -params.facing) & (np.abs(y) < 0.02) & (np.abs(x) < half_w - 0.01) & level)
    sides = {
        sign: faces.where(
            (sign * faces.normals[:, 0] > params.facing) & (np.abs(sign * x - half_w) < params.shell_m) & behind & level
        )
        for sign in (-1, 1)
    }
    turn, side_at = _turn(face, {sign: part for sign, part in sides.items() if part.enough(front.depth_m, 2 * half_h)})
    top = faces.where(
        (faces.normals[:, 2] > params.facing)
        & (np.abs(faces.centres[:, 2] - half_h) < params.shell_m)
        & behind
        & (np.abs(x) < half_w)
    )
    left, right = side_at.get(-1, -half_w), side_at.get(1, half_w)
    upper = _median(top) if top.enough(2 * half_w, front.depth_m) else half_h
    lower = max(-half_h, _floor(scene, middle, half_w) - middle[2])
    if right - left < half_w or upper - lower < half_h:
        return front
    column, row = (cell.left + cell.right) / 2, (cell.top + cell.bottom) / 2
    moved = Cell(
        column + left / grid.cell_m, row - upper / grid.cell_m, column + right / grid.cell_m, row - lower / grid.cell_m
    )
    return turned_front(front, moved, turn)


def turned_front(front: Front, cell: Cell, turn_rad: float, forward_m: float = 0.0) -> Front:
    """A front with another rectangle of its grid, turned about the upright axis through its middle and moved outwards."""
    run, middle = front.run, front_middle(front)

    def moved(world_from_plane: Rigid3) -> Rigid3:
        turned = Rigid3(rotation_about_z(turn_rad), middle) @ Rigid3(np.eye(3), -middle) @ world_from_plane
        return Rigid3(turned.rotation, turned.translation - forward_m * turned.rotation[:, 1])

    grid = replace(run.grid, world_from_plane=moved(run.grid.world_from_plane))
    region = replace(run.region, world_from_plane=moved(run.region.world_from_plane))
    return replace(front, cell=cell, run=replace(run, grid=grid, region=region))


def _turn(face: _Faces, sides: dict[int, _Faces]) -> tuple[float, dict[int, float]]:
    """By how much the body is turned (rad, from x to y), and where its sides are; no turn where that is unsure.

    Least squares of y = t x + c on the front and x = -t y + c on the sides, reweighted against strays.
    """
    params = tuned(Params)
    groups = [(0, face), *sides.items()] if len(face.areas) else list(sides.items())
    if not groups:
        return 0.0, {}
    rows, known, areas = [], [], []
    for k, (sign, part) in enumerate(groups):
        equation = np.zeros((len(part.areas), len(groups) + 1))
        equation[:, k] = 1
        equation[:, -1] = part.centres[:, 0] if sign == 0 else -part.centres[:, 1]
        rows.append(equation)
        known.append(part.centres[:, 1] if sign == 0 else part.centres[:, 0])
        areas.append(part.areas)
    system, values, area = np.concatenate(rows), np.concatenate(known), np.concatenate(areas)
    weight, solution = area, np.zeros(len(groups) + 1)
    for _ in range(6):
        normal = (system * weight[:, None]).T @ system
        solution = np.linalg.lstsq(normal, (system * weight[:, None]).T @ values, rcond=None)[0]
        stray = values - system @ solution
        weight = area / (1 + (stray / params.stray_m) ** 2)
    noise = max(float(np.sqrt(np.average(stray**2, weights=weight))), params.least_noise_m)
    spread = noise * np.sqrt(np.linalg.pinv(normal / params.patch_m2)[-1, -1])
    turn = float(solution[-1])
    if abs(turn) > params.most_rad or spread > params.sure_rad:
        return 0.0, {sign: _median_at(part) for sign, part in sides.items()}
    return turn, {sign: float(solution[k]) for k, (sign, _) in enumerate(groups) if sign != 0}


def _faces_inside(scene: Scene, world_from_front: Rigid3, low: np.ndarray, high: np.ndarray) -> _Faces:
    """The surface's faces with their middle in a box of the front frame."""
    parts = scene.parts
    centre = world_from_front.apply((low + high)[None] / 2)[0]
    near = parts.faces_near(centre, float(np.linalg.norm(high - low)) / 2)
    centres = world_from_front.inverse.apply(parts.middles[near])
    x, y, z = centres.T
    inside = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]) & (z > low[2]) & (z < high[2])
    near = near[inside]
    return _Faces(centres[inside], parts.normals[near] @ world_from_front.rotation, parts.areas_m2[near])


def _floor(scene: Scene, middle: Vector3, half_w: float) -> float:
    """World height of what it stands on; far below where nothing does."""
    support = support_height(scene, middle[None], ThingConfig(radius_m=half_w))
    return support if support is not None else -np.inf


def _median(part: _Faces) -> float:
    return _weighted_median(part.centres[:, 2], part.areas)


def _median_at(part: _Faces) -> float:
    return _weighted_median(part.centres[:, 0], part.areas)


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])
