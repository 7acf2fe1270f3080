"""Faults of real recordings in samples: what the truth says afterwards is what the images show."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.as_filmed import film_as_real
from r2c2r_core.synthetic.film import Film, TrueMasks
from r2c2r_core.synthetic.stage import write_sample

SIZE = (480, 360)


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sample(tmp_path_factory.mktemp("clean"), seed=0, frames=8, size=SIZE).scan.parent


@pytest.fixture(scope="module")
def filmed(clean: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filmed") / "kitchen"
    shutil.copytree(clean, folder)
    film_as_real(folder / "scan.r3d", seed=3)
    return folder


def truth_of(folder: Path) -> list[dict]:
    return json.loads((folder / "truth.json").read_text())["objects"]


def masks_of(folder: Path) -> TrueMasks:
    return TrueMasks(folder=folder / "truth_masks", names=[each["name"] for each in truth_of(folder)], size=SIZE[::-1])


def colour_view(film: Film, frame: int) -> tuple[Intrinsics, Rigid3]:
    """The colour camera and its pose, from the depth camera's that the file states."""
    camera, focal = film.cameras[frame], 526 / 585
    colour = replace(camera, fx=camera.fx * focal, fy=camera.fy * focal)
    return colour, film.poses[frame] @ Rigid3(np.eye(3), np.array([0.033, -0.0028, 0.0]))


def test_a_single_frame_shows_objects_where_the_truth_has_them(tmp_path: Path) -> None:
    write_sample(tmp_path, seed=0, frames=1, size=SIZE)
    film_as_real(tmp_path / "scan.r3d", seed=3)
    film = Film.read(tmp_path / "scan.r3d")
    (camera, pose), numbers = colour_view(film, 0), masks_of(tmp_path).read(0)
    compared = 0
    for number, thing in enumerate(truth_of(tmp_path), 1):
        rows, columns = np.nonzero(numbers == number)
        if not thing["joints"] or len(rows) < 400 or rows.min() == 0 or columns.min() == 0 or columns.max() == SIZE[0] - 1:
            continue
        w, d, h = np.array(thing["dimensions_m"]) / 2
        front = np.array([[x, -d, z] for x in (-w, w) for z in (-h, h)])
        corners = Rigid3.from_matrix(np.array(thing["capture_from_object"])).apply(front)
        left = project(pose.inverse.apply(corners), camera)[:, 0].min()
        assert abs(left - columns.min()) < 6  # principal points differ by up to 0.6 % of the width
        compared += 1
    assert compared >= 3


def test_gravity_is_one_to_three_degrees_off_and_poses_bend(clean: Path, filmed: Path) -> None:
    tilts = [np.degrees(np.arccos(np.array(each["capture_from_object"])[1, 2])) for each in truth_of(filmed)]
    assert 0.7 < np.median(tilts) < 3.3
    before, after = Film.read(clean / "scan.r3d").poses, Film.read(filmed / "scan.r3d").poses
    relative = [a.inverse @ b for a, b in zip(before, after, strict=True)]
    assert np.ptp([each.translation for each in relative], axis=0).max() > 0.005


def test_no_frame_shows_the_top_of_an_object_that_is_cut(filmed: Path) -> None:
    masks, cut = masks_of(filmed), [each["name"] for each in truth_of(filmed) if not each["observed_axes"][2]]
    seen = 0
    for frame in range(8):
        numbers = masks.read(frame)
        assert numbers.shape == Film.read(filmed / "scan.r3d").colour(frame).shape[:2]
        for number in (masks.names.index(name) + 1 for name in cut):
            rows, columns = np.nonzero(numbers == number)
            if len(rows) > 400 and columns.min() > 0 and columns.max() < SIZE[0] - 1 and rows.max() < len(numbers) - 1:
                assert rows.min() == 0
                seen += 1
    assert cut
    assert seen


def test_a_chair_is_in_the_truth_and_hides_what_is_behind_it(clean: Path, filmed: Path) -> None:
    chair, masks = truth_of(filmed)[-1], masks_of(filmed)
    assert chair["category"] == "chair"
    pixels = [np.count_nonzero(masks.read(frame) == len(masks.names)) for frame in range(8)]
    assert max(pixels) > 1000
    before, frame = masks_of(clean).read(int(np.argmax(pixels))), int(np.argmax(pixels))
    hidden = before[-len(masks.read(frame)) :][masks.read(frame) == len(masks.names)]
    assert np.count_nonzero(hidden) > 100


def test_clicks_lie_on_their_objects(filmed: Path) -> None:
    prompts, masks = json.loads((filmed / "prompts.json").read_text())["objects"], masks_of(filmed)
    assert prompts[-1]["name"] == "chair"
    for prompt in prompts:
        (point,) = prompt["points"]
        assert masks.read(point["frame"])[int(point["y"]), int(point["x"])] == masks.names.index(prompt["name"]) + 1
