"""Content of a project's 3D view, read from its workspace. Runs in the viewer's process."""

import itertools
import json
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from app.errors import NotReady
from app.viewer import gizmo as handles
from app.viewer import heat
from app.viewer.assembly import Assembly, Draw, JointValue, Style, assemble, undressed
from app.viewer.camera import AXES, Lens, from_axis, from_direction
from app.viewer.clip import Span, clip_of, span_of
from app.viewer.picking import Picked, first_of, nearest_point
from app.viewer.reduced import MAX_FACES, reduced
from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import InputError
from r2c2r_core.export.plan import facing
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.overrides import overrides_from
from r2c2r_core.synthesize.corrected import corrected, differs
from r2c2r_core.workspace import Workspace

_PIN_M = 0.012  # size of a comment's pin
_TAPE = (230, 60, 150)
_ONE_RUN = float(np.cos(np.radians(15.0)))  # units facing within this angle form one run
_AHEAD_M = 2.0  # distance of the orbit centre in front of a photo's camera
MAX_POINTS = 300_000
POINTS_PER_NODE = 150_000  # one WebSocket frame each, so that the page stays responsive while they arrive


@dataclass(slots=True)
class View:
    """One session's viser server for one project, with its content."""

    server: Any
    work: Workspace
    shown: list[Any] = field(default_factory=list)
    cloud: list[Any] = field(default_factory=list)
    cloud_of: tuple[Any, ...] = ()  # key of the shown points
    assembly: Assembly | None = None
    assembled: tuple[Any, ...] = ()  # key of its content
    preview: list[str] = field(default_factory=list)  # names of objects that are not shown as in the last run
    showing: int = 0  # counter for node names, as a replaced node of the same name keeps its text in the browser
    mode: str = ""
    chosen: str = ""  # name of the selected object
    text: str = ""
    full: bool = False  # all points and faces were requested
    reduced: bool = False  # fewer points or faces are shown than exist
    gizmo: handles.Gizmo | None = None
    known_capture: Any = None
    known_tree: Any = None  # of the scan's points
    looked_at: tuple[Any, ...] = ()  # last target of an automatic camera move
    steady: bool = False  # the camera stays where the user moved it
    placed: list[tuple[str, np.ndarray, np.ndarray]] = field(default_factory=list)  # name, vertices and faces over the scan
    picked: Picked = field(default_factory=Picked)
    lens: Lens = field(init=False)

    def __post_init__(self) -> None:
        self.lens = Lens(self.server)
        self.server.scene.on_click()(self._pick)

    def show(self, wish: dict[str, Any]) -> None:
        """Replace the content. The camera moves to new content, and to the target requested in `look`."""
        of_scene = wish["mode"] == "scene"  # whichever object of it is chosen
        subject = (wish["mode"], *(() if of_scene else (wish.get("name"), wish.get("candidate"), wish.get("box") is not None)))
        self.steady = subject == self.looked_at and wish.get("look") is None
        values = {joint.name: joint.value for joint in self.joints} if wish["mode"] == self.mode else {}
        self._clear(keep_assembly=of_scene)
        self.showing += 1
        self.full, self.reduced = bool(wish.get("full")), False
        self.lens.use(parallel=bool(wish.get("parallel")))
        self.mode, self.chosen = wish["mode"], wish.get("name") or wish.get("made") or ""
        wanted = (bool(wish.get("cloud", True)) and self.mode != "candidate") or self.mode == "cloud"
        try:
            self.text = _MODES[self.mode](self, wish | {"values": values})
        finally:
            self._show_cloud(wanted, wish.get("clip"))  # also without a scene
        for number, mark in enumerate(wish.get("marks", ())):
            self._add_mark(f"/marks/{self.showing}/{number}", mark)
        self._add_tape(np.asarray(wish.get("tape") or (), dtype=np.float64).reshape(-1, 3))
        if wish.get("focus") and wish.get("look") == "object":
            self._look_from_path(np.asarray(wish["focus"], dtype=np.float64), distance=0.6)
        if wish.get("look") in AXES:
            self._look(*from_axis(wish["look"], self._facing(), self._points()))
        if wish.get("look") == "run":
            self._look(*from_axis("front", *self._run()))
        if wish.get("look") == "photo" and wish.get("frame") is not None:
            self._stand_where_filmed(wish["frame"])
        if wish.get("camera"):
            self.lens.stand(np.asarray(wish["camera"]["position"]), np.asarray(wish["camera"]["target"]))
        self.move({joint.name: values[joint.name] for joint in self.joints if joint.name in values})
        self.looked_at = subject

    def move(self, values: dict[str, float]) -> None:
        """Set joints, clamped to their limits; unknown names are refused."""
        known = {joint.name for joint in self.joints}
        for name in values:
            if name not in known:
                raise InputError(f"the shown scene has no joint '{name[:60]}'", hint="show the scene first")
        if self.assembly is not None:
            self.assembly.move(values)

    @property
    def joints(self) -> list[JointValue]:
        """Joint values of the shown scene."""
        return list(self.assembly.joints.values()) if self.assembly is not None else []

    def place(self, pose: np.ndarray) -> None:
        """Set the pose of the object being moved, world_from_object (4, 4)."""
        if self.gizmo is None:
            raise InputError("nothing is being moved", hint="choose an object over the scan and press Move it")
        self.gizmo.put(Rigid3.from_matrix(pose))

    @property
    def pose(self) -> list[list[float]] | None:
        """Pose of the object being moved, world_from_object; None without one."""
        return self.gizmo.pose.matrix.tolist() if self.gizmo is not None else None

    def _clear(self, *, keep_assembly: bool) -> None:
        for handle in self.shown:
            handle.remove()
        self.shown.clear()
        self.placed.clear()
        if self.gizmo is not None:
            self.gizmo.remove()
            self.gizmo = None
        if self.assembly is not None and not keep_assembly:
            self._disassemble()

    def _disassemble(self) -> None:
        if self.assembly is not None:
            self.assembly.remove()
        self.assembly, self.assembled, self.preview = None, (), []

    def _show_cloud(self, wanted: bool, box: dict[str, Any] | None = None) -> None:
        made_of = (self.full, json.dumps(box), self.mode == "scene" and self.assembled)
        if wanted and (not self.cloud or (made_of if box else made_of[:2]) != self.cloud_of):
            for handle in self.cloud:
                handle.remove()
            self.cloud = self._add_cloud(box)
            self.cloud_of = made_of if box else made_of[:2]
        for handle in self.cloud:
            handle.visible = wanted
        self.reduced |= wanted and not self.full and len(self._capture().surface.vertices_world) > MAX_POINTS

    def _add_cloud(self, box: dict[str, Any] | None) -> list[Any]:
        surface = self._capture().surface
        order = np.random.default_rng(0).permutation(len(surface.vertices_world))
        if box:
            order = order[clip_of(self._span(), box["low"], box["high"]).keeps(surface.vertices_world[order])]
        order = order if self.full else order[:MAX_POINTS]
        size = max(surface.voxel_m, 0.004)
        return [
            self.server.scene.add_point_cloud(
                f"/cloud/{self.showing}/{start}",
                surface.vertices_world[part].astype(np.float32),
                surface.colours[part],
                point_size=size,
                point_shape="circle",
                precision="float32",
            )
            for start in range(0, len(order), POINTS_PER_NODE)
            for part in (order[start : start + POINTS_PER_NODE],)
        ]

    def _span(self) -> Span:
        """Extent to which a clip box refers: the shown scene, else most of the scan."""
        if self.assembly is not None:
            return self.assembly.span
        return span_of(self._facing(), [self._points()])

    @property
    def span_m(self) -> list[float] | None:
        """Width, depth and height of that extent; None where there is nothing to cut."""
        if self.mode not in ("scene", "cloud"):
            return None
        span = self._span()
        return [float(side) for side in span.high - span.low]

    def part_of(self, name: str | None) -> dict[str, list[float]] | None:
        """Bounds of an object of the scene as fractions of the span; None where it does not exist."""
        found = self.assembly.parts.get(name or "") if self.assembly is not None else None
        return {"low": found[0].tolist(), "high": found[1].tolist()} if found is not None else None

    def _show_scan(self, wish: dict[str, Any]) -> str:
        surface = self._capture().surface
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        low, high = np.percentile(surface.vertices_world, (5, 95), axis=0)
        self._look(positions.mean(axis=0), (low + high) / 2)
        count = len(surface.vertices_world)
        return f"{count if self.full else min(count, MAX_POINTS)} of {count} points of the scan"

    def _show_candidate(self, wish: dict[str, Any]) -> str:
        asset = self._asset(wish)
        rotation = np.asarray(wish.get("rotation", np.eye(3)), dtype=np.float64)
        vertices = asset.mesh.vertices @ rotation.T
        vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self.shown.append(self._add_mesh("/shown/0", asset.mesh, vertices, float(wish.get("opacity", 1.0))))
        radius = float(np.linalg.norm(vertices, axis=1).max())
        self._look(np.array([-0.5, -1.6, 0.6]) * 1.6 * radius, np.zeros(3))
        return f"candidate {asset.candidate_id}, {len(asset.mesh.faces)} faces"

    def _show_aligned(self, wish: dict[str, Any]) -> str:
        names = [wish["name"]] if wish.get("name") else self.work.names("align")
        centres = []
        moved = wish.get("box") if wish.get("name") else None
        if moved:
            self.gizmo = handles.add(self.server.scene, Rigid3.from_matrix(np.asarray(moved["pose"])), moved["size"])
        for number, name in enumerate(names):
            placement = self.work.load_latest("align", name)
            if placement is None:
                if wish.get("name"):
                    raise NotReady(f"{name} has no placement yet", hint="run the project first")
                continue
            asset = self._asset({"name": name, "candidate": placement.candidate_id})
            vertices = placement.world_from_mesh.apply(asset.mesh.vertices)
            opacity = float(wish.get("opacity", 1.0))
            if self.gizmo is not None:
                local = self.gizmo.pose.inverse.apply(vertices)
                self._add_mesh(f"{handles.NODE}/mesh", asset.mesh, local, opacity)
            else:
                self.shown.append(self._add_mesh(f"/shown/{number}", asset.mesh, vertices, opacity))
            self.placed.append((name, vertices, asset.mesh.faces))
            centres.append((vertices.min(axis=0) + vertices.max(axis=0)) / 2)
        if not centres:
            raise NotReady("nothing is placed yet", hint="run the project first")
        self._look_from_path(np.mean(centres, axis=0), distance=0.6 if self.gizmo is not None else 1.15)
        return f"{len(centres)} placed mesh{'es' if len(centres) > 1 else ''} over the scan"

    def _show_scene(self, wish: dict[str, Any]) -> str:
        """Show the newest scene, with a geometric preview of corrections made since the last run."""
        stage, scene = self._scene()
        kind = json.dumps([wish.get(key) for key in ("corrections", "undressed", "draw", "full", "clip")])
        made_from = (kind, self.work.noun_path(stage, "scene").stat().st_mtime_ns)
        if made_from != self.assembled:
            self._disassemble()
            said = overrides_from({"objects": wish.get("corrections") or {}}, self.work.root / "overrides.json")
            kept = [(item, self._corrected(item, said)) for item in scene.objects if not said.of(item.name).left_out]
            gone = {item.name for item in scene.objects} - {item.name for item, _ in kept} | set(wish.get("undressed") or ())
            self.preview = sorted(gone | {item.name for item, now in kept if differs(item, now)})
            objects = tuple(now for _, now in kept)
            shown = undressed(replace(scene, objects=objects), wish.get("undressed") or ())
            style, root = self._style(wish), f"/scene/{self.showing}"
            self.assembly = assemble(self.server, root, shown, style, self._add_fitted, wish["values"])
            self.assembled = made_from
        assert self.assembly is not None
        self.assembly.hide(wish.get("hidden") or ())
        self.assembly.choose(self.chosen)
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        points = self.assembly.points
        self._look(*from_direction(positions.mean(axis=0) - points.mean(axis=0), points))
        return f"{len(self.joints)} joints" + (", colliders" if wish.get("draw") in ("colliders", "both") else "")

    def _corrected(self, item: SceneObject, said: Overrides) -> SceneObject:
        track: MaskTrack | None = self.work.load_latest("segment", item.name) if item.joints else None
        return corrected(item, said.of(item.name), track.motions if track is not None else ())

    def _style(self, wish: dict[str, Any]) -> Style:
        draw: Draw = wish.get("draw") or "meshes"
        box = wish.get("clip")
        if draw in heat.HEATS and self.known_tree is None:
            self.known_tree = cKDTree(self._capture().surface.vertices_world)
        filmed = np.mean([frame.world_from_camera.translation for frame in self._capture().frames], axis=0)
        middle = np.mean(self._capture().surface.vertices_world, axis=0)
        return Style(
            draw=draw,
            clip=(box["low"], box["high"]) if box else None,
            paint=partial(heat.colours, draw, self.known_tree) if draw in heat.HEATS else None,
            ahead=(float(filmed[0] - middle[0]), float(filmed[1] - middle[1])),
        )

    def _scene(self) -> tuple[str, ArticulatedScene]:
        """The newest scene and its stage: the warped one, else the synthesised one."""
        for stage in ("warp", "synthesize"):
            found: ArticulatedScene | None = self.work.load_latest(stage, "scene")
            if found is not None:
                return stage, found
        raise NotReady("there is no finished scene yet", hint="run the project first")

    def _add_fitted(self, node: str, mesh: TexturedMesh) -> None:
        self._add_mesh(node, mesh, mesh.vertices, 1.0)

    def _add_mark(self, node: str, mark: dict[str, Any]) -> None:
        """Add lines or a label: joint axes, certificate findings, comments."""
        scene, colour = self.server.scene, tuple(mark.get("colour", (255, 225, 77)))
        if mark.get("lines"):
            ends = np.asarray(mark["lines"], dtype=np.float32)
            self.shown.append(scene.add_line_segments(f"{node}/line", ends, colour, thickness=0.008))
        if mark.get("pin"):
            self.shown.append(scene.add_icosphere(f"{node}/pin", radius=_PIN_M, color=colour, position=tuple(mark["at"])))
        if mark.get("text"):
            self.shown.append(scene.add_label(f"{node}/text", mark["text"], position=tuple(mark["at"])))

    def _add_tape(self, points: np.ndarray) -> None:
        """Add a measuring tape between two points, with its length."""
        scene = self.server.scene
        for k, point in enumerate(points):
            self.shown.append(
                scene.add_icosphere(f"/tape/{self.showing}/{k}", radius=_PIN_M / 2, color=_TAPE, position=tuple(point))
            )
        if len(points) == 2:
            self.shown.append(
                scene.add_line_segments(f"/tape/{self.showing}/line", points[None].astype(np.float32), _TAPE, thickness=0.006)
            )
            length = f"{1000 * float(np.linalg.norm(points[1] - points[0])):.0f} mm"
            self.shown.append(scene.add_label(f"/tape/{self.showing}/text", length, position=tuple(points.mean(axis=0))))

    def _asset(self, wish: dict[str, Any]) -> Any:
        found = self.work.load_latest("generate", wish["name"])
        wanted = wish.get("candidate") or (found.chosen_id if found else None)
        for asset in found.candidates if found else ():
            if asset.candidate_id == wanted:
                return asset
        raise NotReady(f"{wish['name']} has no candidate {wanted}", hint="run the project first")

    def _add_mesh(self, node: str, mesh: TexturedMesh, vertices: np.ndarray, opacity: float) -> Any:
        import trimesh
        from PIL import Image

        look: dict[str, Any] = {
            "baseColorTexture": Image.fromarray(mesh.texture),
            "metallicFactor": 0.0,
            "roughnessFactor": 0.9,
        }
        if opacity < 1.0:  # GLB handles have no opacity of their own
            look |= {"baseColorFactor": [255, 255, 255, round(255 * opacity)], "alphaMode": "BLEND"}
        visual = trimesh.visual.TextureVisuals(uv=mesh.uv, material=trimesh.visual.material.PBRMaterial(**look))
        shown = trimesh.Trimesh(vertices, mesh.faces, visual=visual, process=False)
        if len(mesh.faces) > MAX_FACES:
            self.reduced |= not self.full
            shown = shown if self.full else reduced(shown)
        _ = shown.vertex_normals  # without them every face is shaded flat
        return self.server.scene.add_mesh_trimesh(node, shown, cast_shadow=False)

    def _look_from_path(self, target: np.ndarray, distance: float = 1.15) -> None:
        """Look at the target from the mean filming position; `distance` as a factor of its distance."""
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        start = positions.mean(axis=0)
        self._look(target + distance * (start - target), target)

    def _look(self, position: np.ndarray, target: np.ndarray) -> None:
        if not self.steady:
            self.lens.look(position, target)

    def _points(self) -> Points:
        """Points (N, 3) of the content: all of the scene, else the corners of most of the scan."""
        if self.assembly is not None:
            return self.assembly.points
        low, high = np.percentile(self._capture().surface.vertices_world, (2, 98), axis=0)
        return np.array(list(itertools.product(*zip(low, high, strict=True))))

    def _facing(self) -> Vector3:
        """Direction of the fronts; without openable ones, towards the filming position."""
        found = facing(self.assembly.plan) if self.assembly is not None else None
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        return found if found is not None else positions.mean(axis=0) - self._points().mean(axis=0)

    def _run(self) -> tuple[Vector3, Points]:
        """Direction of the chosen object's front, and points of all objects facing the same way; of everything without one."""
        bodies = self.assembly.plan.bodies if self.assembly is not None else ()
        ahead = next((-b.world_from_body.rotation[:, 1] for b in bodies if b.object_name == self.chosen), None)
        if self.assembly is None or ahead is None:
            return self._facing(), self._points()
        facing_there = {b.object_name for b in bodies if -b.world_from_body.rotation[:, 1] @ ahead > _ONE_RUN}
        return ahead, self.assembly.points_of(facing_there)

    def _stand_where_filmed(self, index: int) -> None:
        """Move the camera to a photo's pose with its lens, upright."""
        frame = next((frame for frame in self._capture().frames if frame.index == index), None)
        if frame is None:
            raise InputError(f"the recording has no frame {index}", hint="choose a photo of the object first")
        pose, camera = frame.world_from_camera, frame.rgb_camera
        upright = abs(pose.rotation[2, 1]) > abs(pose.rotation[2, 0])  # otherwise the phone was held sideways
        half = camera.height / 2 / camera.fy if upright else camera.width / 2 / camera.fx
        self.lens.stand(pose.translation, pose.translation + _AHEAD_M * pose.rotation[:, 2], 2 * float(np.arctan(half)))

    def _pick(self, event: Any) -> None:
        """Store the object under a click, or the scan's nearest point where only the scan is."""
        origin, direction = np.array(event.ray_origin, dtype=np.float64), np.array(event.ray_direction, dtype=np.float64)
        hit = self.assembly.hit(origin, direction) if self.assembly is not None else first_of(self.placed, origin, direction)
        if hit is None and self.cloud and self.cloud[0].visible:
            hit = nearest_point(self._capture().surface.vertices_world, origin, direction)
        self.picked = Picked(
            number=self.picked.number + 1,
            name=hit.name if hit else "",
            point=hit.point_world.tolist() if hit else None,
        )

    def _capture(self) -> Any:
        if self.known_capture is None:
            self.known_capture = self.work.load_latest("ingest", "scene")
            if self.known_capture is None:
                raise NotReady("the recording has not been read yet", hint="wait for the import")
        return self.known_capture


_MODES = {"cloud": View._show_scan, "candidate": View._show_candidate, "aligned": View._show_aligned, "scene": View._show_scene}
