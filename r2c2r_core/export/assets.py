"""Each object as a separate asset: origin at the centre of its base, front at -y, closed, without the rest of the scene.

An asset's folder `assets/<object>/` is complete: it holds the meshes, to which the scene refers as well.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from r2c2r_core.export.plan import ASSETS, MESHES, WORLD, Body, Plan, collider_corners_world
from r2c2r_core.geometry.transforms import Rigid3


def asset_file(object_name: str, suffix: str) -> str:
    """An asset's file in the bundle; `suffix` begins with a dot."""
    return f"{ASSETS}/{object_name}/{object_name}{suffix}"


def object_names(plan: Plan) -> tuple[str, ...]:
    """The objects of a plan, in its order."""
    return tuple(dict.fromkeys(body.object_name for body in plan.bodies if not body.is_support))


def assets_of(plan: Plan) -> Iterator[Plan]:
    """A plan for each object, with its name; its world is the asset's frame, its paths are relative to the asset's folder."""
    for name in object_names(plan):
        yield _asset(plan, name)


def world_from_asset(plan: Plan, object_name: str) -> Rigid3:
    """Pose of an asset in the scene: the object's frame, lowered to its lowest collider."""
    bodies = plan.of(object_name)
    world_from_object = bodies[0].world_from_body @ bodies[0].link.object_from_link.inverse
    points = [world_from_object.inverse.apply(corners) for body in bodies for corners in collider_corners_world(body)]
    lowest = min((float(corners[:, 2].min()) for corners in points), default=0.0)
    return world_from_object @ Rigid3(np.eye(3), np.array([0.0, 0.0, lowest]))


def _asset(plan: Plan, object_name: str) -> Plan:
    asset_from_world = world_from_asset(plan, object_name).inverse
    turn = asset_from_world.rotation
    own = plan.of(object_name)
    links = {body.name for body in own}
    bodies = tuple(_in_asset(body, asset_from_world, is_base=body.parent not in links) for body in own)
    handles = tuple(
        replace(h, world_from_handle=asset_from_world @ h.world_from_handle, opening_world=turn @ h.opening_world)
        for h in plan.handles
        if h.link in links
    )
    return Plan(name=object_name, bodies=bodies, floor_z_m=0.0, handles=handles, conflicts=plan.conflicts)


def _in_asset(body: Body, asset_from_world: Rigid3, *, is_base: bool) -> Body:
    pose = asset_from_world @ body.world_from_body
    return replace(
        body,
        world_from_body=pose,
        parent=WORLD if is_base else body.parent,
        parent_from_body=pose if is_base else body.parent_from_body,
        folder=MESHES,
    )
