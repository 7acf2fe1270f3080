"""Synthetic recording of a random kitchen, as from a phone, with complete ground truth."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.synthetic.as_filmed import film_as_real
from r2c2r_core.synthetic.atlas import LitScene, front_patches, light_scene
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.choices import SEEDS_OWN, Choice
from r2c2r_core.synthetic.hands import grip_of, hand_mover, hand_patches, hand_pose
from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.mesh import join_patches
from r2c2r_core.synthetic.motions import Sight, motion_entries, sights
from r2c2r_core.synthetic.opened_path import walk_and_open
from r2c2r_core.synthetic.opening import Film, plan_film, share_of
from r2c2r_core.synthetic.path import SECONDS, Shot, walk
from r2c2r_core.synthetic.posed import Stage, moved_patches
from r2c2r_core.synthetic.record3d import Record3DWriter
from r2c2r_core.synthetic.render import View, photograph, render_view
from r2c2r_core.synthetic.sensor import LidarFrame, scan_depth
from r2c2r_core.synthetic.styled import plan_styled_kitchen
from r2c2r_core.synthetic.truth import Sightings, capture_from_kitchen, prompts_document, true_objects, truth_document
from r2c2r_core.threads import in_threads

_AJAR = 0.6  # fraction of the widest state at which the light on an opening front is computed
_FOCAL_PER_LONG_SIDE = 0.757  # 726.6 px at 960 px: a real iPhone recording

_QUICK_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION,
    1,
    cv2.IMWRITE_PNG_STRATEGY,
    cv2.IMWRITE_PNG_STRATEGY_RLE,
    cv2.IMWRITE_PNG_FILTER,
    cv2.IMWRITE_PNG_FILTER_NONE,
]


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplePaths:
    """Files of a sample."""

    scan: Path
    truth: Path
    prompts: Path
    masks: Path


def write_sample(
    out: Path,
    *,
    seed: int = 0,
    frames: int = 180,
    size: tuple[int, int] = (960, 720),
    opened: bool = False,
    as_filmed: bool = False,
    choice: Choice = SEEDS_OWN,
    name: str = "scan",
    progress: Progress = SILENT,
    show: Callable[[Image], None] = lambda rgb: None,
) -> SamplePaths:
    """Write NAME.r3d, truth.json, prompts.json and truth_masks/ into `out`; size is (width, height) of the colour frames.

    With `opened`, fronts are opened and closed during the recording (opening.py); with `as_filmed`, it has the faults of real
    recordings (as_filmed.py). `show` receives each colour frame.
    """
    paths = SamplePaths(
        scan=out / f"{name}.r3d", truth=out / "truth.json", prompts=out / "prompts.json", masks=out / "truth_masks"
    )
    out.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(paths.masks, ignore_errors=True)
    progress.at(0.0, "building the kitchen")
    kitchen = plan_styled_kitchen(seed, choice)
    film = plan_film(kitchen, frames, np.random.default_rng([seed, 12])) if opened else None
    kitchen = kitchen if film is None else film.kitchen
    scenes = _still(kitchen, seed) if film is None else _moving(film, seed)
    path_rng = np.random.default_rng([seed, 3])
    shots = walk(kitchen, frames, path_rng) if film is None else walk_and_open(film, frames, path_rng)
    objects = true_objects(kitchen)
    to_capture = capture_from_kitchen(kitchen, shots[0].kitchen_from_camera.translation)
    sightings = Sightings(
        objects, moved={} if film is None else {thing.name: film.frames_open(thing.name, frames) for thing in objects}
    )
    folders = [paths.masks / thing.name for thing in objects]
    for folder in folders:
        folder.mkdir(parents=True)
    poses = _drifting_poses(shots, to_capture, np.random.default_rng([seed, 4]))
    cameras = _cameras(size, frames, np.random.default_rng([seed, 5]))
    white = _white_balance(np.random.default_rng([seed, 6]))
    seen: list[dict[str, Sight]] = []

    def take(number: int) -> _Taken:
        rng = np.random.default_rng([seed, 7, number])
        scene = scenes(number, shots[number], frames)
        return _take_frame(scene, shots[number], cameras[number], white, rng, number, folders)

    def taken() -> Iterator[_Taken]:
        for frame in in_threads(take, range(frames)):
            show(frame.rgb)  # before it is reported, so that a listener can display it
            yield frame

    with Record3DWriter(path=paths.scan, fps=round(frames / SECONDS)) as writer:
        for number, frame in enumerate(progress.part(0.1, 0.8 if as_filmed else 1.0).each(taken(), "frame", frames)):
            shot, camera = shots[number], cameras[number]
            writer.add(frame.rgb, frame.lidar.depth_m, frame.lidar.confidence, camera, poses[number], shot.timestamp_s)
            sightings.add(
                number, frame.view, frame.ids, frame.is_handle, frame.is_front, camera, shot.kitchen_from_camera, frame.rng
            )
            if film is not None:
                states = film.states(share_of(number, frames))
                seen.append(sights(film, states, frame.scene, frame.view, camera, shot.kitchen_from_camera.inverse))
    motions = {} if film is None else motion_entries(film, seen)
    _write_json(paths.truth, truth_document(objects, to_capture, sightings, motions))
    _write_json(paths.prompts, prompts_document(objects, sightings, np.random.default_rng([seed, 8])))
    if as_filmed:
        film_as_real(paths.scan, seed, progress.part(0.8, 1.0))
    return paths


Scenes = Callable[[int, Shot, int], LitScene]  # from frame number, shot, and number of frames


def _still(kitchen: Kitchen, seed: int) -> Scenes:
    """Static scene for all frames."""
    scene = light_scene(build_kitchen(kitchen), np.random.default_rng([seed, 2]))
    return lambda number, shot, frames: scene


def _moving(film: Film, seed: int) -> Scenes:
    """Scenes of a kitchen whose fronts are opened, with a hand on each while it moves."""
    joints, opened = list(film.openings), {opening.joint for opening in film.openings}
    patches = build_kitchen(film.kitchen, film.hollows)
    grips = {name: grip_of(film.fronts[name], patches) for name in opened}
    patches += [patch for opening in joints for patch in hand_patches(opening.joint)]
    away = {
        hand_mover(name): Rigid3(np.eye(3), np.array([0.0, 0.0, -9.0])) for name in opened
    }  # out of sight: neither lit nor casting shadows
    ajar = {o.joint: film.fronts[o.joint].pose(_AJAR * o.widest) for o in joints}
    closed = light_scene(moved_patches(patches, away), np.random.default_rng([seed, 2]))
    half = light_scene(moved_patches(patches, away | ajar), np.random.default_rng([seed, 2]))
    at_rest = replace(closed, vertices=join_patches(patches).vertices)
    stage = Stage.of(at_rest, half, np.array([patch.is_inner for patch in patches]))

    def scene_at(number: int, shot: Shot, frames: int) -> LitScene:
        time, camera = share_of(number, frames), shot.kitchen_from_camera
        poses: dict[str, Rigid3 | None] = {}
        for opening in joints:
            front, state = film.fronts[opening.joint], opening.state(time)
            poses[opening.joint] = front.pose(state)
            hand = hand_pose(front, grips[opening.joint], state, camera.translation, camera.rotation[:, 0])
            poses[hand_mover(opening.joint)] = hand if opening.moves(time) else None
        return stage.at(poses, {o.joint: o.state(time) / (_AJAR * o.widest) for o in joints})

    return scene_at


class _Taken(NamedTuple):
    """One rendered frame with its instance data."""

    scene: LitScene
    view: View
    rgb: Image
    lidar: LidarFrame
    ids: np.ndarray  # (h, w) instance ids, 0: no prompted object
    is_handle: np.ndarray  # (h, w)
    is_front: np.ndarray  # (h, w)
    rng: np.random.Generator  # generator for further random draws of this frame


def _take_frame(
    scene: LitScene,
    shot: Shot,
    camera: Intrinsics,
    white: tuple[float, float, float],
    rng: np.random.Generator,
    number: int,
    folders: list[Path],
) -> _Taken:
    """Photograph and scan the scene, and write the mask of every object in it."""
    camera_from_kitchen = shot.kitchen_from_camera.inverse
    view = render_view(scene, camera, camera_from_kitchen)
    blur_px = shot.blur_px * camera.width / 960
    rgb = photograph(view.colour, gain=shot.gain, blur_px=blur_px, white=white, rng=rng)
    lidar = scan_depth(scene, _depth_camera(camera), camera_from_kitchen, rng)
    ids = np.where(view.patch >= 0, scene.object_of_patch[view.patch], 0)
    is_handle = (view.patch >= 0) & scene.handle_patch[view.patch]
    is_front = (view.patch >= 0) & front_patches(scene)[view.patch]
    for index in np.unique(ids[ids > 0]):
        mask = (ids == index).astype(np.uint8) * np.uint8(255)
        cv2.imwrite(str(folders[index - 1] / f"{number:06d}.png"), mask, _QUICK_PNG)
    return _Taken(scene, view, rgb, lidar, ids, is_handle, is_front, rng)


def _cameras(size: tuple[int, int], frames: int, rng: np.random.Generator) -> list[Intrinsics]:
    """Pinhole cameras of a phone: principal point near the centre, it and the focal length drifting as the lens refocuses."""
    width, height = size
    focal = _FOCAL_PER_LONG_SIDE * max(size) * float(rng.uniform(0.98, 1.03))
    offset = rng.uniform(-0.006, 0.006, 2)
    wander = np.cumsum(rng.standard_normal((frames, 3)), axis=0) * 1e-4
    return [
        Intrinsics(
            fx=focal * (1 + float(f)),
            fy=focal * (1 + float(f)),
            cx=width * (0.5 + float(offset[0] + x)),
            cy=height * (0.5 + float(offset[1] + y)),
            width=width,
            height=height,
        )
        for f, x, y in wander
    ]


def _depth_camera(camera: Intrinsics) -> Intrinsics:
    """Camera of the LiDAR frame: 256x192, upright when the colour frame is."""
    return camera.resized(192, 256) if camera.height > camera.width else camera.resized(256, 192)


def _drifting_poses(shots: list[Shot], to_capture: Rigid3, rng: np.random.Generator) -> list[Rigid3]:
    """capture_from_camera as estimated by the phone: with slowly drifting errors of a few millimetres."""
    from scipy.ndimage import gaussian_filter1d
    from scipy.spatial.transform import Rotation

    count = len(shots)
    slow = gaussian_filter1d(rng.standard_normal((count, 6)), max(count / 25, 1), axis=0, mode="nearest")
    slow /= max(float(slow.std()), 1e-9)
    quick = rng.standard_normal((count, 6))
    shift = 0.0025 * slow[:, :3] + 0.0005 * quick[:, :3]
    turn = np.radians(0.08 * slow[:, 3:] + 0.015 * quick[:, 3:])
    return [
        to_capture
        @ Rigid3(
            shot.kitchen_from_camera.rotation @ Rotation.from_rotvec(t).as_matrix(), shot.kitchen_from_camera.translation + s
        )
        for shot, s, t in zip(shots, shift, turn, strict=True)
    ]


def _white_balance(rng: np.random.Generator) -> tuple[float, float, float]:
    red, blue = rng.uniform(0.97, 1.03, 2)
    return (float(red), 1.0, float(blue))


def _write_json(path: Path, document: dict[str, object]) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
