"""A tiny finished workspace: one drawer, two candidates, one placement, one scene."""

from pathlib import Path

import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.transforms import Rigid3, Similarity3
from r2c2r_core.model.capture import Capture, Frame, Room, SceneSurface
from r2c2r_core.model.mesh import CandidateSet, MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement, Spread
from r2c2r_core.model.scene import ArticulatedScene, Box, Inertial, Joint, Link, SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.workspace import Workspace
from tests.app.fakes.ingest import write_recording

BOX = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
FACES = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])


def finish(work: Path, name: str = "drawer_1") -> None:
    """Store every stage's nouns for one drawer, as a run would."""
    space = Workspace(work)
    write_recording(work, work.parent, "scan.r3d")
    for stage, at, noun in (
        ("ingest", "scene", capture()),
        ("segment", name, track(name)),
        ("generate", name, candidates(name)),
        ("align", name, placement(name)),
        ("warp", "scene", scene(name)),
    ):
        space.save(stage, at, noun, {"key": "k", "seconds": 1.0})


def capture() -> Capture:
    camera = Intrinsics(fx=150, fy=150, cx=80, cy=60, width=160, height=120)
    frames = tuple(
        Frame(
            index=i,
            timestamp_s=i / 10,
            rgb_camera=camera,
            depth_camera=camera.resized(40, 30),
            world_from_camera=Rigid3(),
            sharpness=1.0,
        )
        for i in (0, 3, 7)
    )
    grid = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    surface = SceneSurface(
        vertices_world=grid, faces=np.zeros((0, 3), int), colours=np.full((500, 3), 200, np.uint8), voxel_m=0.01
    )
    room = Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=())
    return Capture(
        name="scan",
        sha256="ab" * 32,
        format="fake",
        frames=frames,
        world_from_capture=Rigid3(),
        room=room,
        surface=surface,
        images=None,  # type: ignore[arg-type]  # attached when loaded
        notices=(),
    )


def track(name: str) -> MaskTrack:
    mask = np.zeros((120, 160), bool)
    mask[40:80, 60:100] = True
    packed = pack_mask(mask)
    return MaskTrack(
        name=name,
        category="drawer",
        masks={3: packed, 7: packed},
        confidence={3: 0.9, 7: 0.4},
        front=None,
        box=None,
        kind="front",
        backend="geometric",
        prompt_count=1,
        warnings=(),
    )


def mesh() -> TexturedMesh:
    texture = np.zeros((4, 4, 3), np.uint8)
    texture[..., 0] = 250
    return TexturedMesh(vertices=BOX, faces=FACES, uv=np.full((8, 2), 0.5), texture=texture)


def asset(name: str, candidate: str) -> MeshAsset:
    return MeshAsset(
        object_name=name,
        candidate_id=candidate,
        mesh=mesh(),
        generator="fake",
        seed=0,
        watertight=True,
        frames=(3, 7),
        metrics={"volume": 1.0, "odd": float("nan"), "extent_middle": 0.8, "extent_short": 0.5, "volume_ratio": 0.9},
        parameters={},
        warnings=(),
        assumes="0.58 m deep, to the wall behind it",
    )


def candidates(name: str) -> CandidateSet:
    return CandidateSet(
        object_name=name,
        candidates=(asset(name, "c0"), asset(name, "c1")),
        chosen_id="c0",
        chosen_by="consensus",
        reason="closest to the others",
        ranking=("c0", "c1"),
    )


def placement(name: str) -> Placement:
    return Placement(
        object_name=name,
        candidate_id="c0",
        world_from_mesh=Similarity3(0.5, np.eye(3), np.array([0.0, 2.0, 0.5])),
        matches=50,
        inliers=30,
        votes={3: 12, 7: 18},
        rms_m=0.004,
        mask_iou=0.9,
        condition=float("inf"),
        unsure=False,
        runner_up=0.3,
        runner_up_turn_deg=180.0,
        spread=Spread(
            turn_deg=0.2, turn_axis_world=np.array([0.0, 0.0, 1.0]), shift_m=0.002, shift_axis_world=np.eye(3)[0], scale=0.004
        ),
        method="fake",
        warnings=(),
    )


def scene(name: str) -> ArticulatedScene:
    box = Box(name="front", role="front", size_m=np.array([0.5, 0.02, 0.2]), link_from_box=Rigid3())
    inertial = Inertial(mass_kg=1.0, com_link=np.zeros(3), inertia=np.eye(3))
    links = tuple(
        Link(
            name=f"{name}_{part}",
            object_from_link=Rigid3(),
            boxes=(box,),
            pieces=(),
            visual=mesh(),
            colour=(1, 1, 1),
            inertial=inertial,
        )
        for part in ("base", "front")
    )
    joint = Joint(
        name=f"{name}_slide",
        type="prismatic",
        parent=links[0].name,
        child=links[1].name,
        origin_object=np.zeros(3),
        axis_object=np.array([0.0, -1.0, 0.0]),
        lower=0.0,
        upper=0.4,
        effort=50.0,
        velocity=1.0,
        damping=1.0,
        friction=1.0,
        sources={"axis": "inferred", "origin": "inferred", "limits": "default"},
    )
    item = SceneObject(
        name=name,
        category="drawer",
        fixture="drawer",
        dimensions_m=np.array([0.5, 0.6, 0.2]),
        dimension_sources=("measured", "default", "measured"),
        world_from_object=Rigid3(),
        links=links,
        joints=(joint,),
        movable=False,
        warp_residual_m=0.001,
        warnings=("a warning",),
    )
    return ArticulatedScene(name="scan", objects=(item,), layout_moves_m={}, warnings=(), scale=1.0)
