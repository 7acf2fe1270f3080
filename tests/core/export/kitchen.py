"""A small hand-made kitchen: a cabinet door, a drawer, a double door, a counter, and a bottle on it."""

from dataclasses import replace

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface
from r2c2r_core.model.inputs import ObjectPrompt, Overrides, PromptPoint, Prompts
from r2c2r_core.model.mesh import CandidateSet, MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.reconstruction import Reconstruction, StageRun
from r2c2r_core.model.scene import ArticulatedScene, Box, ConvexPiece, Inertial, Joint, Link, SceneObject
from r2c2r_core.model.track import MaskTrack

CREATED = "2026-11-21T06:00:00+00:00"
FRONT_M, WALL_M, SEAT_M = 0.018, 0.016, 0.003
INFERRED = {"axis": "inferred", "origin": "inferred", "limits": "default"}


def reconstruction(scene: ArticulatedScene | None = None) -> Reconstruction:
    """Complete input of the exporter for `scene`."""
    scene = scene or kitchen()
    clicked = [item for item in scene.objects if item.category != "counter"]  # the counter is made from the scan, unclicked
    return Reconstruction(
        capture=capture(),
        prompts=Prompts(objects=tuple(_prompt(item) for item in clicked)),
        overrides=Overrides(objects={}),
        tracks=tuple(_track(item) for item in clicked),
        candidates=tuple(_candidates(item.name) for item in clicked),
        placements=tuple(_placement(item) for item in clicked),
        scene=scene,
        stages=(StageRun(name="segment", backend="geometric", config={"voxel_m": 0.01}),),
        failures={"mug_1": "mug_1: no frame shows the object"},
    )


def kitchen() -> ArticulatedScene:
    """The valid kitchen: all gaps are 3 mm or more."""
    return ArticulatedScene(
        name="hand_made",
        objects=(
            cabinet("cabinet_1", x=-0.6),
            drawer("drawer_1", x=0.0),
            double_door("double_1", x=0.75),
            counter("counter_1"),
            bottle("bottle_1"),
        ),
        layout_moves_m={},
        warnings=(),
    )


def cabinet(name: str, *, x: float = 0.0, gap_m: float = SEAT_M, yaw: float = 0.0, front_gap_m: float = 0.003) -> SceneObject:
    """One left-hinged door on a hollow carcass; `gap_m` lies between the door and the carcass."""
    size = np.array([0.6 - front_gap_m, 0.56, 0.72])
    door_size = np.array([size[0], FRONT_M, size[2]])
    hinge = np.array([-size[0] / 2, -size[1] / 2, 0.0])
    door = Link(
        name=f"{name}_door",
        object_from_link=Rigid3(np.eye(3), hinge),
        boxes=(
            Box(name="front", role="front", size_m=door_size, link_from_box=_at([size[0] / 2, FRONT_M / 2, 0.0])),
            Box(
                name="handle",
                role="handle",
                size_m=np.array([0.014, 0.03, 0.16]),
                link_from_box=_at([size[0] - 0.05, -0.015, 0.18]),
            ),
        ),
        pieces=(),
        visual=panel_mesh(door_size, np.array([size[0] / 2, FRONT_M / 2, 0.0]), seed=1),
        colour=(0.8, 0.75, 0.7),
        inertial=_slab_inertial(door_size, np.array([size[0] / 2, FRONT_M / 2, 0.0])),
    )
    joint = Joint(
        name=f"{name}_hinge",
        type="revolute",
        parent=f"{name}_base",
        child=f"{name}_door",
        origin_object=hinge,
        axis_object=np.array([0.0, 0.0, -1.0]),
        lower=0.0,
        upper=1.75,
        effort=20.0,
        velocity=2.0,
        damping=0.5,
        friction=0.1,
        sources=INFERRED,
    )
    pose = Rigid3(rotation_about_z(yaw), np.array([x, 0.0, 0.1 + size[2] / 2]))
    return _object(name, "cabinet", size, pose, (carcass(name, size, gap_m), door), (joint,))


def double_door(name: str, *, x: float = 0.0) -> SceneObject:
    """Two doors on one carcass, 3 mm apart."""
    size = np.array([0.897, 0.56, 0.72])
    links, joints = [carcass(name, size, SEAT_M)], []
    leaf = np.array([size[0] / 2 - 0.0015, FRONT_M, size[2]])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hinge = np.array([-sign * size[0] / 2, -size[1] / 2, 0.0])
        centre = np.array([sign * leaf[0] / 2, FRONT_M / 2, 0.0])
        links.append(
            Link(
                name=f"{name}_{side}",
                object_from_link=Rigid3(np.eye(3), hinge),
                boxes=(
                    Box(name="front", role="front", size_m=leaf, link_from_box=Rigid3(np.eye(3), centre)),
                    Box(
                        name="handle",
                        role="handle",
                        size_m=np.array([0.014, 0.03, 0.16]),
                        link_from_box=_at([sign * (leaf[0] - 0.05), -0.015, 0.15]),
                    ),
                ),
                pieces=(),
                visual=None,
                colour=(0.55, 0.66, 0.62),
                inertial=_slab_inertial(leaf, centre),
            )
        )
        joints.append(
            Joint(
                name=f"{name}_{side}_hinge",
                type="revolute",
                parent=f"{name}_base",
                child=f"{name}_{side}",
                origin_object=hinge,
                axis_object=np.array([0.0, 0.0, -sign]),
                lower=0.0,
                upper=1.6,
                effort=20.0,
                velocity=2.0,
                damping=0.5,
                friction=0.1,
                sources=INFERRED,
            )
        )
    return _object(name, "double-door cabinet", size, _at([x, 0.0, 0.1 + size[2] / 2]), tuple(links), tuple(joints))


def drawer(name: str, *, x: float = 0.0) -> SceneObject:
    """A drawer with a tray and a bar handle."""
    size = np.array([0.597, 0.56, 0.3])
    front = np.array([size[0], FRONT_M, size[2]])
    at_front = np.array([0.0, -size[1] / 2 + FRONT_M / 2, 0.0])
    floor_size = np.array([size[0] - 2 * WALL_M - 0.02, 0.45, 0.01])
    at_floor = np.array([0.0, at_front[1] + FRONT_M / 2 + floor_size[1] / 2, -size[2] / 2 + WALL_M + 0.02])
    mover = Link(
        name=f"{name}_drawer",
        object_from_link=Rigid3(),
        boxes=(
            Box(name="front", role="front", size_m=front, link_from_box=Rigid3(np.eye(3), at_front)),
            Box(name="tray", role="inner", size_m=floor_size, link_from_box=Rigid3(np.eye(3), at_floor)),
            Box(
                name="handle",
                role="handle",
                size_m=np.array([0.18, 0.03, 0.012]),
                link_from_box=_at([0.0, -size[1] / 2 - 0.015, 0.08]),
            ),
        ),
        pieces=(),
        visual=_both(panel_mesh(front, at_front, seed=2), panel_mesh(floor_size, at_floor, seed=2)),
        colour=(0.8, 0.75, 0.7),
        inertial=_slab_inertial(front, at_front),
    )
    joint = Joint(
        name=f"{name}_slide",
        type="prismatic",
        parent=f"{name}_base",
        child=f"{name}_drawer",
        origin_object=np.zeros(3),
        axis_object=np.array([0.0, -1.0, 0.0]),
        lower=0.0,
        upper=0.42,
        effort=50.0,
        velocity=1.0,
        damping=5.0,
        friction=1.0,
        sources={"axis": "measured", "origin": "measured", "limits": "inferred"},
    )
    base = carcass(name, size, SEAT_M)
    return _object(name, "drawer", size, _at([x, 0.0, 0.52 + size[2] / 2]), (base, mover), (joint,))


def counter(name: str) -> SceneObject:
    """A slab 5 mm above the cabinets."""
    size = np.array([2.1, 0.6, 0.04])
    slab = Link(
        name=f"{name}_slab",
        object_from_link=Rigid3(),
        boxes=(Box(name="slab", role="carcass", size_m=size, link_from_box=Rigid3()),),
        pieces=(),
        visual=None,
        colour=(0.35, 0.33, 0.32),
        inertial=_slab_inertial(size, np.zeros(3)),
    )
    return _object(name, "counter", size, _at([0.15, 0.0, 0.825 + 0.02]), (slab,), ())


def bottle(name: str, *, x: float = 0.2, bottom_z: float = 0.8651, height_m: float = 0.26) -> SceneObject:
    """A free-standing object with one convex collider and its own texture."""
    size, half_m = np.array([0.08, 0.08, height_m]), height_m / 2
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring = np.column_stack([0.04 * np.cos(angles), 0.04 * np.sin(angles)])
    points = np.concatenate([np.column_stack([ring, np.full(16, z)]) for z in (-half_m, half_m)])
    body = Link(
        name=f"{name}_body",
        object_from_link=_at([0.0, 0.0, -half_m]),  # the frame of a free-standing object is at the centre of its base
        boxes=(),
        pieces=(ConvexPiece(name="hull", vertices_link=points + np.array([0.0, 0.0, half_m])),),
        visual=panel_mesh(np.array([0.056, 0.056, height_m]), np.array([0.0, 0.0, half_m]), seed=3),
        colour=(0.2, 0.5, 0.3),
        inertial=_slab_inertial(size, np.array([0.0, 0.0, half_m]), density=900.0),
    )
    pose = _at([x, -0.1, bottom_z + half_m])
    return replace(_object(name, "bottle", size, pose, (body,), ()), movable=True, fixture="object")


def carcass(name: str, size: np.ndarray, gap_m: float) -> Link:
    """Five panels behind the front."""
    w, d, h = size
    depth = d - FRONT_M - gap_m
    y = d / 2 - depth / 2
    panels = {
        "left": ([WALL_M, depth, h], [-w / 2 + WALL_M / 2, y, 0.0]),
        "right": ([WALL_M, depth, h], [w / 2 - WALL_M / 2, y, 0.0]),
        "bottom": ([w - 2 * WALL_M, depth, WALL_M], [0.0, y, -h / 2 + WALL_M / 2]),
        "top": ([w - 2 * WALL_M, depth, WALL_M], [0.0, y, h / 2 - WALL_M / 2]),
        "back": ([w - 2 * WALL_M, WALL_M, h - 2 * WALL_M], [0.0, d / 2 - WALL_M / 2, 0.0]),
    }
    return Link(
        name=f"{name}_base",
        object_from_link=Rigid3(),
        boxes=tuple(Box(name=n, role="carcass", size_m=np.array(s), link_from_box=_at(c)) for n, (s, c) in panels.items()),
        pieces=(),
        visual=None,
        colour=(0.9, 0.88, 0.84),
        inertial=_slab_inertial(size, np.zeros(3), density=90.0),
    )


def panel_mesh(size: np.ndarray, centre: np.ndarray, *, seed: int) -> TexturedMesh:
    """A textured box: wood-like stripes, a uv square on every face."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [[0, 4, 5, 1], [6, 2, 3, 7], [2, 0, 1, 3], [4, 6, 7, 5], [1, 5, 7, 3], [2, 6, 4, 0]]
    vertices = np.concatenate([corners[quad] for quad in quads]) * size + centre
    faces = np.concatenate([[[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]] for q in range(6)])
    uv = np.tile([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (6, 1))
    return TexturedMesh(vertices=vertices, faces=faces, uv=uv, texture=_wood(seed))


def _both(first: TexturedMesh, second: TexturedMesh) -> TexturedMesh:
    """Two meshes with the first's texture."""
    return TexturedMesh(
        vertices=np.concatenate([first.vertices, second.vertices]),
        faces=np.concatenate([first.faces, second.faces + len(first.vertices)]),
        uv=np.concatenate([first.uv, second.uv]),
        texture=first.texture,
    )


def capture(*, images: object | None = None) -> Capture:
    """Two frames in front of the kitchen; the world is the capture turned by 30 degrees and raised."""
    camera = Intrinsics(fx=300.0, fy=300.0, cx=160.0, cy=120.0, width=320, height=240)
    looking = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # camera +Z along world +Y
    frames = tuple(
        Frame(
            index=index,
            timestamp_s=0.1 * index,
            rgb_camera=camera,
            depth_camera=camera,
            world_from_camera=Rigid3(looking, np.array([0.2 * index, -2.4, 0.9])),
            sharpness=1.0,
        )
        for index in (0, 7)
    )
    return Capture(
        name="hand made",
        sha256="0" * 64,
        format="record3d",
        frames=frames,
        world_from_capture=Rigid3(rotation_about_z(np.pi / 6), np.array([0.0, 0.0, 1.2])),
        room=Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=()),
        surface=SceneSurface(
            vertices_world=np.zeros((0, 3)), faces=np.zeros((0, 3), np.int64), colours=np.zeros((0, 3), np.uint8), voxel_m=0.01
        ),
        images=images if images is not None else GreyImages(),  # type: ignore[arg-type]
        notices=(),
    )


class GreyImages:
    """Images of a capture with uniformly grey pictures."""

    def rgb(self, frame_index: int) -> np.ndarray:
        return np.full((240, 320, 3), 128, np.uint8)

    def depth(self, frame_index: int) -> Depth:
        return Depth(metres=np.zeros((240, 320), np.float32), valid=np.zeros((240, 320), dtype=bool))


def _object(
    name: str, category: str, size: np.ndarray, pose: Rigid3, links: tuple[Link, ...], joints: tuple[Joint, ...]
) -> SceneObject:
    return SceneObject(
        name=name,
        category=category,
        fixture=category,
        dimensions_m=size,
        dimension_sources=("measured", "inferred", "measured"),
        world_from_object=pose,
        links=links,
        joints=joints,
        movable=False,
        warp_residual_m=0.002,
        warnings=(),
    )


def _slab_inertial(size: np.ndarray, com: np.ndarray, *, density: float = 680.0) -> Inertial:
    mass = float(density * np.prod(size))
    squares = size**2
    return Inertial(mass_kg=mass, com_link=com, inertia=np.diag(mass / 12 * (squares.sum() - squares)))


def _at(position: object) -> Rigid3:
    return Rigid3(np.eye(3), np.array(position, dtype=np.float64))


def _wood(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    base = np.array([[150, 110, 70], [176, 140, 100], [60, 120, 70]][seed - 1], dtype=np.float64)
    grain = cv2.GaussianBlur(rng.normal(0, 60, (64, 64)), (0, 0), sigmaX=0.8, sigmaY=12)
    return np.clip(base + grain[..., None], 0, 255).astype(np.uint8)


def _prompt(item: SceneObject) -> ObjectPrompt:
    return ObjectPrompt(name=item.name, category=item.category, points=(PromptPoint(frame=0, x=160.5, y=120.5, label=1),))


def _track(item: SceneObject) -> MaskTrack:
    mask = np.zeros((240, 320), dtype=bool)
    mask[100:140, 120:180] = True
    return MaskTrack(
        name=item.name,
        category=item.category,
        masks={0: pack_mask(mask), 7: pack_mask(mask)},
        confidence={0: 0.9, 7: 0.8},
        front=None,
        box=None,
        kind="front",
        backend="geometric",
        prompt_count=1,
        warnings=(),
    )


def _candidates(name: str) -> CandidateSet:
    candidate = MeshAsset(
        object_name=name,
        candidate_id="c0",
        mesh=panel_mesh(np.ones(3), np.zeros(3), seed=1),
        generator="completion",
        seed=0,
        watertight=True,
        frames=(0, 7),
        metrics={"iou": 0.91},
        parameters={},
        warnings=(),
    )
    return CandidateSet(
        object_name=name, candidates=(candidate,), chosen_id="c0", chosen_by="consensus", reason="the only one", ranking=("c0",)
    )


def _placement(item: SceneObject) -> Placement:
    return Placement(
        object_name=item.name,
        candidate_id="c0",
        world_from_mesh=Similarity3(0.7, item.world_from_object.rotation, item.world_from_object.translation),
        matches=120,
        inliers=80,
        votes={0: 80},
        rms_m=0.004,
        mask_iou=0.9,
        condition=30.0,
        unsure=False,
        runner_up=0.4,
        method="sift",
        warnings=(),
    )
