"""Simulated worlds for measurements, and the computation of their figures; `benchmarks/unseen.py` uses them."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from r2c2r_core.evaluate.records import read_truth
from r2c2r_core.geometry.camera import depth_points, unproject
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import open_files
from r2c2r_core.ingest.readers.record3d import open_record3d
from r2c2r_core.synthetic.truth import TrueObject

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
SIZE_M = np.array([0.5, 0.6, 0.7])


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cabinet hinged on its left before a wall, in two frames."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    from worlds import Surface, World, joint_of, record, room  # type: ignore[import-not-found]

    pose = Rigid3(np.eye(3), np.array([0.0, -0.3, 0.35]))
    vertices, faces = box_mesh(-SIZE_M / 2, SIZE_M / 2)
    hinge = joint_of("cabinet_0", "revolute", np.array([0.0, 0.0, 1.0]), np.array([-0.25, -0.6, 0.35]), (-1.6, 0.0), pose)
    thing = TrueObject(
        name="cabinet_0", category="cabinet", dimensions_m=SIZE_M, kitchen_from_object=pose, joints=(hinge,), is_round=False
    )
    box = Surface(vertices=pose.apply(vertices), faces=faces, colour=np.full(3, 0.5), thing=0)
    world = World(
        surfaces=(box, *room((-2, -3, 0), (2, 0, 2.5), (0.6, 0.6, 0.6), (0.3, 0.3, 0.3))),
        things=(thing,),
        eyes=np.array([[0.9, -2.0, 1.3], [1.0, -2.0, 1.3], [1.1, -2.0, 1.3]]),
        targets=np.array([[0.0, -0.4, 0.4], [0.05, -0.4, 0.4], [0.0, -0.4, 0.4]]),
        lights=np.array([[0.5, -1.5, 2.3]]),
    )
    record(world, tmp_path / "drawn", frames=2, size=(320, 240), seed=4)
    return tmp_path / "drawn"


def test_depth_and_ground_truth_share_one_frame(drawn: Path) -> None:
    recording = open_record3d(open_files(drawn / "scan.r3d"))
    (thing,) = read_truth(drawn / "truth.json", Rigid3())
    for frame in recording.frames:
        assert frame.capture_from_camera is not None
        depth = recording.depth_of(frame)
        mask = cv2.imread(str(drawn / "masks" / f"{frame.index:06d}.png"), cv2.IMREAD_UNCHANGED)
        size = (frame.depth_camera.width, frame.depth_camera.height)
        mine = cv2.erode(cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST), np.ones((7, 7))) > 0
        points = depth_points(np.nan_to_num(depth.metres).astype(np.float64), frame.depth_camera)[
            mine & (depth.confidence == 2)
        ]
        assert len(points) > 1000
        local = thing.world_from_object.inverse.apply(frame.capture_from_camera.apply(points))
        outside = (np.abs(local) - thing.dimensions_m / 2).max(axis=1)  # on the surface of its box: 0
        assert np.median(np.abs(outside)) < 0.01


def test_the_true_hinge_opens_the_door_towards_positive_values(drawn: Path) -> None:
    (thing,) = read_truth(drawn / "truth.json", Rigid3())
    (joint,) = thing.joints
    free_edge = thing.world_from_object.apply(np.array([SIZE_M[0] / 2, -SIZE_M[1] / 2, 0.0]))
    outward = thing.world_from_object.turn(np.array([0.0, -1.0, 0.0]))
    assert np.cross(joint.axis, free_edge - joint.origin) @ outward > 0
    assert (joint.lower, joint.upper) == (0.0, 1.6)


def test_random_clicks_are_on_the_front_away_from_its_border(drawn: Path) -> None:
    from recordings import random_clicks, true_masks  # type: ignore[import-not-found]

    recording = open_record3d(open_files(drawn / "scan.r3d"))
    (thing,) = read_truth(drawn / "truth.json", Rigid3())
    seen = set()
    for seed in range(25):
        (prompt,) = random_clicks(drawn, np.random.default_rng(seed)).objects
        (point,) = prompt.points
        frame = recording.frames[point.frame]
        assert frame.capture_from_camera is not None
        mask = true_masks(drawn)(prompt.name, point.frame)
        assert mask is not None
        assert cv2.erode(mask.astype(np.uint8), np.ones((5, 5)))[int(point.y), int(point.x)]
        from_camera = thing.world_from_object.inverse @ frame.capture_from_camera
        ray = from_camera.turn(unproject(np.array([[point.x, point.y]]), np.ones(1), frame.rgb_camera))[0]
        at = from_camera.translation + ray * (-SIZE_M[1] / 2 - from_camera.translation[1]) / ray[1]
        assert (np.abs(at[[0, 2]]) < SIZE_M[[0, 2]] / 2).all()
        seen.add((point.frame, point.x, point.y))
    assert len(seen) > 20


def test_missing_objects_count_as_errors_in_every_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from unseen import row_of  # type: ignore[import-not-found]

    good = {name: 1.0 for name in ("width_error", "depth_error", "height_error", "joint_type", "hinge_side", "box_iou")}
    evaluation = {
        "objects": [_found("cabinet_0", good), _found("bottle_0", good | {"height_error": 7.0}), _found("cabinet_1", {})]
    }
    truth = [_true("cabinet_0", "cabinet"), _true("bottle_0", "bottle"), _true("cabinet_1", "cabinet")]
    outcome: Any = SimpleNamespace(
        evaluation=evaluation,
        certified=True,
        doubted={"bottle_0"},
        present={"cabinet_0", "bottle_0"},
        cost=SimpleNamespace(cpu_s=60.0, wall_s=45.0),
    )
    row = row_of(outcome, truth, {"cabinet_0": 0.9, "bottle_0": 0.8, "cabinet_1": 0.0})
    assert (row["objects"], row["usable"]) == (3, 1)
    assert (row["median_percent"], row["worst_percent"]) == (7.0, 100.0)
    assert row["joints_right"] == "1 of 2"  # over objects with joints
    assert row["mask_iou"] == {"front": 0.45, "thing": 0.8}
    assert row["worst_height_percent"] == {"bottle": 7.0}
    assert row["far_off"] == ["cabinet_1"]
    assert (row["wrong_flagged"], row["right_flagged"]) == ("2 of 2", "0 of 1")  # missing objects count as flagged
    assert json.dumps(row)


def _found(name: str, values: dict[str, float]) -> dict[str, Any]:
    return {
        "name": name,
        "matched": name if values else None,
        "metrics": {key: {"value": value} for key, value in values.items()},
    }


def _true(name: str, category: str) -> dict[str, Any]:
    return {"name": name, "category": category, "joint": None if category == "bottle" else {"type": "revolute"}}
