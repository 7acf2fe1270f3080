"""Hand-made captures, tracks, placements and meshes: a box with a handle, placed by a random similarity."""

from dataclasses import dataclass

import manifold3d
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, front_rotation, nearest_rotation
from r2c2r_core.model.capture import Capture, Frame, Room, SceneSurface, Wall
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.track import FrontHandle, FrontPanel, MaskTrack, ThingBox


@dataclass(frozen=True)
class Handle:
    """A bar in front coordinates: centre x, z; length, thickness; vertical or not."""

    x: float
    z: float
    length: float = 0.16
    thick: float = 0.02
    out: float = 0.035
    vertical: bool = True

    @property
    def box(self) -> FrontHandle:
        w, h = (self.thick, self.length) if self.vertical else (self.length, self.thick)
        return FrontHandle(
            left_m=self.x - w / 2,
            right_m=self.x + w / 2,
            bottom_m=self.z - h / 2,
            top_m=self.z + h / 2,
            protrusion_m=self.out,
            confidence=0.9,
        )


@dataclass(frozen=True)
class Unit:
    """One piece of furniture of the true kitchen."""

    name: str
    category: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float = 0.0  # of the object frame; 0: the front faces -Y
    handle: Handle | None = None
    kind: str = "front"
    with_track_front: bool = True
    with_track_handle: bool = True
    front_noise: tuple[float, float, float] = (0.0, 0.0, 0.0)  # along right, into, up

    @property
    def world_from_object(self) -> Rigid3:
        outward = np.array([np.sin(self.yaw), -np.cos(self.yaw), 0.0])
        return Rigid3(front_rotation(outward), np.array(self.centre))


def unit_mesh(unit: Unit, subdivide: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The unit as one closed mesh in the object frame, handle included."""
    half = np.array(unit.size) / 2
    parts = [box_mesh(-half, half)]
    if unit.handle is not None:
        b = unit.handle.box
        y = -half[1]
        parts.append(box_mesh(np.array([b.left_m, y - b.protrusion_m, b.bottom_m]), np.array([b.right_m, y + 0.005, b.top_m])))
    solids = [manifold3d.Manifold(manifold3d.Mesh64(v, f.astype(np.uint64))) for v, f in parts]
    mesh = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add).to_mesh64()
    vertices, faces = np.array(mesh.vert_properties), np.array(mesh.tri_verts, dtype=np.int64)
    for _ in range(subdivide):
        from trimesh.remesh import subdivide as split

        vertices, faces = split(vertices, faces)
    return np.asarray(vertices), np.asarray(faces)


def textured(vertices: np.ndarray, faces: np.ndarray, half: np.ndarray) -> TexturedMesh:
    """Mesh with uv from the front view (x right, z up), and a red mark in the upper left eighth of a grey picture."""
    texture = np.full((64, 64, 3), 150, np.uint8)
    texture[4:12, 4:12] = (220, 20, 20)
    uv = np.clip((vertices[:, [0, 2]] + half[[0, 2]]) / (2 * half[[0, 2]]), 0, 1)
    return TexturedMesh(vertices=vertices, faces=faces, uv=uv, texture=texture)


def placed_unit(
    unit: Unit, rng: np.random.Generator, *, subdivide: int = 0, stretch: tuple[float, float, float] = (1, 1, 1)
) -> tuple[MaskTrack, Placement, MeshAsset]:
    """Outputs of the earlier stages for a unit: its mesh in a random frame, and the similarity back."""
    vertices, faces = unit_mesh(unit, subdivide)
    half = np.array(unit.size) / 2
    mesh = textured(vertices, faces, half)
    world = unit.world_from_object.apply(vertices * np.array(stretch))
    mesh_from_world = Similarity3(1.7, nearest_rotation(rng.normal(size=(3, 3))), rng.normal(size=3))
    asset = MeshAsset(
        object_name=unit.name,
        candidate_id="c0",
        mesh=TexturedMesh(vertices=mesh_from_world.apply(world), faces=faces, uv=mesh.uv, texture=mesh.texture),
        generator="test",
        seed=0,
        watertight=True,
        frames=(0,),
        metrics={},
        parameters={},
        warnings=(),
    )
    placement = Placement(
        object_name=unit.name,
        candidate_id="c0",
        world_from_mesh=mesh_from_world.inverse,
        matches=10,
        inliers=10,
        votes={0: 10},
        rms_m=0.003,
        mask_iou=0.9,
        condition=10.0,
        unsure=False,
        runner_up=None,
        method="test",
        warnings=(),
    )
    return track_of(unit), placement, asset


def track_of(unit: Unit) -> MaskTrack:
    pose, half = unit.world_from_object, np.array(unit.size) / 2
    front = None
    if unit.kind != "thing" and unit.with_track_front:
        centre = pose.apply(np.array([0.0, -half[1], 0.0]) + np.array(unit.front_noise))
        front = FrontPanel(
            world_from_front=Rigid3(pose.rotation, centre),
            width_m=unit.size[0],
            height_m=unit.size[2],
            handle=unit.handle.box if unit.handle and unit.with_track_handle else None,
            confidence=0.9,
        )
    box = None
    if unit.kind != "front":
        box = ThingBox(world_from_object=pose, dimensions_m=np.array(unit.size), support_z_m=unit.centre[2] - unit.size[2] / 2)
    return MaskTrack(
        name=unit.name,
        category=unit.category,
        masks={0: pack_mask(np.ones((4, 4), bool))},
        confidence={0: 1.0},
        front=front,
        box=box,
        kind=unit.kind,  # type: ignore[arg-type]
        backend="test",
        prompt_count=1,
        warnings=(),
    )


def capture(walls: tuple[Wall, ...] = (), camera_at: tuple[float, float, float] = (0.0, -3.0, 1.5)) -> Capture:
    """A capture with one camera and no pixels."""
    camera = Intrinsics(fx=100, fy=100, cx=50, cy=40, width=100, height=80)
    frame = Frame(
        index=0,
        timestamp_s=0.0,
        rgb_camera=camera,
        depth_camera=camera,
        world_from_camera=Rigid3(np.eye(3), np.array(camera_at)),
        sharpness=1.0,
    )
    return Capture(
        name="test",
        sha256="0",
        format="test",
        frames=(frame,),
        world_from_capture=Rigid3(),
        room=Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=walls),
        surface=SceneSurface(
            vertices_world=np.zeros((0, 3)), faces=np.zeros((0, 3), np.int64), colours=np.zeros((0, 3), np.uint8), voxel_m=0.01
        ),
        images=None,  # type: ignore[arg-type]  # no stage here looks at pixels
        notices=(),
    )
