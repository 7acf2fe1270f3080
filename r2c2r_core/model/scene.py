"""Articulated scene: fixtures made of panels, with the fitted meshes as visuals."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.motion import JointMotion, JointType, Source

InsidePart = Literal["depth", "shelves"]
"""Observable properties of the space behind a front: its depth (for a drawer, its tray's) and its shelves."""
GripPart = Literal["place", "protrusion", "thickness"]
"""Numbers of a handle's grip: its rectangle on the front, its distance from the front, its depth."""
Role = Literal["front", "handle", "carcass", "inner"]
"""Role of a board in its unit: a door or drawer front (or a fixed one beside it), a piece of a handle, an outer board of the
body, or something inside that no camera sees (a shelf, a divider, a drawer's tray)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Box:
    """A panel or a handle piece: a box in its link's frame."""

    name: str  # for people and files; its function is its role
    role: Role
    size_m: Vector3
    link_from_box: Rigid3
    sources: Mapping[GripPart, Source] = field(default_factory=dict)  # of a handle's grip; default where not listed
    confidence: float | None = None  # in a handle's grip, 0..1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConvexPiece:
    """A convex collider in its link's frame."""

    name: str
    vertices_link: Points


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inertial:
    """Mass properties in the link frame; inertia about the centre of mass, link axes."""

    mass_kg: float
    com_link: Vector3
    inertia: Matrix3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """One rigid body. Link frame: at the hinge for hinged parts, at the object's origin otherwise; axes as the object's."""

    name: str
    object_from_link: Rigid3  # at joint position 0
    boxes: tuple[Box, ...]  # colliders, and the visual where `visual` is None
    pieces: tuple[ConvexPiece, ...]
    visual: TexturedMesh | None  # in the link frame
    colour: tuple[float, float, float]  # RGB 0..1 of the primitive without a mesh
    inertial: Inertial

    def of_role(self, role: Role) -> tuple[Box, ...]:
        """The boxes with that role."""
        return tuple(box for box in self.boxes if box.role == role)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """Joint that moves `child` relative to `parent`. 0 is closed, positive opens."""

    name: str
    type: JointType
    parent: str
    child: str
    origin_object: Vector3
    axis_object: Vector3  # unit; right-hand rule for opening
    lower: float  # rad or m
    upper: float
    effort: float  # N m or N
    velocity: float
    damping: float
    friction: float
    sources: dict[str, Source]  # axis, origin, limits (the upper one), and lower where a person set it
    uncut: float | None = None  # the upper limit before an obstacle reduced it; None without one
    confidence: float | None = None  # in its hinge side, 0..1; None where the category leaves no choice
    motion: JointMotion | None = None  # filmed motion; None if it was not observed to move

    @property
    def has_stay(self) -> bool:
        """Whether it opens upwards about a level axis: on such flaps gas or spring stays carry the leaf's weight."""
        return self.type == "revolute" and float(self.axis_object[0]) < -0.7  # +X is along the front: within 45 degrees of it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneObject:
    """One fixture or free-standing object."""

    name: str
    category: str  # as the person wrote it
    fixture: str  # the fixture that built it ("drawer", "object" …)
    dimensions_m: Vector3  # width, depth, height, without the handle
    dimension_sources: tuple[Source, Source, Source]
    world_from_object: Rigid3
    links: tuple[Link, ...]  # links[0] is the base
    joints: tuple[Joint, ...]
    movable: bool  # a free body in simulation (bottle, chair) rather than fixed to the world
    warp_residual_m: float | None  # front corners, after the fit; None before warp
    warnings: tuple[str, ...]
    warp_residual_paper_m: float | None = None  # residual of the paper's affine map on its own four corners, for comparison
    final_from_placed: Rigid3 = field(default_factory=Rigid3)  # displacement by layout and person: a world motion
    inside_sources: Mapping[InsidePart, Source] = field(default_factory=dict)  # measured, or the fixture's default
    carried_by: str | None = None  # link of another object that it lies in and moves with: a drawer


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArticulatedScene:
    """All objects in the world frame."""

    name: str
    objects: tuple[SceneObject, ...]
    layout_moves_m: dict[str, float]  # displacement of each object by the layout
    warnings: tuple[str, ...]
    failures: dict[str, str] = field(default_factory=dict)  # objects left out, with one line each
    scale: float | None = None  # of its capture
