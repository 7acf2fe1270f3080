import json
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.synthetic.stage import SamplePaths, write_sample

FRAMES, SIZE = 10, (480, 360)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    return write_sample(tmp_path_factory.mktemp("sample"), seed=0, frames=FRAMES, size=SIZE)


@pytest.fixture(scope="module")
def upright(tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    return write_sample(tmp_path_factory.mktemp("upright"), seed=1, frames=2, size=(180, 240))


def metadata_of(sample: SamplePaths) -> dict:
    with zipfile.ZipFile(sample.scan) as scan:
        return json.loads(scan.read("metadata"))


def depth_of(sample: SamplePaths, frame: int) -> tuple[np.ndarray, np.ndarray]:
    import lzfse

    size = metadata_of(sample)
    shape = (size["dh"], size["dw"])
    with zipfile.ZipFile(sample.scan) as scan:
        depth = np.frombuffer(lzfse.decompress(scan.read(f"rgbd/{frame}.depth")), "<f4").reshape(shape)
        confidence = np.frombuffer(lzfse.decompress(scan.read(f"rgbd/{frame}.conf")), np.uint8).reshape(shape)
    return depth, confidence


@pytest.mark.parametrize(("which", "rgb", "lidar"), [("sample", SIZE, (256, 192)), ("upright", (180, 240), (192, 256))])
def test_r3d_members_decode_to_the_sizes_in_the_metadata(
    which: str, rgb: tuple[int, int], lidar: tuple[int, int], request: pytest.FixtureRequest
) -> None:
    paths: SamplePaths = request.getfixturevalue(which)
    metadata = metadata_of(paths)
    assert (metadata["w"], metadata["h"]) == rgb
    assert (metadata["dw"], metadata["dh"]) == lidar
    count = len(metadata["poses"])
    assert len(metadata["frameTimestamps"]) == len(metadata["perFrameIntrinsicCoeffs"]) == count
    with zipfile.ZipFile(paths.scan) as scan:
        assert scan.testzip() is None
        assert {"metadata", "icon"} <= set(scan.namelist())
        for frame in range(count):
            image = cv2.imdecode(np.frombuffer(scan.read(f"rgbd/{frame}.jpg"), np.uint8), cv2.IMREAD_COLOR)
            assert image.shape == (rgb[1], rgb[0], 3)
            depth, confidence = depth_of(paths, frame)
            assert 0.3 < np.nanmedian(depth) < 5.0
            assert set(np.unique(confidence)) <= {0, 1, 2}
            assert (confidence[np.isnan(depth)] == 0).all()


def test_confident_depth_inside_a_true_mask_lies_on_the_objects_box(sample: SamplePaths) -> None:
    metadata, truth = metadata_of(sample), json.loads(sample.truth.read_text())
    step = SIZE[0] / metadata["dw"]
    off: dict[str, list[np.ndarray]] = {}
    for frame in range(FRAMES):
        depth, confidence = depth_of(sample, frame)
        fx, fy, cx, cy = np.array(metadata["perFrameIntrinsicCoeffs"][frame]) / step + [0, 0, 0.5 / step, 0.5 / step]
        pose = metadata["poses"][frame]
        rotation = Rotation.from_quat(pose[:4]).as_matrix() @ np.diag([1, -1, -1])
        v, u = np.mgrid[0 : metadata["dh"], 0 : metadata["dw"]] + 0.5
        points = np.stack([(u - cx) / fx * depth, (v - cy) / fy * depth, depth], axis=-1) @ rotation.T + pose[4:]
        for thing in truth["objects"]:
            file = sample.masks / thing["name"] / f"{frame:06d}.png"
            if not file.exists():
                continue
            inner = cv2.erode(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE), np.ones((7, 7)))
            chosen = cv2.resize(inner, depth.shape[::-1], interpolation=cv2.INTER_NEAREST).astype(bool) & (confidence == 2)
            pose_object = np.array(thing["capture_from_object"])
            local = (points[chosen] - pose_object[:3, 3]) @ pose_object[:3, :3]
            off.setdefault(thing["name"], []).append(np.abs((np.abs(local) - np.array(thing["dimensions_m"]) / 2).max(axis=1)))
    assert len(off) == len(truth["objects"])
    for name, distances in off.items():
        # 3 cm: three sigma of the sensor at 2.5 m, and the recess of a framed door
        assert np.median(np.concatenate(distances)) < 0.015, name
        assert np.mean(np.concatenate(distances) < 0.03) > 0.93, name  # the rest: handles


def test_masks_of_a_frame_do_not_overlap(sample: SamplePaths) -> None:
    for frame in range(FRAMES):
        files = list(sample.masks.glob(f"*/{frame:06d}.png"))
        masks = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files]
        assert files
        assert all(set(np.unique(mask)) == {0, 255} and mask.shape == SIZE[::-1] for mask in masks)
        assert np.sum([mask > 0 for mask in masks], axis=0).max() == 1


def test_every_object_has_one_click_on_its_mask(sample: SamplePaths) -> None:
    truth, prompts = json.loads(sample.truth.read_text()), json.loads(sample.prompts.read_text())
    assert [p["name"] for p in prompts["objects"]] == [o["name"] for o in truth["objects"]]
    for prompt in prompts["objects"]:
        (point,) = prompt["points"]
        mask = cv2.imread(str(sample.masks / prompt["name"] / f"{point['frame']:06d}.png"), cv2.IMREAD_GRAYSCALE)
        assert mask[int(point["y"]), int(point["x"])] == 255
        assert point["label"] == 1


def test_samples_are_deterministic_per_seed_and_differ_between_seeds(
    upright: SamplePaths, tmp_path: Path, sample: SamplePaths
) -> None:
    again = write_sample(tmp_path, seed=1, frames=2, size=(180, 240))
    for one, other in ((upright.truth, again.truth), (upright.prompts, again.prompts), (upright.scan, again.scan)):
        assert one.read_bytes() == other.read_bytes()
    here, there = (json.loads(path.read_text())["objects"] for path in (sample.truth, upright.truth))
    assert [o["dimensions_m"] for o in here] != [o["dimensions_m"] for o in there]


def test_the_recording_has_textured_well_exposed_frames(sample: SamplePaths) -> None:
    with zipfile.ZipFile(sample.scan) as scan:
        images = [
            cv2.imdecode(np.frombuffer(scan.read(f"rgbd/{i}.jpg"), np.uint8), cv2.IMREAD_GRAYSCALE) for i in range(FRAMES)
        ]
    for image in images:
        assert 70 < image.mean() < 200
        assert image.std() > 25
        assert np.mean(image > 252) < 0.1
