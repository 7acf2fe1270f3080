"""Faults of real recordings, added to a recording whose truth is known.

Their sizes are those of 7-Scenes' kitchen (seq-01, frames 0 to 995): gravity is 2.1 degrees off, poses disagree by 13 mm, log
exposure has a standard deviation of 0.28, a frame moves by 3 px of 640 while it is exposed, and the depth camera lies 33 mm
beside the colour camera (medians).
"""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.camera import Intrinsics, depth_points, project, reproject_depth
from r2c2r_core.geometry.masks import box_around
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.synthetic.chair import SIZE_M, Chair, place_chair
from r2c2r_core.synthetic.film import Film, TrueMasks
from r2c2r_core.synthetic.path import SECONDS, tremor
from r2c2r_core.synthetic.record3d import Record3DWriter
from r2c2r_core.synthetic.render import streak
from r2c2r_core.threads import in_threads

_TILT_DEG = (1.0, 3.0)
_BEND_M, _BEND_DEG, _BEND_S = 0.009, 0.25, 2.5  # standard deviations per axis, and how long an error lasts
_LIGHT, _LIGHT_S = (0.28, 0.13, 0.18), 1.5  # of log exposure, red to green and blue to green, in linear light
_EXPOSURE_S, _MOST_BLUR = 1 / 30, 8 / 640  # the longest motion blur is a fraction of the image's width
_DEPTH_FOCAL, _DEPTH_AT_M = 585 / 526, np.array([-0.033, 0.0028, 0.0])  # times the colour camera's; in its frame
_DARK, _GRAZING = 40, 0.2  # grey level of 255, and cosine of the view, below which depth is lost
_JUMP, _SMEAR_PX = (0.03, 0.03), 1.0  # a depth edge: at 0 m, and increase per metre; sigma of its blur
_LEAST_PX = 400  # of an object, from which a frame shows it
_MOST_CUT, _CUT = 0.3, 0.03  # fractions of the rows: cut off at most, and of the object at least


def film_as_real(recording: Path, seed: int, progress: Progress = SILENT) -> None:
    """Rewrite a recording in place, with truth.json, prompts.json and truth_masks/ beside it, as `r2c2r sample` writes them.

    A chair is added, also to the truth. An object's true pose is bent by the mean error of the frames that show it. Rows are
    cut off the top until no frame shows some object whole. Depth is that of a separate camera: read it with --register-depth.
    """
    folder, rng = recording.parent, np.random.default_rng([seed, 20])
    film, truth, prompts = Film.read(recording), _read(folder / "truth.json"), _read(folder / "prompts.json")
    things, frames = truth["objects"], range(len(film.poses))
    chair = place_chair(things, _floor_m(film), rng)
    things.append(_entry(chair))
    masks = TrueMasks(folder=folder / "truth_masks", names=[each["name"] for each in things], size=film.colour(0).shape[:2])

    def cover(frame: int) -> np.ndarray:
        numbers = np.where(_chair_pixels(film, frame, chair), len(things), masks.read(frame)).astype(np.uint8)
        masks.write(frame, numbers)
        return np.array([_extent(numbers == number) for number in range(1, len(things) + 1)])

    extents = np.array(list(in_threads(cover, frames)))  # (frames, objects, 3)
    top = _cut(things, extents, film)
    errors, tilt = _pose_errors(film, rng), _tilt(rng)
    for thing, pixels in zip(things, extents[..., 2].T, strict=True):
        _move(thing, tilt @ _mean_error(thing, film, errors, pixels))
    light = np.exp(np.array(_LIGHT) * tremor(rng, _times_s(film), 3, _LIGHT_S))

    def take(frame: int) -> tuple[Image, np.ndarray]:
        masks.write(frame, masks.read(frame)[top:])
        colour, depth_m = _with_chair(film, frame, chair)
        depth_m = _sense(depth_m, colour, film.depth_camera(frame), np.random.default_rng([seed, 21, frame]))
        return _photograph(colour, film, frame, light[frame]), depth_m

    unfinished = recording.with_suffix(".unfinished")
    with Record3DWriter(path=unfinished, fps=film.fps) as writer:
        for frame, (colour, depth_m) in enumerate(progress.each(in_threads(take, frames), "frame", len(frames))):
            whole, camera = film.cameras[frame], _of_depth(film.cameras[frame])
            known = depth_m[top * len(depth_m) // whole.height :] > 0
            depth_m = np.where(known, depth_m[-len(known) :], np.nan)
            pose = tilt @ errors[frame].bend(film.poses[frame]) @ Rigid3(np.eye(3), _DEPTH_AT_M)
            camera = replace(camera, cy=camera.cy - top, height=camera.height - top)
            time_s = float(_times_s(film)[frame])
            writer.add(np.ascontiguousarray(colour[top:]), depth_m, known.astype(np.uint8) * np.uint8(2), camera, pose, time_s)
    unfinished.replace(recording)
    entries = [*prompts["objects"], {"name": "chair", "category": "chair", "points": []}]
    prompts["objects"] = [found for each in entries if (found := _clicked(each, masks, extents[..., 2], top)) is not None]
    for name, document in (("truth.json", truth), ("prompts.json", prompts)):
        (folder / name).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


class _PoseError(NamedTuple):
    """Error of a camera's pose in the capture's frame."""

    rotvec: np.ndarray
    shift_m: np.ndarray

    def bend(self, pose: Rigid3) -> Rigid3:
        return Rigid3(_rotation(self.rotvec) @ pose.rotation, pose.translation + self.shift_m)

    def moved(self, point: np.ndarray, eye: np.ndarray) -> np.ndarray:
        """Where a camera at `eye` with this error takes the point to be."""
        return np.asarray(eye + self.shift_m + _rotation(self.rotvec) @ (point - eye))


def _pose_errors(film: Film, rng: np.random.Generator) -> list[_PoseError]:
    wander = tremor(rng, _times_s(film), 6, _BEND_S)
    return [_PoseError(np.radians(_BEND_DEG) * row[:3], _BEND_M * row[3:]) for row in wander]


def _mean_error(thing: dict[str, Any], film: Film, errors: Sequence[_PoseError], pixels: np.ndarray) -> Rigid3:
    """How the frames that show a thing move it, on average over their pixels of it."""
    weights = pixels / max(pixels.sum(), 1)
    middle = np.array(thing["capture_from_object"])[:3, 3]
    moved = weights @ [error.moved(middle, pose.translation) for error, pose in zip(errors, film.poses, strict=True)]
    turn = _rotation(weights @ [error.rotvec for error in errors])
    return Rigid3(turn, (moved if pixels.any() else middle) - turn @ middle)


def _tilt(rng: np.random.Generator) -> Rigid3:
    """Rotation about a level axis of the capture's frame (y up)."""
    heading, angle = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(*_TILT_DEG))
    return Rigid3(_rotation(angle * np.array([np.cos(heading), 0.0, np.sin(heading)])), np.zeros(3))


def _rotation(rotvec: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(rotvec).as_matrix())


def _move(thing: dict[str, Any], motion: Rigid3) -> None:
    """Move an object of a truth file and its joints."""
    thing["capture_from_object"] = (motion @ Rigid3.from_matrix(np.array(thing["capture_from_object"]))).matrix.tolist()
    for joint in thing["joints"]:
        joint["axis"] = motion.turn(np.array(joint["axis"])).tolist()
        joint["origin"] = motion.apply(np.array(joint["origin"])).tolist()
    thing["joint"] = thing["joints"][0] if thing["joints"] else None


def _entry(chair: Chair) -> dict[str, Any]:
    pose = {"capture_from_object": chair.capture_from_chair.matrix.tolist(), "observed_axes": [True, True, True]}
    return {"name": "chair", "category": "chair", "dimensions_m": list(SIZE_M), "joints": [], "symmetry": None, **pose}


def _floor_m(film: Film) -> float:
    """Height of the floor in the capture's frame: the lowest level with many points."""
    found = []
    for frame in range(0, len(film.poses), 10):
        points = depth_points(film.depth_m(frame), film.depth_camera(frame))[::4, ::4]
        found.append(film.poses[frame].apply(points[points[..., 2] > 0])[:, 1])
    heights = np.concatenate(found)
    counts, edges = np.histogram(heights, bins=np.arange(-3.0, 3.0, 0.01))
    lowest = edges[np.argmax(counts > 0.3 * np.sort(counts)[-10:].mean())]
    return float(np.median(heights[(heights > lowest - 0.01) & (heights < lowest + 0.03)]))


def _chair_pixels(film: Film, frame: int, chair: Chair) -> np.ndarray:
    """(h, w) pixels of the colour image that show the chair."""
    drawn = chair.draw(film.cameras[frame], film.poses[frame]).depth_m
    behind = cv2.resize(film.depth_m(frame), drawn.shape[::-1], interpolation=cv2.INTER_NEAREST)
    return np.asarray((drawn > 0) & ((behind == 0) | (drawn < behind)))


def _with_chair(film: Film, frame: int, chair: Chair) -> tuple[Image, np.ndarray]:
    """Colour image and depth with the chair in them."""
    colour, depth_m, small = film.colour(frame), film.depth_m(frame), film.depth_camera(frame)
    drawn, alpha = chair.draw(film.cameras[frame], film.poses[frame]), _chair_pixels(film, frame, chair).astype(np.float32)
    alpha = cv2.GaussianBlur(alpha, (0, 0), 0.7)[..., None]
    painted = np.where(drawn.depth_m[..., None] > 0, drawn.attributes, colour)
    nearer = chair.draw(small, film.poses[frame]).depth_m
    nearer = np.where((nearer > 0) & ((depth_m == 0) | (nearer < depth_m)), nearer, depth_m)
    return np.asarray(colour * (1 - alpha) + painted * alpha).astype(np.uint8), nearer


def _photograph(colour: Image, film: Film, frame: int, light: np.ndarray) -> Image:
    """The image under another exposure and white balance, blurred by the camera's motion."""
    camera, pose = film.cameras[frame], film.poses[frame]
    near, share = (frame - 1 if frame else min(1, len(film.poses) - 1)), _EXPOSURE_S * (len(film.poses) - 1) / SECONDS
    middle = np.array([0.0, 0.0, 2.0])
    motion = project(film.poses[near].inverse.apply(pose.apply(middle)), camera) - project(middle, camera)
    length = min(share * float(np.hypot(*motion)), _MOST_BLUR * camera.width)
    blurred = cv2.filter2D(colour, -1, streak(length, float(np.arctan2(motion[1], motion[0])))) if length > 1 else colour
    gain = light[0] * np.array([light[1], 1.0, light[2]])
    return np.asarray(np.clip(blurred * gain ** (1 / 2.2), 0, 255).astype(np.uint8))


def _sense(depth_m: np.ndarray, colour: Image, camera: Intrinsics, rng: np.random.Generator) -> np.ndarray:
    """Depth as the separate camera returns it: none on dark and grazing surfaces, smeared at edges."""
    grey = cv2.cvtColor(cv2.resize(colour, depth_m.shape[::-1], interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)
    points = depth_points(depth_m, camera)
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    cosine = np.abs((normals * points).sum(axis=2))
    cosine /= np.maximum(np.linalg.norm(normals, axis=2) * np.linalg.norm(points, axis=2), 1e-12)
    patches = cv2.GaussianBlur(rng.standard_normal(depth_m.shape), (0, 0), 4.0)
    lost = ((grey < _DARK) & (patches > -0.5 * patches.std())) | (cv2.blur(cosine, (5, 5)) < _GRAZING)
    known = (depth_m > 0).astype(np.float32)
    around = np.ones((5, 5))
    jump = cv2.dilate(depth_m, around) - cv2.erode(np.where(known > 0, depth_m, np.inf), around)
    smooth = cv2.GaussianBlur(depth_m * known, (0, 0), _SMEAR_PX) / np.maximum(cv2.GaussianBlur(known, (0, 0), _SMEAR_PX), 1e-3)
    smeared = np.where((jump > _JUMP[0] + _JUMP[1] * depth_m) & (known > 0), smooth, depth_m)
    return reproject_depth(np.where(lost, 0, smeared).astype(np.float32), camera, _of_depth(camera), _DEPTH_AT_M)


def _of_depth(camera: Intrinsics) -> Intrinsics:
    """The depth camera of a colour camera; the recording takes it for both."""
    return replace(camera, fx=camera.fx * _DEPTH_FOCAL, fy=camera.fy * _DEPTH_FOCAL, cx=camera.width / 2, cy=camera.height / 2)


def _extent(mask: np.ndarray) -> tuple[int, int, int]:
    """First row of an object, whether it ends inside the image at its other three sides, and its pixels."""
    pixels = int(np.count_nonzero(mask))
    if pixels < _LEAST_PX:
        return 0, 0, 0
    rows, columns = box_around(mask)
    inside = rows.stop < mask.shape[0] and columns.start > 0 and columns.stop < mask.shape[1]
    return int(rows.start), int(inside), pixels


def _cut(things: list[dict[str, Any]], extents: np.ndarray, film: Film) -> int:
    """The fewest rows to cut off all frames so that none shows some object up to its top; 0 if that takes too many.

    The height of objects that are cut in all frames is not observed then.
    """
    height, step = film.cameras[0].height, film.cameras[0].height // math.gcd(film.cameras[0].height, film.depth_size[1])
    inside = extents[..., 1] > 0
    tops = np.where(inside.any(axis=0), np.where(inside, extents[..., 0], 0).max(axis=0), height)
    rows = math.ceil((tops.min() + _CUT * height) / step) * step
    if rows > _MOST_CUT * height:
        return 0
    for thing in np.flatnonzero(tops < rows):
        things[thing]["observed_axes"][2] = False
    return rows


def _clicked(entry: dict[str, Any], masks: TrueMasks, pixels: np.ndarray, top: int) -> dict[str, Any] | None:
    """The entry of a prompts file with its points moved by the rows cut off; a point off the object is replaced."""
    number = masks.names.index(entry["name"]) + 1
    points = [{**point, "y": point["y"] - top} for point in entry["points"]]
    kept = [p for p in points if p["y"] >= 0 and masks.read(p["frame"])[int(p["y"]), int(p["x"])] == number]
    frame = int(np.argmax(pixels[:, number - 1]))
    if not kept and pixels[frame, number - 1] > 0:
        inside = cv2.distanceTransform(np.pad((masks.read(frame) == number).astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
        y, x = np.unravel_index(int(np.argmax(inside)), inside.shape)
        kept = [{"frame": frame, "x": float(x) + 0.5, "y": float(y) + 0.5, "label": 1}]
    return {**entry, "points": kept} if kept else None


def _times_s(film: Film) -> np.ndarray:
    return np.linspace(0.0, SECONDS, len(film.poses))


def _read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))
