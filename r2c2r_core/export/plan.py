"""Content of a bundle: every link with its unique name, its place in the tree and its files.

All writers read a `Plan`, so names and frames are decided once. Link frames of hinged parts are moved onto the hinge here
if they lie elsewhere in the scene, because URDF and MJCF turn a body about its own origin.
"""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import ExportFailed
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.walls import floor_height
from r2c2r_core.model.handle import Handle
from r2c2r_core.model.scene import ArticulatedScene, ConvexPiece, Inertial, Joint, Link, SceneObject

WORLD = "world"
ASSETS, MESHES = "assets", "meshes"
"""Folder of all objects, and folder of the meshes within one object's own."""


NOTED_MOVE_M = 0.015  # a support and what stands on it are each measured to about 1 cm


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """One link to be written; geometry in its own frame."""

    object_name: str
    category: str  # of its object, as typed by the user
    name: str  # link name, starts with the object's name, unique in the bundle
    parent: str  # WORLD or the name of another body
    parent_from_body: Rigid3  # closed
    world_from_body: Rigid3  # closed
    joint_name: str
    joint: Joint | None  # None: fixed to its parent
    axis_body: Vector3 | None
    free: bool  # a free rigid body, where the format supports it: then its parent only carries it
    link: Link
    folder: str  # of its meshes, relative to the written file
    texture: str | None  # file in the folder; bodies of one object share equal textures
    is_support: bool = False  # a plate of support.py, not part of the object
    lowered_m: float = 0.0  # by which support.py moved it down onto its support

    @property
    def texture_file(self) -> str | None:
        """PNG of the fitted mesh, relative to the written file."""
        return None if self.texture is None else f"{self.folder}/{self.texture}"

    @property
    def visual_file(self) -> str | None:
        """OBJ of the fitted mesh; None where the boxes are the visual."""
        return None if self.link.visual is None else f"{self.folder}/{self.name}_vis.obj"

    @property
    def collision_files(self) -> tuple[str, ...]:
        """OBJ of each convex piece, in order."""
        return tuple(f"{self.folder}/{self.name}_col_{k}.obj" for k in range(len(self.link.pieces)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """All bodies, parents before children."""

    name: str
    bodies: tuple[Body, ...]
    floor_z_m: float
    handles: tuple[Handle, ...] = ()  # of its joints, set by `with_handles`
    conflicts: Mapping[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    """By state: joints, or a joint and a free body, that overlap when open in it; set by the export's stage."""

    def of(self, object_name: str) -> tuple[Body, ...]:
        """The bodies of one object, its base first."""
        return tuple(body for body in self.bodies if body.object_name == object_name and not body.is_support)

    def body(self, name: str) -> Body:
        """The body of this name."""
        return next(body for body in self.bodies if body.name == name)

    def handles_of(self, link_name: str) -> tuple[Handle, ...]:
        """The handles that are parts of one link."""
        return tuple(handle for handle in self.handles if handle.link == link_name)

    def numbers(self, object_name: str) -> list[int]:
        """Numbers, from 1, of the object's own bodies."""
        own = self.of(object_name)
        return [number for number, body in enumerate(self.bodies, start=1) if body in own]

    def notes(self, object_name: str) -> tuple[str, ...]:
        """Notes for the user about the export of an object."""
        own = [body for body in self.bodies if body.object_name == object_name]
        plate = ["none of the named objects supports it: a thin plate was added under it" for body in own if body.is_support]
        far = max((body.lowered_m for body in own), key=abs, default=0.0)
        moved = f"was moved {'down' if far > 0 else 'up'} by {1000 * abs(far):.0f} mm onto what is under it: check its height"
        return (*plate, moved) if abs(far) > NOTED_MOVE_M else tuple(plate)


def plan_bundle(scene: ArticulatedScene) -> Plan:
    """Names, tree and files of a scene; raises ExportFailed when it has no object or an object's joints form no tree."""
    if not scene.objects:
        raise ExportFailed("the scene has no object", hint="add prompts, or see why the earlier stages failed")
    taken: set[str] = {WORLD}
    bodies: list[Body] = []
    for item in sorted(scene.objects, key=lambda item: item.carried_by is not None):  # drawers before what lies in them
        carrier = next((body for body in bodies if item.carried_by == body.link.name), None)
        bodies += _bodies_of(item, taken, carrier)
    lowest_m = floor_height(corners for body in bodies for corners in collider_corners_world(body))
    return Plan(name=_clean(scene.name) or "scene", bodies=tuple(bodies), floor_z_m=lowest_m)


def _bodies_of(item: SceneObject, taken: set[str], carrier: Body | None) -> list[Body]:
    """Bodies of an object; its base is a child of the body that carries it, else of the world."""
    ground, world_from_ground = (WORLD, Rigid3()) if carrier is None else (carrier.name, carrier.world_from_body)
    links = {link.name: link for link in item.links}
    joints = {joint.child: joint for joint in item.joints}
    for joint in item.joints:
        if joint.child in links:
            links[joint.child] = _on_the_hinge(links[joint.child], joint)
    names = {name: _unique(_starting_with(item.name, name, "body"), taken) for name in links}
    joint_names: set[str] = set()
    textures: dict[str, str] = {}
    bodies = []
    for link_name in _parents_first(item, joints):
        link, found = links[link_name], joints.get(link_name)
        base = link_name == item.links[0].name
        parent_link = found.parent if found is not None else item.links[0].name
        object_from_ground = item.world_from_object.inverse @ world_from_ground
        object_from_parent = object_from_ground if base else links[parent_link].object_from_link
        name = names[link_name]
        parent = ground if base else names[parent_link]
        joint_name = _starting_with(item.name, found.name, "joint") if found else f"{name}_to_{parent}"
        bodies.append(
            Body(
                object_name=item.name,
                category=item.category,
                name=name,
                parent=parent,
                parent_from_body=object_from_parent.inverse @ link.object_from_link,
                world_from_body=item.world_from_object @ link.object_from_link,
                joint_name=_unique(joint_name, joint_names),
                joint=found,
                axis_body=None if found is None else link.object_from_link.rotation.T @ _unit(found.axis_object),
                free=item.movable and base,
                link=link,
                folder=f"{ASSETS}/{item.name}/{MESHES}",
                texture=_texture(name, link, textures),
            )
        )
    return bodies


def _parents_first(item: SceneObject, joints: dict[str, Joint]) -> list[str]:
    """Link names in tree order; links without a joint are attached to the base."""
    names = [link.name for link in item.links]
    base = names[0]
    ordered = [base]
    waiting = [n for n in names[1:]]
    while waiting:
        ready = [n for n in waiting if n not in joints or joints[n].parent in ordered]
        if not ready or base in joints or len(set(names)) != len(names):
            raise ExportFailed(f"{item.name}: its joints do not form a tree below {base}", hint="report this scene as a defect")
        ordered += ready
        waiting = [n for n in waiting if n not in ready]
    return ordered


def _on_the_hinge(link: Link, joint: Joint) -> Link:
    """The link in a frame whose origin lies on the hinge line; prismatic parts and good frames stay as they are."""
    offset = link.object_from_link.translation - joint.origin_object
    axis = _unit(joint.axis_object)
    if joint.type != "revolute" or np.linalg.norm(offset - (offset @ axis) * axis) < 1e-6:
        return link
    object_from_new = Rigid3(link.object_from_link.rotation, np.asarray(joint.origin_object, dtype=np.float64))
    new_from_old = object_from_new.inverse @ link.object_from_link
    return replace(
        link,
        object_from_link=object_from_new,
        boxes=tuple(replace(box, link_from_box=new_from_old @ box.link_from_box) for box in link.boxes),
        pieces=tuple(ConvexPiece(name=p.name, vertices_link=new_from_old.apply(p.vertices_link)) for p in link.pieces),
        visual=None if link.visual is None else replace(link.visual, vertices=new_from_old.apply(link.visual.vertices)),
        inertial=_moved_inertial(link.inertial, new_from_old),
    )


def _moved_inertial(inertial: Inertial, new_from_old: Rigid3) -> Inertial:
    turn = new_from_old.rotation
    com = new_from_old.apply(inertial.com_link)
    return Inertial(mass_kg=inertial.mass_kg, com_link=com, inertia=turn @ inertial.inertia @ turn.T)


def collider_corners_world(body: Body) -> list[Points]:
    """Corners of each collider of a body in the world, joints closed."""
    own = [box.link_from_box.apply(box_corners(box.size_m)) for box in body.link.boxes]
    own += [piece.vertices_link for piece in body.link.pieces]
    return [body.world_from_body.apply(points) for points in own]


def facing(plan: Plan) -> Vector3 | None:
    """The horizontal direction (unit, world) that most moving fronts face; None where nothing opens."""
    fronts = [-body.world_from_body.rotation[:, 1] for body in plan.bodies if body.joint is not None]
    total = np.array([*np.sum(fronts, axis=0)[:2], 0.0]) if fronts else np.zeros(3)
    length = float(np.linalg.norm(total))
    return total / length if length > 1e-3 else None


def _texture(body_name: str, link: Link, textures: dict[str, str]) -> str | None:
    if link.visual is None:
        return None
    texture = np.ascontiguousarray(link.visual.texture)
    digest = hashlib.sha256(repr(texture.shape).encode() + texture.tobytes()).hexdigest()
    return textures.setdefault(digest, f"{body_name}_vis.png")


def _starting_with(object_name: str, name: str, bare: str) -> str:
    name = _clean(name)
    if name == object_name or not name:
        return f"{object_name}_{bare}"
    return name if name.startswith(f"{object_name}_") else f"{object_name}_{name}"


def _unique(name: str, taken: set[str]) -> str:
    """The name, with a number if another object's link already has it (`a`+`b_c` and `a_b`+`c`)."""
    candidate, number = name, 2
    while candidate in taken:
        candidate, number = f"{name}_{number}", number + 1
    taken.add(candidate)
    return candidate


def _clean(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")


def _unit(axis: Vector3) -> Vector3:
    return np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
