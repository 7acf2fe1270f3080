"""Free travel of each joint before its leaf collides with static geometry."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import spared
from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.geometry.transforms import Rigid3, joint_transform
from r2c2r_core.kitchen.walls import depths_in, floor_height
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.scene import Box, Joint, Link, SceneObject
from r2c2r_core.tuning import param, tuned

_LEAST = {"revolute": 1e-3, "prismatic": 1e-3}  # minimum range of a jammed joint that simulators accept


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of collision-free joint travel."""

    touch_m: float = param(0.0005, "m", "Penetration above which two objects collide")
    edge_m: float = param(
        0.01,
        "m",
        "Maximum overlap of an opening front with a wall's plane, or of a closed one with a neighbour, that is an edge's error",
        source="a wall is a plane through a centimetre of uneven plaster, and a front's edge is known to 8 mm",
    )
    steps: int = param(36, "count", "Number of joint positions that are tested", ge=2)
    behind_m: float = param(
        0.05, "m", "Distance behind a wall's plane beyond which a closed front is not in front of that wall"
    )
    turn_spare_rad: float = param(float(np.deg2rad(1.0)), "rad", "Clearance of a door's travel before the obstacle")
    slide_spare_m: float = param(0.003, "m", "Clearance of a drawer's travel before the obstacle")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacles:
    """Static boxes in the world, with the object each belongs to."""

    boxes: Boxes
    owner: np.ndarray  # (n,) index of the object
    link: np.ndarray  # (n,) index of the link in the object


def open_freely(objects: Sequence[SceneObject], walls: Sequence[Wall], kept: frozenset[str]) -> list[SceneObject]:
    """The objects with each joint's upper limit reduced to its collision-free travel; joints in `kept` are a person's."""
    obstacles = gathered(objects)
    result = []
    for index, item in enumerate(objects):
        joints, warnings = [], list[str]()
        for joint in item.joints:
            if joint.name in kept:
                joints.append(joint)
                continue
            free, blocker = joint.upper, None
            with spared(f"how far {joint.name} opens was not checked", warnings):
                free, blocker, touched = free_travel(item, joint, index, objects, obstacles, walls)
                if touched is not None:
                    warnings.append(
                        f"{joint.name}: its closed front overlaps {touched}: an edge between them is measured wrong"
                    )
            if joint.motion is not None:  # filmed to open this far, so the apparent obstacle is a measurement error
                free = max(free, min(joint.motion.largest, joint.upper))
            if blocker is None or free >= joint.upper:
                joints.append(joint)
                continue
            joints.append(replace(joint, upper=free, uncut=joint.upper, sources={**joint.sources, "limits": "inferred"}))
            warnings.append(
                f"{joint.name} opens to {_amount(joint, free)} of {_amount(joint, joint.upper)}: {blocker} blocks it"
            )
        result.append(replace(item, joints=tuple(joints), warnings=(*item.warnings, *warnings)))
    return result


def free_travel(
    item: SceneObject,
    joint: Joint,
    index: int,
    objects: Sequence[SceneObject],
    obstacles: Obstacles,
    walls: Sequence[Wall],
) -> tuple[float, str | None, str | None]:
    """Collision-free travel of a joint with all others closed, its obstacle, and what its closed leaf overlaps."""
    params = tuned(Params)
    child_index = next(i for i, link in enumerate(item.links) if link.name == joint.child)
    child = item.links[child_index]
    others = ~((obstacles.owner == index) & (obstacles.link == child_index))
    moving = link_boxes(item, child)
    near = others & _within_reach(obstacles.boxes, item, joint, moving)
    corners, still = _corners(moving), np.flatnonzero(near)
    closed = np.zeros((len(moving.centres), len(still)))  # overlaps of the closed leaf: an edge's error blocks nothing
    touched = None
    for _, i, j, depth in _overlaps([moving], obstacles, still):
        if depth > params.touch_m:
            closed[i, j], touched = min(depth, params.edge_m), objects[obstacles.owner[still[j]]].name
    near_walls = [wall for wall, depth in zip(walls, depths_in(walls, corners), strict=True) if depth < params.behind_m]
    before = np.maximum(depths_in(near_walls, corners), 0.0)
    lowest_m = floor_height([corners, _corners(obstacles.boxes)]) - params.touch_m

    def blockers_at(positions: np.ndarray) -> list[str | None]:
        motions = [motion_at(item, joint, float(position)) for position in positions]
        places = [motion.apply(corners) for motion in motions]
        walled = [(depths_in(near_walls, place) > before + params.edge_m).any() for place in places]
        grounded = [place[:, 2].min() < lowest_m for place in places]
        found: list[str | None] = [None] * len(positions)
        for place, i, j, depth in _overlaps([_moved(moving, motion) for motion in motions], obstacles, still):
            if depth > closed[i, j] + params.touch_m:
                found[place] = objects[obstacles.owner[still[j]]].name
        return [
            "a wall" if wall else "the floor" if floor else name
            for wall, floor, name in zip(walled, grounded, found, strict=True)
        ]

    positions = np.linspace(0.0, joint.upper, params.steps + 1)
    blockers = blockers_at(positions)
    first = next((k for k, blocker in enumerate(blockers) if blocker is not None), None)
    if first is None:
        return joint.upper, None, touched
    free = float(positions[max(first - 1, 0)])
    return _shortened(_last_free(free, float(positions[first]), blockers_at), joint), blockers[first], touched


def _last_free(free: float, blocked: float, blockers_at: Callable[[np.ndarray], list[str | None]]) -> float:
    """The last free position between a free and a blocked one by bisection, to a 64th of the step."""
    for _ in range(6):
        middle = (free + blocked) / 2
        free, blocked = (middle, blocked) if blockers_at(np.array([middle])) == [None] else (free, middle)
    return free


def _shortened(free: float, joint: Joint) -> float:
    """A limit clear of the obstacle, and above zero so that the joint keeps a range."""
    params = tuned(Params)
    spare = params.turn_spare_rad if joint.type == "revolute" else params.slide_spare_m
    return max(free - spare, 0.5 * free, _LEAST[joint.type])


def motion_at(item: SceneObject, joint: Joint, position: float) -> Rigid3:
    """World motion of the joint's child from closed to `position`."""
    axis = item.world_from_object.rotation @ joint.axis_object
    pivot = item.world_from_object.apply(joint.origin_object)
    return joint_transform(axis, pivot, position, turns=joint.type == "revolute")


def _overlaps(moved: Sequence[Boxes], obstacles: Obstacles, near: np.ndarray) -> list[tuple[int, int, int, float]]:
    """Overlaps of moving boxes with obstacles: pose, moving box, obstacle and depth, the deepest last."""
    moving, still = Boxes(*(np.stack(part) for part in zip(*moved, strict=True))), Boxes(*(v[near] for v in obstacles.boxes))
    reach = np.linalg.norm(moving.halves, axis=-1)[..., None] + np.linalg.norm(still.halves, axis=-1)
    apart = np.linalg.norm(moving.centres[:, :, None] - still.centres, axis=-1)
    place, i, j = np.nonzero(apart < reach)  # broad phase: the other bounding spheres do not intersect
    depth = box_penetration(Boxes(*(v[place, i] for v in moving)), Boxes(*(v[j] for v in still)))
    order = [int(k) for k in np.argsort(depth, kind="stable") if depth[k] > 0]
    return [(int(place[k]), int(i[k]), int(j[k]), float(depth[k])) for k in order]


def _within_reach(boxes: Boxes, item: SceneObject, joint: Joint, moving: Boxes) -> np.ndarray:
    """Mask of obstacles near enough to the swept volume to be tested."""
    centre = moving.centres.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(_corners(moving), axis=0)))
    reach = size * 1.6 if joint.type == "revolute" else size + joint.upper
    return np.asarray(np.linalg.norm(boxes.centres - centre, axis=1) - np.linalg.norm(boxes.halves, axis=1) < reach)


def gathered(objects: Sequence[SceneObject]) -> Obstacles:
    """Boxes of all static geometry; movable objects do not limit a hinge."""
    parts: list[Boxes] = []
    owner: list[int] = []
    number: list[int] = []
    for index, item in enumerate(objects):
        for link_index, link in enumerate(item.links):
            if item.movable or not link.boxes:
                continue
            with spared(f"{link.name} stands in nobody's way", []):
                boxes = link_boxes(item, link)
                parts.append(boxes)
                owner += [index] * len(boxes.centres)
                number += [link_index] * len(boxes.centres)
    if not parts:
        return Obstacles(
            boxes=Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3))), owner=np.zeros(0, int), link=np.zeros(0, int)
        )
    joined = Boxes(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    return Obstacles(boxes=joined, owner=np.array(owner), link=np.array(number))


def link_boxes(item: SceneObject, link: Link) -> Boxes:
    """A link's boxes in the world, with the joint closed."""
    world_from_link = item.world_from_object @ link.object_from_link
    return _stacked([_in_world(box, world_from_link) for box in link.boxes])


def _in_world(box: Box, world_from_link: Rigid3) -> tuple[Rigid3, Vector3]:
    return world_from_link @ box.link_from_box, box.size_m


def _stacked(boxes: Sequence[tuple[Rigid3, Vector3]]) -> Boxes:
    return Boxes(
        np.array([pose.translation for pose, _ in boxes]),
        np.array([pose.rotation for pose, _ in boxes]),
        np.array([size / 2 for _, size in boxes]),
    )


def _moved(boxes: Boxes, motion: Rigid3) -> Boxes:
    return Boxes(motion.apply(boxes.centres), motion.rotation @ boxes.axes, boxes.halves)


def _corners(boxes: Boxes) -> np.ndarray:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    return (boxes.centres[:, None] + np.einsum("nij,nkj->nki", boxes.axes, signs[None] * boxes.halves[:, None])).reshape(-1, 3)


def _amount(joint: Joint, position: float) -> str:
    return f"{np.rad2deg(position):.0f}°" if joint.type == "revolute" else f"{position:.2f} m"
