"""A small dataset, written, read as by another program, and evaluated."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
import trimesh

from r2c2r_core import cli
from r2c2r_core.dataset.coco import run_lengths
from r2c2r_core.dataset.stage import LabelledObject, StoredFrames, write_dataset
from r2c2r_core.errors import BundleError, InputError
from r2c2r_core.evaluate.dataset import evaluate_dataset, is_dataset
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Similarity3, rotation_about_z
from r2c2r_core.ingest.store import write_depth, write_rgb
from r2c2r_core.model.mesh import CandidateSet, MeshAsset, TexturedMesh
from r2c2r_core.model.placement import MatchedPoints, Placement, Spread
from r2c2r_core.workspace import Workspace
from tests.core.generate import scenes

SIDES = np.array([0.46, 0.34, 0.28])  # of the microwave in the scene, whose handle the mesh lacks
CENTRE = np.array([0.0, 0.17, 1.04])
POSE = Similarity3(0.46, rotation_about_z(0.0), CENTRE)  # of a mesh whose longest side is 1


def asset(candidate_id="c0"):
    vertices, faces = box_mesh(-SIDES / 0.92, SIDES / 0.92)
    picture = np.full((8, 8, 3), 90, np.uint8)
    return MeshAsset(
        object_name="microwave_1",
        candidate_id=candidate_id,
        mesh=TexturedMesh(vertices=vertices, faces=faces, uv=np.full((len(vertices), 2), 0.5), texture=picture),
        generator="test",
        seed=0,
        watertight=True,
        frames=(0, 3),
        metrics={"mask_iou": 0.9, "odd": float("nan")},
        parameters={},
        warnings=("looked at",),
    )


def placement(pose=POSE, candidate_id="c0"):
    pairs = np.arange(12, dtype=float).reshape(4, 3)
    return Placement(
        object_name="microwave_1",
        candidate_id=candidate_id,
        world_from_mesh=pose,
        matches=4,
        inliers=3,
        votes={0: 3},
        rms_m=0.004,
        mask_iou=0.95,
        condition=100.0,
        unsure=False,
        runner_up=0.9,
        runner_up_turn_deg=180.0,
        method="test",
        warnings=(),
        spread=Spread(
            turn_deg=0.4,
            turn_axis_world=np.array([0.0, 0.0, 1.0]),
            shift_m=0.003,
            shift_axis_world=np.array([1.0, 0.0, 0.0]),
            scale=0.006,
        ),
        matched=MatchedPoints(
            frame_index=np.array([0, 0, 3, 3]),
            points_mesh=pairs,
            points_world=pose.apply(pairs),
            noise_m=np.full(4, 0.005),
            inlier=np.array([True, True, True, False]),
        ),
    )


@pytest.fixture(scope="module")
def scene():
    return scenes.appliance_scene()


@pytest.fixture
def stored(scene, tmp_path):
    capture, _ = scene
    folder = tmp_path / "store"
    folder.mkdir()
    for frame in capture.frames:
        cv2.imwrite(str(folder / f"{frame.index}.jpg"), capture.images.rgb(frame.index)[..., ::-1])
        depth = (capture.images.depth(frame.index).metres * 4000).astype(np.uint16)
        cv2.imwrite(str(folder / f"{frame.index}.png"), depth)
    return StoredFrames(lambda index: folder / f"{index}.jpg", lambda index: folder / f"{index}.png")


def written(scene, stored, folder, *, pose=POSE, placed="c0"):
    capture, track = scene
    found = CandidateSet(
        object_name=track.name,
        candidates=(asset(), asset("c1")),
        chosen_id="c0",
        chosen_by="consensus",
        reason="c0 is fine",
        ranking=("c0", "c1"),
    )
    objects = [
        LabelledObject(track, found, placement(pose, placed)),
        LabelledObject(replace(track, name="lost_1", category="bottle"), None, None),
    ]
    write_dataset(capture, objects, stored, folder)
    return folder


@pytest.fixture
def truth(scene, tmp_path):
    """truth.json in the capture frame (here the world), with the true masks in the same folder."""
    _, track = scene
    pose = np.eye(4)
    pose[:3, 3] = CENTRE
    entry = {
        "name": "microwave_1",
        "category": "microwave",
        "dimensions_m": SIDES.tolist(),
        "capture_from_object": pose.tolist(),
        "joints": [],
        "observed_axes": [True, True, True],
    }
    folder = tmp_path / "truth"
    (folder / "truth_masks" / "microwave_1").mkdir(parents=True)
    (folder / "truth.json").write_text(json.dumps({"version": 1, "objects": [entry]}))
    for index, packed in track.masks.items():
        cv2.imwrite(
            str(folder / "truth_masks" / "microwave_1" / f"{index:06d}.png"), unpack_mask(packed).astype(np.uint8) * 255
        )
    return folder / "truth.json"


def values(evaluation, name="microwave_1"):
    return {metric.name: metric.value for row in evaluation.rows if row.name == name for metric in row.metrics}


def test_the_dataset_folder_contains_the_documented_files(scene, stored, tmp_path):
    capture, track = scene
    folder = written(scene, stored, tmp_path / "set")
    manifest = json.loads((folder / "manifest.json").read_text())
    others = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} - {"manifest.json"}
    assert set(manifest["files"]) == others
    assert manifest["objects"] == ["microwave_1", "lost_1"]
    mask = cv2.imread(str(folder / "objects/microwave_1/masks/000003.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(mask == 255, unpack_mask(track.masks[3]))
    assert (folder / "images/000003.jpg").read_bytes() == stored.colour(3).read_bytes()
    assert (folder / "depth/000003.png").read_bytes() == stored.depth(3).read_bytes()
    camera = json.loads((folder / "cameras.json").read_text())["frames"][1]
    assert camera["frame"] == 3
    assert np.allclose(camera["world_from_camera"], capture.frame(3).world_from_camera.matrix)
    entry = json.loads((folder / "objects/microwave_1/object.json").read_text())
    assert [c["candidate_id"] for c in entry["candidates"]] == ["c0", "c1"]
    assert entry["candidates"][0]["metrics"] == {"mask_iou": 0.9, "odd": None}  # JSON has no NaN
    assert np.allclose(entry["placement"]["world_from_mesh"], POSE.matrix)
    assert entry["placement"]["runner_up_turn_deg"] == 180.0
    spread = entry["placement"]["spread"]
    assert (spread["turn_deg"], spread["shift_m"], spread["scale"]) == (0.4, 0.003, 0.006)
    assert (spread["turn_axis_world"], spread["shift_axis_world"]) == ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    assert json.loads((folder / "objects/lost_1/object.json").read_text())["placement"] is None
    assert not (folder / "objects/lost_1/aligned.glb").exists()
    with np.load(folder / "objects/microwave_1/matches.npz", allow_pickle=False) as pairs:
        assert np.allclose(POSE.apply(pairs["points_mesh"]), pairs["points_world"])
        assert pairs["inlier"].tolist() == [True, True, True, False]


def test_meshes_are_written_in_object_frame_and_aligned_in_world(scene, stored, tmp_path):
    folder = written(scene, stored, tmp_path / "set")
    own = trimesh.load_scene(folder / "objects/microwave_1/candidates/c1.glb").to_geometry()
    assert own.extents == pytest.approx(SIDES / 0.46, rel=1e-5)
    placed = trimesh.load_scene(folder / "objects/microwave_1/aligned.glb").to_geometry()
    assert placed.extents == pytest.approx(SIDES, rel=1e-5)
    assert placed.bounds.mean(axis=0) == pytest.approx(CENTRE, abs=1e-5)


def test_coco_run_lengths_decode_to_the_masks(scene, stored, tmp_path):
    _, track = scene
    coco = json.loads((written(scene, stored, tmp_path / "set") / "annotations.json").read_text())
    assert {c["name"] for c in coco["categories"]} == {"microwave", "bottle"}
    assert len(coco["annotations"]) == 2 * len(track.masks)
    assert len({a["id"] for a in coco["annotations"]}) == len(coco["annotations"])
    for annotation in coco["annotations"]:
        segmentation = annotation["segmentation"]
        mask = decoded(segmentation["counts"], segmentation["size"])
        assert np.array_equal(mask, unpack_mask(track.masks[annotation["image_id"]]))
        assert annotation["area"] == mask.sum()
        left, top, width, height = annotation["bbox"]
        assert mask[top : top + height, left : left + width].sum() == mask.sum()


@pytest.mark.parametrize("mask", [np.ones((3, 4), bool), np.zeros((3, 4), bool), np.eye(5, dtype=bool)])
def test_run_lengths_of_extreme_masks_round_trip(mask):
    assert np.array_equal(decoded(run_lengths(mask), mask.shape), mask)


def decoded(counts, size):
    """Run lengths decoded by COCO's definition: runs of 0, 1, 0 … in column order."""
    flat = np.concatenate([np.full(n, k % 2, bool) for k, n in enumerate(counts)])
    return flat.reshape(size[1], size[0]).T


def test_a_correct_dataset_evaluates_without_error(scene, stored, tmp_path, truth):
    folder = written(scene, stored, tmp_path / "set")
    assert is_dataset(folder)
    found = values(evaluate_dataset(folder, truth))
    assert found["mask_iou"] == pytest.approx(1.0)
    assert found["extents"] == pytest.approx(0.0, abs=1.5)  # percent: the box leaves out half a percent at each end
    assert found["centre"] == pytest.approx(0.0, abs=1.0)
    assert found["yaw"] == pytest.approx(0.0, abs=0.2)
    assert found["box_iou"] > 0.97
    assert evaluate_dataset(folder, truth).surplus == ("lost_1",)


@pytest.mark.parametrize("quarter", [0, 1, 2, 3])
def test_a_position_error_is_measured_at_every_quarter_turn(scene, stored, tmp_path, truth, quarter):
    """A mesh has no known front, so only the volume it occupies is compared."""
    turned = rotation_about_z(quarter * np.pi / 2 + np.radians(4))
    pose = Similarity3(0.46, turned, CENTRE + np.array([0.05, 0.0, 0.0]))
    found = values(evaluate_dataset(written(scene, stored, tmp_path / "set", pose=pose), truth))
    assert found["centre"] == pytest.approx(50.0, abs=1.5)
    if quarter in (0, 2):
        assert found["yaw"] == pytest.approx(4.0, abs=0.3)
        assert found["extents"] == pytest.approx(0.0, abs=1.5)
    else:
        assert found["extents"] > 10  # its long side is along the wrong axis


def test_a_damaged_or_missing_file_is_reported_by_name(scene, stored, tmp_path, truth):
    folder = written(scene, stored, tmp_path / "set")
    path = folder / "objects/microwave_1/aligned.glb"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(BundleError, match=r"aligned\.glb: its checksum differs"):
        evaluate_dataset(folder, truth)
    path.unlink()
    with pytest.raises(BundleError, match=r"aligned\.glb: missing"):
        evaluate_dataset(folder, truth)


def test_a_placement_of_a_missing_candidate_is_omitted(scene, stored, tmp_path):
    folder = written(scene, stored, tmp_path / "set", placed="c7")
    assert not (folder / "objects/microwave_1/aligned.glb").exists()
    assert json.loads((folder / "objects/microwave_1/object.json").read_text())["placement"] is None


def test_nothing_is_overwritten_and_no_partial_files_remain(scene, stored, tmp_path):
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "mine.txt").write_text("keep")
    with pytest.raises(InputError, match="not an empty folder"):
        written(scene, stored, tmp_path / "set")
    broken = StoredFrames(stored.colour, lambda index: tmp_path / "absent.png")
    with pytest.raises(OSError, match="absent"):
        written(scene, broken, tmp_path / "other")
    assert sorted(p.name for p in tmp_path.iterdir() if "other" in p.name) == []


def test_the_commands_write_and_evaluate_the_dataset_of_a_work_folder(scene, tmp_path, truth, capsys):
    capture, track = scene
    work = Workspace(tmp_path / "work")
    for folder in ("rgb", "depth"):
        (work.frames / folder).mkdir(parents=True)
    for frame in capture.frames:
        jpeg = cv2.imencode(".jpg", capture.images.rgb(frame.index)[..., ::-1])[1].tobytes()
        write_rgb(work.frames, frame.index, jpeg)
        write_depth(work.frames, frame.index, capture.images.depth(frame.index).metres)
    candidates = CandidateSet(
        object_name=track.name, candidates=(asset(),), chosen_id="c0", chosen_by="consensus", reason="", ranking=("c0",)
    )
    nouns = {"ingest/scene": capture, f"segment/{track.name}": track}
    nouns |= {f"generate/{track.name}": candidates, f"align/{track.name}": placement()}
    for place, noun in nouns.items():
        work.save(*place.split("/"), noun, {"key": "", "seconds": 0.0})
    assert cli.main(["dataset", str(work.root), "-o", str(tmp_path / "set")]) == 0
    assert "1 objects, 1 of them placed" in capsys.readouterr().out
    depth = cv2.imread(str(tmp_path / "set/depth/000003.png"), cv2.IMREAD_UNCHANGED)
    assert depth.dtype == np.uint16
    assert np.abs(depth * 0.25e-3 - capture.images.depth(3).metres).max() < 0.13e-3  # half a step
    assert cli.main(["evaluate", str(tmp_path / "set"), "--truth", str(truth), "--json", str(tmp_path / "e.json")]) == 0
    said = json.loads((tmp_path / "e.json").read_text())
    assert said["scene"]["objects_found"]["value"] == 1.0
    assert said["scene"]["mask_iou"]["value"] == pytest.approx(1.0)


def test_the_command_rejects_a_folder_that_is_not_a_work_folder(tmp_path, capsys):
    assert cli.main(["dataset", str(tmp_path), "-o", str(tmp_path / "set")]) == 2
    assert "not a work folder" in capsys.readouterr().err
