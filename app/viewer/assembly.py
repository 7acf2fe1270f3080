"""A scene in the 3D view: one frame per body, for joint motion, hiding of objects and picking."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
import trimesh
import viser.transforms as vtf

from app.viewer.boxes import box_edges
from app.viewer.clip import Span, clip_of, span_of
from app.viewer.heat import EDGE_M, HEATS
from app.viewer.picking import Hit, first_face
from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.export.plan import WORLD, Body, Plan, facing, plan_bundle
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.raster import subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3, joint_transform
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.scene import ArticulatedScene, Link

Draw = Literal["meshes", "wireframe", "colliders", "both", "distance", "unobserved"]
_COLLIDER, _WIRE, _CUT = (86, 180, 233), (120, 130, 145), (230, 60, 150)
_CUT_M = 0.004  # thickness of cut edges
_CHOSEN, _CHOSEN_PX = (20, 130, 255), 3  # the box around the chosen object


@dataclass(slots=True)
class JointValue:
    """One joint of the shown scene."""

    name: str
    lower: float
    upper: float
    value: float


class Shape(NamedTuple):
    """Drawable faces in a body's frame."""

    vertices: Points
    faces: np.ndarray
    mesh: TexturedMesh | None  # textured; None: in `colour`
    colour: tuple[int, int, int]
    is_wire: bool
    opacity: float | None
    painted: np.ndarray | None = None  # RGB of each vertex, instead of texture or colour


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Drawing style of a scene."""

    draw: Draw = "meshes"
    clip: tuple[Sequence[float], Sequence[float]] | None = None  # lowest and highest kept corner, as fractions of the span
    paint: Callable[[Points], np.ndarray] | None = None  # RGB of world points, if `draw` requires it
    ahead: tuple[float, float] = (0.0, -1.0)  # direction of the fronts, if none open


@dataclass(slots=True)
class Assembly:
    """The bodies of a scene in one server, with its joint values."""

    server: Any
    plan: Plan
    shapes: dict[str, list[Shape]]  # by body
    frames: dict[str, Any] = field(default_factory=dict)
    joints: dict[str, JointValue] = field(default_factory=dict)
    hidden: frozenset[str] = frozenset()
    boxes: list[Any] = field(default_factory=list)  # around the chosen object
    ahead: tuple[float, float] = (0.0, -1.0)  # direction of the fronts, if none open
    span: Span = field(init=False)  # of the whole scene, closed and uncut
    parts: dict[str, tuple[Vector3, Vector3]] = field(init=False)  # bounds of each object, as fractions of the span

    def __post_init__(self) -> None:
        reached: dict[str, list[Points]] = {}
        for body in self.plan.bodies:
            found = [body.world_from_body.apply(shape.vertices) for shape in self.shapes[body.name]]
            reached.setdefault(body.object_name, []).extend(found)
        ahead = facing(self.plan)
        everything = [points for found in reached.values() for points in found] or [np.zeros((1, 3))]
        self.span = span_of(np.array([*self.ahead, 0.0]) if ahead is None else ahead, everything)
        self.parts = {name: self.span.part(found) for name, found in reached.items() if found}

    def hide(self, names: Collection[str]) -> None:
        """Hide these objects and show all others."""
        self.hidden = frozenset(names)
        for body in self.plan.bodies:
            self.frames[body.name].visible = body.object_name not in self.hidden

    def choose(self, name: str) -> None:
        """Draw a box around each body of the chosen object, which moves with it; none for an unknown name."""
        for box in self.boxes:
            box.remove()
        self.boxes = []
        for body in self.plan.bodies:
            points = [shape.vertices for shape in self.shapes[body.name] if len(shape.vertices)]
            if body.object_name == name and points:
                ends = box_edges(np.vstack(points).min(axis=0), np.vstack(points).max(axis=0))
                node = f"{self.frames[body.name].name}/chosen"
                self.boxes.append(
                    self.server.scene.add_line_segments(node, ends, _CHOSEN, thickness=_CHOSEN_PX, thickness_units="screen")
                )

    @property
    def points(self) -> Points:
        """Vertices (N, 3) of all visible bodies, closed."""
        return self.points_of({body.object_name for body in self.plan.bodies})

    def points_of(self, names: Collection[str]) -> Points:
        """Vertices (N, 3) of the visible ones of these objects, closed; the origin if none is visible."""
        shown = [(body, shape) for body, shape in self._shown() if body.object_name in names]
        found = [body.world_from_body.apply(shape.vertices) for body, shape in shown if len(shape.vertices)]
        return np.vstack(found) if found else np.zeros((1, 3))

    def move(self, values: Mapping[str, float]) -> None:
        """Set joints to these positions, clamped to their limits, and move the bodies."""
        self.set(values)
        for name, pose in self.poses().items():
            self.frames[name].position = pose.translation
            self.frames[name].wxyz = vtf.SO3.from_matrix(pose.rotation).wxyz

    def set(self, values: Mapping[str, float]) -> None:
        """Set joints to these positions, clamped, without moving the bodies."""
        for name, value in values.items():
            joint = self.joints[name]
            joint.value = float(min(max(value, joint.lower), joint.upper))

    def poses(self) -> dict[str, Rigid3]:
        """Pose (world_from_body) of every body."""
        found: dict[str, Rigid3] = {WORLD: Rigid3()}
        for body in self.plan.bodies:
            found[body.name] = found[body.parent] @ body.parent_from_body @ self._motion(body)
        found.pop(WORLD)
        return found

    def hit(self, origin: Vector3, direction: Vector3) -> Hit | None:
        """The first face of visible bodies on a ray in the world."""
        poses, best = self.poses(), None
        for body, shape in self._shown():
            body_from_world = poses[body.name].inverse
            start, along = body_from_world.apply(origin), body_from_world.rotation @ direction
            distance = first_face(start, along, shape.vertices, shape.faces)
            if distance is not None and (best is None or distance < best.distance_m):
                best = Hit(body.object_name, origin + distance * direction, distance)
        return best

    def remove(self) -> None:
        """Remove the scene's nodes and their children."""
        for frame in self.frames.values():
            frame.remove()

    def cut(self, low: Sequence[float], high: Sequence[float]) -> dict[str, Points]:
        """Cut away everything outside a box of the span at current joint values; the ends (n, 2, 3) of cut edges, by body."""
        clip, poses, edges = clip_of(self.span, low, high), self.poses(), {}
        for name, shapes in self.shapes.items():
            stay, lines = [], []
            for shape in shapes:
                uv = shape.mesh.uv if shape.mesh is not None else None
                vertices, faces, uv, ends = clip.cut(poses[name], shape.vertices, shape.faces, uv)
                mesh = (
                    replace(shape.mesh, vertices=vertices, faces=faces, uv=uv)
                    if shape.mesh is not None and uv is not None
                    else None
                )
                lines.append(ends)
                if len(faces):
                    stay.append(shape._replace(vertices=vertices, faces=faces, mesh=mesh))
            self.shapes[name], edges[name] = stay, np.vstack([np.zeros((0, 2, 3)), *lines])
        return edges

    def _shown(self) -> Iterator[tuple[Body, Shape]]:
        for body in self.plan.bodies:
            if body.object_name not in self.hidden:
                yield from ((body, shape) for shape in self.shapes[body.name])

    def _motion(self, body: Body) -> Rigid3:
        if body.joint is None or body.axis_body is None:
            return Rigid3()
        value = self.joints[body.joint_name].value
        return joint_transform(body.axis_body, np.zeros(3), value, turns=body.joint.type == "revolute")


def assemble(
    server: Any,
    root: str,
    scene: ArticulatedScene,
    style: Style,
    textured: Callable[[str, TexturedMesh], Any],
    values: Mapping[str, float] | None = None,
) -> Assembly:
    """Show a scene under a node `root`, with joints at these values, else closed; `textured` adds a textured mesh to a node."""
    plan = plan_bundle(scene)
    shapes = {body.name: list(shapes_of(body.link, style.draw)) for body in plan.bodies}
    shown = Assembly(server, plan, shapes, ahead=style.ahead)
    for body in plan.bodies:
        if body.joint is not None:
            low, high = body.joint.lower, body.joint.upper
            shown.joints[body.joint_name] = JointValue(body.joint_name, low, high, min(max(0.0, low), high))
    shown.set({name: value for name, value in (values or {}).items() if name in shown.joints})
    edges = shown.cut(*style.clip) if style.clip is not None else {}
    for number, body in enumerate(plan.bodies):
        node = f"{root}/{number}"
        shown.frames[body.name] = server.scene.add_frame(node, show_axes=False)
        for k, shape in enumerate(shown.shapes[body.name]):
            _add(server, f"{node}/{k}", _painted(shape, body, style), textured)
        if len(edges.get(body.name, ())):
            server.scene.add_line_segments(f"{node}/cut", edges[body.name].astype(np.float32), _CUT, thickness=_CUT_M)
    shown.move({})
    return shown


def _painted(shape: Shape, body: Body, style: Style) -> Shape:
    if style.paint is None or not len(shape.vertices):
        return shape
    return shape._replace(painted=style.paint(body.world_from_body.apply(shape.vertices)))


def _add(server: Any, node: str, shape: Shape, textured: Callable[[str, TexturedMesh], Any]) -> None:
    if shape.painted is not None:
        coloured = trimesh.Trimesh(shape.vertices, shape.faces, vertex_colors=shape.painted, process=False)
        server.scene.add_mesh_trimesh(node, coloured, cast_shadow=False)
    elif shape.mesh is not None:
        textured(node, shape.mesh)
    else:
        server.scene.add_mesh_simple(
            node,
            shape.vertices.astype(np.float32),
            shape.faces.astype(np.uint32),
            color=shape.colour,
            wireframe=shape.is_wire,
            opacity=shape.opacity,
            flat_shading=True,
            side="double",
            cast_shadow=False,
        )


def undressed(scene: ArticulatedScene, names: Collection[str]) -> ArticulatedScene:
    """The scene with the boxes of these objects instead of their meshes."""
    objects = tuple(
        replace(item, links=tuple(replace(link, visual=None) for link in item.links)) if item.name in names else item
        for item in scene.objects
    )
    return replace(scene, objects=objects)


def shapes_of(link: Link, draw: Draw) -> Iterator[Shape]:
    """Shapes to draw for a link, in its frame."""
    if draw in HEATS:
        yield from (_fine(shape) for shape in shapes_of(link, "meshes"))
        return
    if draw in ("meshes", "both", "wireframe"):
        if link.visual is not None:
            mesh = link.visual if draw != "wireframe" else None
            yield Shape(link.visual.vertices, link.visual.faces, mesh, _WIRE, draw == "wireframe", None)
        else:
            colour: Any = tuple(round(255 * part) for part in link.colour)
            yield from (
                Shape(v, f, None, _WIRE if draw == "wireframe" else colour, draw == "wireframe", None)
                for v, f in _colliders(link)
            )
    if draw in ("colliders", "both"):
        opacity, is_wire = (0.6, False) if draw == "colliders" else (None, True)
        yield from (Shape(v, f, None, _COLLIDER, is_wire, opacity) for v, f in _colliders(link))


def _fine(shape: Shape) -> Shape:
    """The same surface subdivided into triangles small enough for per-vertex colours."""
    vertices, faces, _ = subdivide_long_edges(shape.vertices, shape.faces, np.zeros((len(shape.vertices), 1)), EDGE_M)
    return shape._replace(vertices=vertices, faces=faces, mesh=None)


def _colliders(link: Link) -> Iterator[tuple[Points, np.ndarray]]:
    for box in link.boxes:
        vertices, faces = box_mesh(-box.size_m / 2, box.size_m / 2)
        yield box.link_from_box.apply(vertices), faces
    for piece in link.pieces:
        hull = trimesh.convex.convex_hull(piece.vertices_link)
        yield np.asarray(hull.vertices), np.asarray(hull.faces)
