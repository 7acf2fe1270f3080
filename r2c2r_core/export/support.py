"""Support of free-standing objects: a surface of the scene, or a plate of the base's size, so that they do not fall.

A scan leaves gaps or overlaps of millimetres between a bottle and its worktop: the object is moved vertically to contact. A
mug on a counter that is not an object of the scene would drop to the floor in the first second. As the scan saw it at rest,
a plate replaces the surface; the manifest records this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.export.plan import WORLD, Body, Plan, collider_corners_world
from r2c2r_core.failing import apart
from r2c2r_core.geometry.gaps import last_contact
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.materials import CHIPBOARD
from r2c2r_core.model.scene import Box, Inertial, Link

PLATE_M = 0.01
_FOOT_M = 0.02  # height above the lowest point within which colliders form the base
_GAP_M = 1e-4  # no contact at rest, no visible fall
_HIGHER_M, _LOWER_M = 0.02, 0.035  # range of a supporting surface above or below the base: a tilted table top spans 3 cm
_UP = np.array([0.0, 0.0, 1.0])
_SHARE = 0.3  # minimum fraction of the base's corners on a support


def supported(plan: Plan) -> Plan:
    """The plan with every free object on its supporting surface, or on a plate if there is none and a plate fits."""
    bodies, plates = {body.name: body for body in plan.bodies}, list[Body]()
    lowest_first = sorted((b for b in plan.bodies if b.free and _colliders(b).size), key=lambda b: _colliders(b)[:, 2].min())
    for name in [body.name for body in lowest_first]:
        with apart("export", name, {}):  # it stays where it is
            carried, plate = _support(bodies[name], bodies, plan.floor_z_m)
            bodies |= carried
            plates += plate
    return replace(plan, bodies=(*bodies.values(), *plates))


def _support(thing: Body, bodies: Mapping[str, Body], floor_z_m: float) -> tuple[dict[str, Body], list[Body]]:
    """The bodies of an object moved onto its support, or a supporting plate if one fits."""
    points = _colliders(thing)
    if thing.parent != WORLD:  # a drawer carries it
        return {}, []
    others = [c for body in bodies.values() if body.object_name != thing.object_name for c in collider_corners_world(body)]
    gap_m = _gap_below(collider_corners_world(thing), others, floor_z_m)
    if gap_m is not None:
        lift = _GAP_M - gap_m
        return {body.name: _lifted(body, lift) for body in bodies.values() if body.object_name == thing.object_name}, []
    plate = _plate(thing, points)
    moving = [body for body in bodies.values() if body.free or body.joint is not None]
    in_the_way = _in_the_way(plate, [corners for body in moving for corners in collider_corners_world(body)])
    return {}, [] if in_the_way else [plate]


def _gap_below(parts: Sequence[Points], others: Sequence[Points], floor_z_m: float) -> float | None:
    """Gap between the object's colliders and the floor or the colliders that carry it; None where nothing does.

    They carry it if they lie under its middle or under enough corners of its base; negative where it has sunk into them.
    """
    points = np.concatenate(parts)
    bottom = float(points[:, 2].min())
    gaps = [bottom - floor_z_m] if abs(bottom - floor_z_m) <= _LOWER_M else []
    foot = points[points[:, 2] < bottom + _FOOT_M, :2]
    probes = np.concatenate([foot, points[:, :2].mean(axis=0, keepdims=True)])
    under = np.zeros(len(probes), dtype=bool)
    carrying = []
    for corners in others:
        reached = corners[:, 2].min() < bottom + _HIGHER_M and corners[:, 2].max() > bottom - _LOWER_M
        if reached and (below := _inside_plan(probes, corners[:, :2])).any():
            rises = [rise for own in parts if (rise := last_contact(own, corners, _UP)) is not None]
            near = [-rise for rise in rises if -_LOWER_M <= rise <= _HIGHER_M]
            under |= below & bool(near)
            carrying += near
    if under[-1] or under[:-1].mean() > _SHARE:
        gaps += carrying
    return min(gaps, default=None)


def _lifted(body: Body, lift_m: float) -> Body:
    """The body moved vertically."""
    raised = Rigid3(np.eye(3), np.array([0.0, 0.0, lift_m])) @ body.world_from_body
    from_parent = raised if body.parent == WORLD else body.parent_from_body
    return replace(body, world_from_body=raised, parent_from_body=from_parent, lowered_m=-lift_m)


def _colliders(body: Body) -> Points:
    return np.concatenate(collider_corners_world(body) or [np.zeros((0, 3))])


def _inside_plan(probes: np.ndarray, outline: np.ndarray) -> np.ndarray:
    from scipy.spatial import ConvexHull, QhullError

    try:
        sides = ConvexHull(outline).equations
    except QhullError:
        return np.zeros(len(probes), dtype=bool)
    return np.asarray((probes @ sides[:, :2].T + sides[:, 2] <= 1e-6).all(axis=1))


def _plate(thing: Body, points: Points) -> Body:
    """A box under the object's base, with the object's yaw."""
    own = thing.world_from_body.rotation
    yaw = np.arctan2(own[1, 0], own[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    bottom = float(points[:, 2].min())
    foot = points[points[:, 2] < bottom + _FOOT_M] @ turn
    low, high = foot.min(axis=0), foot.max(axis=0)
    size = np.array([max(high[0] - low[0], 0.02), max(high[1] - low[1], 0.02), PLATE_M])
    centre = turn @ np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, 0.0])
    pose = Rigid3(turn, np.array([centre[0], centre[1], bottom - _GAP_M - PLATE_M / 2]))
    mass = float(np.prod(size)) * CHIPBOARD.density_kg_m3
    name = f"{thing.object_name}_support"
    link = Link(
        name=name,
        object_from_link=Rigid3(),
        boxes=(Box(name="plate", role="carcass", size_m=size, link_from_box=Rigid3()),),
        pieces=(),
        visual=None,
        colour=(0.82, 0.82, 0.8),
        inertial=Inertial(mass_kg=mass, com_link=np.zeros(3), inertia=np.diag(mass / 12 * ((size**2).sum() - size**2))),
    )
    return Body(
        object_name=thing.object_name,
        category=thing.category,
        name=name,
        parent=WORLD,
        parent_from_body=pose,
        world_from_body=pose,
        joint_name=f"{name}_to_{WORLD}",
        joint=None,
        axis_body=None,
        free=False,
        link=link,
        folder="",
        texture=None,
        is_support=True,
    )


def _in_the_way(plate: Body, movers: Sequence[Points]) -> bool:
    """Whether the plate's bounding box meets that of a moving collider."""
    own = collider_corners_world(plate)[0]
    low, high = own.min(axis=0), own.max(axis=0)
    return any(bool(((c.max(axis=0) > low) & (c.min(axis=0) < high)).all()) for c in movers)
