"""What a project's 3D view shows, read from its workspace. Runs in the viewer's process."""

import warnings
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from app.viewer import gizmo as handles
from app.viewer.reduced import MAX_FACES, reduced
from r2c2r_core.errors import InputError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.workspace import Workspace

MAX_POINTS = 300_000
_HALF_VIEW_RAD = np.radians(75.0 / 2)  # viser's field of view, upright
POINTS_PER_NODE = 150_000  # one websocket frame each, so that the page stays alive while they arrive


@dataclass(slots=True)
class Joint:
    """One joint of the shown scene."""

    name: str
    lower: float
    upper: float
    value: float


@dataclass(slots=True)
class View:
    """One person's server for one project, and what is on it."""

    server: Any
    work: Workspace
    shown: list[Any] = field(default_factory=list)
    cloud: list[Any] = field(default_factory=list)
    cloud_full: bool = False
    urdf: Any = None
    joints: list[Joint] = field(default_factory=list)
    mode: str = ""
    text: str = ""
    full: bool = False  # every point and face was asked for
    reduced: bool = False  # fewer points or faces are shown than there are
    gizmo: handles.Gizmo | None = None
    known_capture: Any = None
    looked_at: tuple[Any, ...] = ()  # what the camera was turned to last
    steady: bool = False  # it stays where the person moved it

    def show(self, wish: dict[str, Any]) -> None:
        """Replace what is shown. The camera is turned to what was not shown before, and to what `look` asks for."""
        subject = (wish["mode"], wish.get("name"), wish.get("candidate"), wish.get("box") is not None)
        self.steady = subject == self.looked_at and wish.get("look") is None
        values = {joint.name: joint.value for joint in self.joints} if subject == self.looked_at else {}
        self._clear()
        self.full, self.reduced = bool(wish.get("full")), False
        self._show_cloud(bool(wish.get("cloud", True)) or wish["mode"] == "cloud")
        self.mode = wish["mode"]
        self.text = _MODES[self.mode](self, wish)
        for number, mark in enumerate(wish.get("marks", ())):
            self._add_mark(f"/marks/{number}", mark)
        whole = wish.get("look") == "scene" or not self.looked_at  # at first all of the scene
        if wish.get("focus") and not whole:
            self._look_from_path(np.asarray(wish["focus"], dtype=np.float64), distance=0.6)
        self.move({joint.name: values[joint.name] for joint in self.joints if joint.name in values})
        self.looked_at = subject

    def move(self, values: dict[str, float]) -> None:
        """Set joints, clamped to their limits; unknown names are refused."""
        known = {joint.name: joint for joint in self.joints}
        for name, value in values.items():
            if name not in known:
                raise InputError(f"the shown scene has no joint '{name[:60]}'", hint="show the scene first")
            known[name].value = float(min(max(value, known[name].lower), known[name].upper))
        if self.urdf is not None and self.joints:
            self.urdf.update_cfg(np.array([joint.value for joint in self.joints]))

    def place(self, pose: np.ndarray) -> None:
        """Put what is being moved at a pose, world_from_object (4, 4)."""
        if self.gizmo is None:
            raise InputError("nothing is being moved", hint="choose an object over the scan and press Move it")
        self.gizmo.put(Rigid3.from_matrix(pose))

    @property
    def pose(self) -> list[list[float]] | None:
        """Where what is being moved is, world_from_object; None when nothing is."""
        return self.gizmo.pose.matrix.tolist() if self.gizmo is not None else None

    def _clear(self) -> None:
        for handle in self.shown:
            handle.remove()
        self.shown.clear()
        if self.gizmo is not None:
            self.gizmo.remove()
            self.gizmo = None
        if self.urdf is not None:
            with warnings.catch_warnings(action="ignore"):  # it removes frames before the meshes that hang on them
                self.urdf.remove()
        self.urdf, self.joints = None, []

    def _show_cloud(self, wanted: bool) -> None:
        if wanted and (not self.cloud or self.full != self.cloud_full):
            for handle in self.cloud:
                handle.remove()
            self.cloud = self._add_cloud()
            self.cloud_full = self.full
        for handle in self.cloud:
            handle.visible = wanted
        self.reduced |= wanted and not self.full and len(self._capture().surface.vertices_world) > MAX_POINTS

    def _add_cloud(self) -> list[Any]:
        surface = self._capture().surface
        order = np.random.default_rng(0).permutation(len(surface.vertices_world))
        order = order if self.full else order[:MAX_POINTS]
        size = max(surface.voxel_m, 0.004)
        return [
            self.server.scene.add_point_cloud(
                f"/cloud/{start}",
                surface.vertices_world[part].astype(np.float32),
                surface.colours[part],
                point_size=size,
                point_shape="circle",
                precision="float32",
            )
            for start in range(0, len(order), POINTS_PER_NODE)
            for part in (order[start : start + POINTS_PER_NODE],)
        ]

    def _show_scan(self, wish: dict[str, Any]) -> str:
        surface = self._capture().surface
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        low, high = np.percentile(surface.vertices_world, (5, 95), axis=0)
        self._look(positions.mean(axis=0), (low + high) / 2)
        count = len(surface.vertices_world)
        return f"{min(count, MAX_POINTS) if not self.cloud_full else count} of {count} points of the scan"

    def _show_candidate(self, wish: dict[str, Any]) -> str:
        asset = self._asset(wish)
        rotation = np.asarray(wish.get("rotation", np.eye(3)), dtype=np.float64)
        vertices = asset.mesh.vertices @ rotation.T
        vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self._show_cloud(False)  # a candidate has its own frame: the scan means nothing beside it
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
                    raise InputError(f"{name} has no placement yet", hint="run the project first")
                continue
            asset = self._asset({"name": name, "candidate": placement.candidate_id})
            vertices = placement.world_from_mesh.apply(asset.mesh.vertices)
            opacity = float(wish.get("opacity", 1.0))
            if self.gizmo is not None:
                local = self.gizmo.pose.inverse.apply(vertices)
                self._add_mesh(f"{handles.NODE}/mesh", asset.mesh, local, opacity)
            else:
                self.shown.append(self._add_mesh(f"/shown/{number}", asset.mesh, vertices, opacity))
            centres.append((vertices.min(axis=0) + vertices.max(axis=0)) / 2)
        if not centres:
            raise InputError("nothing is placed yet", hint="run the project first")
        self._look_from_path(np.mean(centres, axis=0), distance=0.6 if self.gizmo is not None else 1.15)
        return f"{len(centres)} placed mesh{'es' if len(centres) > 1 else ''} over the scan"

    def _show_scene(self, wish: dict[str, Any]) -> str:
        if not wish.get("bundle"):
            raise InputError("there is no finished scene yet", hint="run the project first")
        from viser.extras import ViserUrdf

        collision = bool(wish.get("collision"))
        robot = _loaded(Path(wish["bundle"]) / "scene.urdf", collision)
        self.urdf = ViserUrdf(
            self.server, robot, root_node_name="/urdf", load_meshes=not collision, load_collision_meshes=collision
        )
        limits = self.urdf.get_actuated_joint_limits()
        self.joints = [_joint(name, *limits[name]) for name in self.urdf.get_actuated_joint_names()]
        self.move({})  # until the first configuration every joint stands at the origin
        self._look_at_all(robot.collision_scene if collision else robot.scene)
        return f"{len(self.joints)} joints" + (", colliders" if collision else "")

    def _add_mark(self, node: str, mark: dict[str, Any]) -> None:
        """A line or a word in the scene: joint axes, what the certificate found, what people said."""
        scene, colour = self.server.scene, tuple(mark.get("colour", (255, 225, 77)))
        if mark.get("line"):
            ends = np.asarray(mark["line"], dtype=np.float32)[None]
            self.shown.append(scene.add_line_segments(f"{node}/line", ends, colour, thickness=0.008))
        if mark.get("text"):
            self.shown.append(scene.add_label(f"{node}/text", mark["text"], position=tuple(mark["at"])))

    def _asset(self, wish: dict[str, Any]) -> Any:
        found = self.work.load_latest("generate", wish["name"])
        wanted = wish.get("candidate") or (found.chosen_id if found else None)
        for asset in found.candidates if found else ():
            if asset.candidate_id == wanted:
                return asset
        raise InputError(f"{wish['name']} has no candidate {wanted}", hint="run the project first")

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

    def _look_at_all(self, scene: Any) -> None:
        """From where the person who filmed stood, as far back as all of it takes."""
        low, high = np.asarray(scene.bounds, dtype=np.float64)
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        back = positions.mean(axis=0) - (low + high) / 2
        away = max(float(np.linalg.norm(back)), 1e-6)
        needed = float(np.linalg.norm(high - low)) / 2 / np.sin(_HALF_VIEW_RAD)
        self._look_from_path((low + high) / 2, distance=max(needed / away, 1.0))

    def _look_from_path(self, target: np.ndarray, distance: float = 1.15) -> None:
        """Look at the target from where the person who filmed stood; `distance` as a share of theirs."""
        positions = np.array([frame.world_from_camera.translation for frame in self._capture().frames])
        start = positions.mean(axis=0)
        self._look(target + distance * (start - target), target)

    def _look(self, position: np.ndarray, target: np.ndarray) -> None:
        if self.steady:
            return
        place, aim = tuple(float(v) for v in position), tuple(float(v) for v in target)
        self.server.initial_camera.position, self.server.initial_camera.look_at = place, aim
        for client in self.server.get_clients().values():
            client.camera.position, client.camera.look_at = place, aim

    def _capture(self) -> Any:
        if self.known_capture is None:
            self.known_capture = self.work.load_latest("ingest", "scene")
            if self.known_capture is None:
                raise InputError("the recording has not been read yet", hint="wait for the import")
        return self.known_capture


def _loaded(path: Path, collision: bool) -> Any:
    """The URDF, its textures as dull as they are: without a word about metal, GLB means all metal, which is drawn dark."""
    import trimesh
    import yourdfpy

    robot = yourdfpy.URDF.load(
        str(path),
        build_scene_graph=not collision,
        load_meshes=not collision,
        build_collision_scene_graph=collision,
        load_collision_meshes=collision,
        filename_handler=partial(yourdfpy.filename_handler_magic, dir=str(path.parent)),
    )
    for shape in (robot.collision_scene if collision else robot.scene).geometry.values():
        image = getattr(getattr(shape.visual, "material", None), "image", None)
        if image is not None:
            dull = trimesh.visual.material.PBRMaterial(baseColorTexture=image, metallicFactor=0.0, roughnessFactor=0.9)
            shape.visual = trimesh.visual.TextureVisuals(uv=shape.visual.uv, material=dull)
    return robot


def _joint(name: str, lower: float | None, upper: float | None) -> Joint:
    low, high = lower if lower is not None else 0.0, upper if upper is not None else np.pi
    return Joint(name, float(low), float(high), float(min(max(0.0, low), high)))


_MODES = {"cloud": View._show_scan, "candidate": View._show_candidate, "aligned": View._show_aligned, "scene": View._show_scene}
