import json
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.iou import mask_errors
from r2c2r_core.evaluate.stage import Evaluation, evaluate_bundle
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.truth import Sightings, capture_from_kitchen, true_objects, truth_document

WORLD_FROM_CAPTURE = Rigid3(rotation_about_z(0.7) @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0.3, -1.2, 1.5]))


def truth_of(seed: int) -> dict:
    kitchen = plan_kitchen(seed)
    objects = true_objects(kitchen)
    return truth_document(objects, capture_from_kitchen(kitchen, np.array([0.2, -2.0, 1.5])), Sightings(objects))


def bundle_of(truth: dict) -> dict:
    """Manifest of a bundle that is right in everything."""
    turn, entries = WORLD_FROM_CAPTURE, []
    for thing in truth["objects"]:
        pose = turn @ Rigid3.from_matrix(np.array(thing["capture_from_object"]))
        joints = [
            joint
            | {
                "axis": turn.turn(np.array([joint["axis"]]))[0].tolist(),
                "origin": turn.apply(np.array([joint["origin"]]))[0].tolist(),
                "source": {"axis": "inferred", "origin": "inferred", "limits": "default"},
            }
            for joint in thing["joints"]
        ]
        entries.append(
            {key: thing[key] for key in ("name", "category", "dimensions_m")}
            | {"world_from_object": pose.matrix.tolist(), "joint": joints[0] if joints else None, "joints": joints}
        )
    return {"schema": 1, "world_from_capture": turn.matrix.tolist(), "objects": entries}


def write(folder: Path, truth: dict, manifest: dict) -> tuple[Path, Path]:
    bundle = folder / "bundle"
    bundle.mkdir(exist_ok=True)
    (bundle / "manifest.json").write_text(json.dumps(manifest))
    (folder / "truth.json").write_text(json.dumps(truth))
    return bundle, folder / "truth.json"


def scene(evaluation: Evaluation) -> dict[str, float | None]:
    return {metric.name: metric.value for metric in evaluation.scene}


def row(evaluation: Evaluation, name: str) -> dict[str, float | None]:
    return {metric.name: metric.value for r in evaluation.rows if r.name == name for metric in r.metrics}


@pytest.mark.parametrize("seed", range(4))
def test_a_bundle_built_from_ground_truth_has_no_error(tmp_path: Path, seed: int) -> None:
    truth = truth_of(seed)
    values = scene(evaluate_bundle(*write(tmp_path, truth, bundle_of(truth))))
    for name in ("objects_found", "joint_type", "hinge_side", "range_ratio", "box_iou"):
        assert values[name] == pytest.approx(1.0), name
    for name in ("extents", "centre", "front_centre", "yaw", "axis", "pivot", "limit_revolute", "limit_prismatic"):
        assert values[name] == pytest.approx(0.0, abs=1e-5), name


def test_each_metric_returns_the_size_of_a_known_perturbation(tmp_path: Path) -> None:
    truth = truth_of(0)
    manifest = bundle_of(truth)
    fridge = next(entry for entry in manifest["objects"] if entry["name"] == "refrigerator")
    pose = Rigid3.from_matrix(np.array(fridge["world_from_object"]))
    turned = Rigid3(rotation_about_z(np.radians(3.0)) @ pose.rotation, pose.translation + np.array([0.03, 0.0, 0.04]))
    fridge["world_from_object"] = turned.matrix.tolist()
    width, depth, height = fridge["dimensions_m"]
    fridge["dimensions_m"] = [width * 1.1, depth, height * 0.8]
    joint = fridge["joints"][0]
    joint["origin"] = (np.array(joint["origin"]) + np.array([0.0, 0.02, 0.5])).tolist()  # a shift along the axis has no effect
    joint["upper"] += np.radians(10.0)
    values = row(evaluate_bundle(*write(tmp_path, truth, manifest)), "refrigerator")
    assert values["width_error"] == pytest.approx(10.0)
    assert values["depth_error"] == pytest.approx(0.0, abs=1e-9)
    assert values["height_error"] == pytest.approx(20.0)
    assert values["extents"] == pytest.approx(10.0)
    assert values["centre"] == pytest.approx(50.0)
    assert values["yaw"] == pytest.approx(3.0)
    assert values["pivot"] == pytest.approx(20.0)
    assert values["limit_revolute"] == pytest.approx(10.0)
    assert values["axis"] == pytest.approx(0.0, abs=1e-5)
    assert values["hinge_side"] == 1.0


def test_a_round_object_has_no_front_or_yaw_error(tmp_path: Path) -> None:
    truth = truth_of(0)
    manifest = bundle_of(truth)
    bottle = next(entry for entry in manifest["objects"] if entry["name"] == "bottle_1")
    pose = Rigid3.from_matrix(np.array(bottle["world_from_object"]))
    bottle["world_from_object"] = Rigid3(rotation_about_z(np.radians(40.0)) @ pose.rotation, pose.translation).matrix.tolist()
    values = row(evaluate_bundle(*write(tmp_path, truth, manifest)), "bottle_1")
    assert (values["front_centre"], values["yaw"]) == (None, None)
    assert values["centre"] == pytest.approx(0.0, abs=1e-5)


def test_wrong_hinge_sides_and_joint_types_score_zero(tmp_path: Path) -> None:
    truth = truth_of(0)
    manifest = bundle_of(truth)
    by_name = {entry["name"]: entry for entry in manifest["objects"]}
    door = by_name["cabinet_1"]
    pose = Rigid3.from_matrix(np.array(door["world_from_object"]))
    hinge = pose.inverse.apply(np.array([door["joints"][0]["origin"]]))[0]
    hinge[0] = -hinge[0]
    door["joints"][0]["origin"] = pose.apply(hinge).tolist()
    door["joints"][0]["axis"] = (-np.array(door["joints"][0]["axis"])).tolist()
    by_name["drawer_1"]["joints"][0]["type"] = "revolute"
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    assert row(evaluation, "cabinet_1")["hinge_side"] == 0.0
    assert row(evaluation, "cabinet_1")["joint_type"] == 1.0
    assert row(evaluation, "drawer_1")["joint_type"] == 0.0
    assert row(evaluation, "drawer_1")["range_ratio"] == 0.0


def test_renamed_objects_are_matched_by_box_and_extra_ones_are_listed(tmp_path: Path) -> None:
    truth = truth_of(1)
    manifest = bundle_of(truth)
    for position, entry in enumerate(manifest["objects"]):
        entry["name"] = f"thing_{position}"
    stranger = dict(manifest["objects"][0], name="stranger")
    stranger["world_from_object"] = Rigid3(np.eye(3), np.array([50.0, 0.0, 0.0])).matrix.tolist()
    manifest["objects"] = [stranger, *manifest["objects"][::-1]]
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    assert [r.matched for r in evaluation.rows] == [f"thing_{i}" for i in range(len(truth["objects"]))]
    assert evaluation.surplus == ("stranger",)


def test_a_missing_object_is_counted_and_reported(tmp_path: Path) -> None:
    truth = truth_of(0)
    manifest = bundle_of(truth)
    gone = manifest["objects"].pop()["name"]
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    assert scene(evaluation)["objects_found"] == pytest.approx(1 - 1 / len(truth["objects"]))
    assert f"not in the bundle: {gone}" in evaluation.to_text()


def test_mask_iou_is_the_mean_over_frames_that_show_enough_of_the_object(tmp_path: Path) -> None:
    truth = truth_of(0)
    bundle, truth_file = write(tmp_path, truth, bundle_of(truth))
    true_masks, found = tmp_path / "truth_masks" / "drawer_1", tmp_path / "masks" / "drawer_1"
    true_masks.mkdir(parents=True)
    found.mkdir(parents=True)
    for frame, (area, guess) in enumerate(((40, 20), (40, 40), (40, None), (10, 0))):  # squares; 10 x 10 is below 400 px
        cv2.imwrite(str(true_masks / f"{frame:06d}.png"), square(area))
        if guess is not None:
            cv2.imwrite(str(found / f"{frame:06d}.png"), square(guess))
    values = row(evaluate_bundle(bundle, truth_file, masks=tmp_path / "masks"), "drawer_1")
    assert values["mask_iou"] == pytest.approx((0.25 + 1.0 + 0.0) / 3)
    assert values["mask_frames"] == pytest.approx(2 / 3)


def test_a_zip_gives_the_same_numbers_as_the_folder(tmp_path: Path) -> None:
    truth = truth_of(0)
    bundle, truth_file = write(tmp_path, truth, bundle_of(truth))
    with zipfile.ZipFile(tmp_path / "bundle.zip", "w") as packed:
        packed.write(bundle / "manifest.json", "manifest.json")
    assert evaluate_bundle(tmp_path / "bundle.zip", truth_file).to_json() == evaluate_bundle(bundle, truth_file).to_json()


@pytest.mark.parametrize(
    ("content", "found"),
    [(b"not a zip", "not a zip"), (None, "no manifest.json")],
)
def test_unreadable_bundles_raise_a_clear_error(tmp_path: Path, content: bytes | None, found: str) -> None:
    _, truth_file = write(tmp_path, truth_of(0), {})
    path = tmp_path / "bad.zip"
    if content is None:
        with zipfile.ZipFile(path, "w") as packed:
            packed.writestr("readme.txt", "nothing here")
    else:
        path.write_bytes(content)
    with pytest.raises(BundleError, match=found):
        evaluate_bundle(path, truth_file)


def test_unreadable_ground_truth_raises_a_clear_error(tmp_path: Path) -> None:
    truth = truth_of(0)
    bundle, truth_file = write(tmp_path, truth, bundle_of(truth))
    truth_file.write_text("{")
    with pytest.raises(BundleError, match="not usable JSON"):
        evaluate_bundle(bundle, truth_file)
    truth_file.write_text(json.dumps({"objects": [{"name": "a", "category": "b", "dimensions_m": [1, 2]}]}))
    with pytest.raises(BundleError, match="three numbers"):
        evaluate_bundle(bundle, truth_file)


def square(side: int) -> np.ndarray:
    mask = np.zeros((60, 80), np.uint8)
    mask[:side, :side] = 255
    return mask


def test_scan_fit_metrics_are_read_from_the_bundle(tmp_path: Path) -> None:
    truth = truth_of(1)
    manifest = bundle_of(truth)
    fit = {"median_m": 0.0042, "p95_m": 0.011, "f_score_1cm": 0.93, "f_score_2cm": 0.99, "points": 6000}
    manifest["objects"][0]["scan_fit"] = fit
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    first = row(evaluation, truth["objects"][0]["name"])
    assert first["scan_to_mesh_median"] == pytest.approx(4.2)
    assert first["scan_to_mesh_p95"] == pytest.approx(11.0)
    assert (first["f_score_1cm"], first["f_score_2cm"]) == (0.93, 0.99)
    assert row(evaluation, truth["objects"][1]["name"])["f_score_1cm"] is None  # without a value, so not scored
    assert scene(evaluation)["f_score_1cm"] == 0.93


def test_masks_of_open_frames_are_scored_separately(tmp_path: Path) -> None:
    true, found = tmp_path / "true", tmp_path / "found"
    whole, half = np.full((40, 40), 255, np.uint8), np.zeros((40, 40), np.uint8)
    half[:20] = 255
    for folder in (true, found):
        folder.mkdir()
        cv2.imwrite(str(folder / "000001.png"), whole)
    cv2.imwrite(str(true / "000002.png"), whole)
    cv2.imwrite(str(found / "000002.png"), half)
    values = {metric.name: metric.value for metric in mask_errors(true, found, frozenset({2}))}
    assert (values["mask_iou"], values["mask_iou_open"]) == (pytest.approx(0.75), pytest.approx(0.5))
    assert {metric.name: metric.value for metric in mask_errors(true, found)}["mask_iou_open"] is None
