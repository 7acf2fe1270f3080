"""Filmed openings: every frame shows the joint's true state, and the interior has the true depth."""

import json
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.choices import Choice
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.mesh import join_patches
from r2c2r_core.synthetic.opened_path import walk_and_open
from r2c2r_core.synthetic.opening import Film, Front, plan_film, share_of
from r2c2r_core.synthetic.render import View
from r2c2r_core.synthetic.stage import SamplePaths, write_sample
from r2c2r_core.synthetic.styled import plan_styled_kitchen
from r2c2r_core.synthetic.truth import Sightings, true_objects

FRAMES = 240
KITCHENS = [(2, None), (5, "galley"), (8, "l"), (1, "island")]


@pytest.fixture(params=KITCHENS, ids=lambda case: f"{case[1]}-{case[0]}")
def film(request: pytest.FixtureRequest) -> Film:
    return film_of(*request.param)


def film_of(seed: int, layout: str | None) -> Film:
    kitchen = plan_kitchen(seed) if layout is None else plan_styled_kitchen(seed, Choice(layout=layout))
    return plan_film(kitchen, FRAMES, np.random.default_rng([seed, 12]))


def front_to_rear(film: Film, front: Front) -> float:
    """Metres from the back of a closed front straight in, to the farthest surface of its drawer or of its compartment."""
    import open3d as o3d

    hollow = film.hollows[front.hollow_key]
    behind = [p for p in build_kitchen(film.kitchen, film.hollows) if (p.mover == front.joint.name and p.is_body) or p.is_inner]
    mesh = join_patches([p for p in behind if p.is_body == (hollow.tray is not None)])
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh.vertices.astype(np.float32)), o3d.core.Tensor(mesh.faces.astype(np.uint32)))
    out = np.array([0.0, -1.0, 0.0]) if front.run is None else front.run.kitchen_from_run.rotation @ [0.0, -1.0, 0.0]
    back = front.middle - out * hollow.front_m / 2
    low, high = front.corners[:, 2].min(), front.corners[:, 2].max()
    if hollow.tray is not None:  # between the top of its bottom board and the rim of its sides
        level = 0.0 if front.run is not None else film.kitchen.fridge.centre[2]
        low, high = level + hollow.tray.low[2] + 0.01, level + hollow.tray.high[2] - 0.002
    rays = [[*back[:2], z, *-out] for z in np.linspace(low, high, 40)]
    hits = scene.cast_rays(o3d.core.Tensor(np.array(rays, np.float32)))["t_hit"].numpy()
    return float(hits[np.isfinite(hits) & (hits < 1.0)].max())


def test_films_open_every_kind_of_front_singly_and_together() -> None:
    films = [film_of(*case) for case in KITCHENS]
    kinds = {film.fronts[o.joint].kind for film in films for o in film.openings}
    assert {"left", "right", "drawer", "bottom", "top", "lateral", "pair", "appliance drawer"} <= kinds
    together = 0
    for film in films:
        assert len(film.openings) >= 5
        states = np.array([list(film.states(share_of(i, FRAMES)).values()) for i in range(FRAMES)])
        assert (states[0] > 0).sum() == 1
        assert 1 <= (states[-1] > 0).sum() <= 2
        assert (states[int(0.2 * FRAMES) : int(0.4 * FRAMES)] == 0).all()
        together += bool(((states > 0).sum(axis=1) >= 2).any())
    assert together >= len(films) - 1  # not every kitchen has fronts that one view shows and that do not collide


def test_some_fronts_are_opened_to_their_joint_limit_and_none_beyond(film: Film) -> None:
    shares = [opening.widest / film.fronts[opening.joint].joint.upper for opening in film.openings]
    assert min(shares) > 0.4
    assert max(shares) == 1


def test_interior_depths_match_their_stated_depth(film: Film) -> None:
    for opening in film.openings:
        front = film.fronts[opening.joint]
        if front.owner == "microwave":  # it stands rotated on the worktop
            continue
        assert front_to_rear(film, front) == pytest.approx(film.hollows[front.hollow_key].inside.depth_m, abs=2e-3)


def test_the_camera_stays_clear_of_opening_fronts(film: Film) -> None:
    shots = walk_and_open(film, FRAMES, np.random.default_rng(0))
    for number, shot in enumerate(shots):
        time, eye = share_of(number, FRAMES), shot.kitchen_from_camera.translation
        x0, x1, y0, y1, _ = film.kitchen.room
        assert x0 < eye[0] < x1
        assert y0 < eye[1] < y1
        fridge = film.kitchen.fridge
        assert (np.abs(eye[:2] - fridge.centre[:2]) > np.array(fridge.size_m[:2]) / 2).any()
        for opening in film.openings:
            if (state := opening.state(time)) > 0.02:
                front = film.fronts[opening.joint]
                corners = front.pose(state).apply(front.corners)
                assert np.linalg.norm(corners[:, :2] - eye[:2], axis=1).min() > 0.3


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    return write_sample(tmp_path_factory.mktemp("opened"), seed=3, frames=24, size=(240, 180), opened=True)


def test_ground_truth_lists_every_joint_state_in_every_frame(sample: SamplePaths) -> None:
    truth = json.loads(sample.truth.read_text())
    joints = [joint for thing in truth["objects"] for joint in thing["joints"]]
    moved = [joint for joint in joints if any(joint["states"])]
    assert moved
    for joint in joints:
        assert len(joint["states"]) == len(joint["seen_px"]) == len(joint["seen_share"]) == 24
        assert all(0 <= state <= joint["upper"] + 1e-6 for state in joint["states"])
        assert (joint["inside"] is None) == (joint not in moved)
    assert [thing["name"] for thing in truth["objects"] if thing["opened"]] == [
        thing["name"] for thing in truth["objects"] if any(any(joint["states"]) for joint in thing["joints"])
    ]


def test_masks_and_depth_follow_the_opened_front(sample: SamplePaths) -> None:
    import lzfse

    truth = json.loads(sample.truth.read_text())
    with zipfile.ZipFile(sample.scan) as scan:
        meta = json.loads(scan.read("metadata"))
        for thing in truth["objects"]:
            for joint in thing["joints"]:
                wide = [
                    i for i, state in enumerate(joint["states"]) if state > 0.9 * joint["upper"] and joint["seen_px"][i] > 900
                ]
                for i in wide[-1:]:
                    mask = cv2.imread(str(sample.masks / thing["name"] / f"{i:06d}.png"), cv2.IMREAD_GRAYSCALE) > 0
                    assert np.count_nonzero(mask) >= joint["seen_px"][i]
                    depth = np.frombuffer(lzfse.decompress(scan.read(f"rgbd/{i}.depth")), "<f4").reshape(meta["dh"], meta["dw"])
                    inner = cv2.resize(cv2.erode(mask.astype(np.uint8), np.ones((9, 9))), depth.shape[::-1]) > 0
                    rows, columns = np.nonzero(inner & np.isfinite(depth))
                    points = in_capture(meta, i, rows, columns, depth[rows, columns])
                    pose = np.array(thing["capture_from_object"])
                    local = (points - pose[:3, 3]) @ pose[:3, :3]
                    assert (local[:, 1] < -thing["dimensions_m"][1] / 2 - 0.05).mean() > 0.3, thing["name"]  # out of its box


def in_capture(meta: dict, frame: int, rows: np.ndarray, columns: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Points of a depth image in the capture frame."""
    from scipy.spatial.transform import Rotation

    fx, fy, cx, cy = np.array(meta["perFrameIntrinsicCoeffs"][frame]) * meta["dw"] / meta["w"]
    rays = np.column_stack([(columns - cx) / fx, -(rows - cy) / fy, -np.ones(len(rows))]) * depth[:, None]
    *quaternion, x, y, z = meta["poses"][frame]
    return rays @ Rotation.from_quat(quaternion).as_matrix().T + [x, y, z]


@pytest.mark.slow
def test_the_same_seed_gives_an_identical_opening_film(sample: SamplePaths, tmp_path: Path) -> None:
    again = write_sample(tmp_path, seed=3, frames=24, size=(240, 180), opened=True)
    assert again.scan.read_bytes() == sample.scan.read_bytes()
    assert again.truth.read_bytes() == sample.truth.read_bytes()


def test_some_clicks_are_on_the_opened_front() -> None:
    objects = true_objects(plan_kitchen(3))
    sightings, shape = Sightings(objects, moved={objects[0].name: frozenset({1})}), (60, 80)
    camera, pose = Intrinsics(fx=60.0, fy=60.0, cx=40.0, cy=30.0, width=80, height=60), Rigid3()
    view = View(colour=np.zeros((*shape, 3), np.uint8), patch=np.zeros(shape, np.int32), depth_m=np.ones(shape))
    ids, right = np.zeros(shape, int), np.zeros(shape, bool)
    ids[10:50, 10:70] = 1
    right[:, 45:] = True
    for frame in (0, 1):
        sightings.add(frame, view, ids, np.zeros(shape, bool), right, camera, pose, np.random.default_rng(frame))
    clicks = [sightings.click(0, np.random.default_rng(draw)) for draw in range(60)]
    opened = [click for click in clicks if click is not None and click[0] == 1]
    assert 5 < len(opened) < 35
    assert all(x > 45 for _, x, _ in opened)
