"""Camera path of a person who walks along a kitchen with a phone."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import Akima1DInterpolator
from scipy.ndimage import gaussian_filter1d

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.rounds import round_poses

SECONDS = 18.0
_STEPS = 7  # knots on each way along the run
_LOOK_AT_M = (0.50, 1.45)  # alternating target heights: the base units, the wall units


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """One exposure."""

    timestamp_s: float
    kitchen_from_camera: Rigid3  # OpenCV camera axes
    blur_px: float  # length of the motion blur, at 960 px width
    gain: float  # exposure relative to the mean


def walk(kitchen: Kitchen, frames: int, rng: np.random.Generator) -> list[Shot]:
    """Walk along the run and back, looking up and down at the fronts from both sides."""
    eyes, targets = key_poses(kitchen, rng)
    return film_along(even_pace(eyes, targets), eyes, targets, frames, rng)


def key_poses(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Eye positions and target points of the walk past everything, in the kitchen's frame."""
    return _key_poses(kitchen, rng) if len(kitchen.runs) == 1 else round_poses(kitchen, rng)


def film_along(knots: np.ndarray, eyes: np.ndarray, targets: np.ndarray, frames: int, rng: np.random.Generator) -> list[Shot]:
    """A hand-held camera that passes each pose at its knot (0..1 of the recording)."""
    times = np.linspace(0.0, SECONDS, frames)
    eye = Akima1DInterpolator(knots, eyes, method="makima")(times / SECONDS)
    target = Akima1DInterpolator(knots, targets, method="makima")(times / SECONDS)
    eye += tremor(rng, times, 3, 0.35) * 0.012 + tremor(rng, times, 3, 0.08) * 0.0015
    tilt = tremor(rng, times, 3, 0.25) * np.radians([1.0, 1.0, 1.6]) + tremor(rng, times, 3, 0.07) * np.radians(0.12)
    gain = 1 + 0.035 * tremor(rng, times, 1, 1.2)[:, 0]
    blurred = rng.random(frames) < 0.06
    blur = np.where(blurred, rng.uniform(3, 8, frames), 0.0)
    return [
        Shot(
            timestamp_s=float(times[i]),
            kitchen_from_camera=Rigid3(_look(eye[i], target[i]) @ _small_rotation(tilt[i]), eye[i]),
            blur_px=float(blur[i]),
            gain=float(gain[i]),
        )
        for i in range(frames)
    ]


def even_pace(positions: np.ndarray, aims: np.ndarray) -> np.ndarray:
    """Times 0..1 of the poses, for an even pace of walking and looking."""
    pace = np.linalg.norm(np.diff(positions, axis=0), axis=1) + 0.6 * np.linalg.norm(np.diff(aims, axis=0), axis=1) + 0.2
    knots = np.concatenate([[0.0], np.cumsum(pace)])
    return np.asarray(knots / knots[-1])


def _key_poses(kitchen: Kitchen, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Eye positions and target points along a single run.

    A view of the whole, out along the run at standing height, the refrigerator from top to bottom, and back lower and closer.
    """
    left, right = kitchen.runs[0].ends
    fridge = kitchen.fridge
    near, far = min(left, fridge.centre[0] - fridge.size_m[0] / 2), max(right, fridge.centre[0] + fridge.size_m[0] / 2)
    start, end = (near, far) if rng.random() < 0.5 else (far, near)
    middle = (near + far) / 2
    eyes, targets = [[middle, -kitchen.base_depth_m - 2.35, 1.55]], [[middle, -0.4, 1.15]]
    for leg, (first, last, height, distance) in enumerate(((start, end, 1.52, 1.85), (end, start, 1.30, 1.55))):
        lead = 0.55 * np.sign(last - first)
        for step in range(_STEPS):
            x = first + (last - first) * (0.06 + 0.88 * step / (_STEPS - 1))
            away = distance + float(rng.uniform(-0.22, 0.22))
            eyes.append([x, -kitchen.base_depth_m - away, height + float(rng.uniform(-0.08, 0.08))])
            aim = x + (lead if step % 4 < 2 else -lead) * float(rng.uniform(0.6, 1.1))
            aim = float(np.clip(aim, near + 0.25, far - 0.25))
            targets.append([aim, -0.45, _LOOK_AT_M[(step + leg) % 2] + float(rng.uniform(-0.08, 0.08))])
        if (fridge.centre[0] > middle) == (last > first):
            aside = fridge.centre[0] + 0.45 * np.sign(middle - fridge.centre[0])
            for x, level in ((fridge.centre[0], 0.75), (aside, 0.95)):
                eyes.append([x, -kitchen.base_depth_m - 2.05, 1.45])
                targets.append([fridge.centre[0], -0.5, level])
    room = kitchen.room
    positions = np.array(eyes)
    positions[:, 0] = positions[:, 0].clip(room[0] + 0.45, room[1] - 0.45)
    positions[:, 1] = positions[:, 1].clip(room[2] + 0.5, -1.5)
    return positions, np.array(targets)


def tremor(rng: np.random.Generator, times: np.ndarray, columns: int, period_s: float) -> np.ndarray:
    """Smooth noise of unit variance; the same seed gives the same curve at every frame rate."""
    fine = gaussian_filter1d(rng.standard_normal((2000, columns)), period_s / SECONDS * 2000, axis=0, mode="wrap")
    fine /= fine.std(axis=0)
    place = times / SECONDS * 1999
    return np.column_stack([np.interp(place, np.arange(2000), fine[:, i]) for i in range(columns)])


def _look(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """kitchen_from_camera rotation of a level camera that looks from `eye` at `target` (OpenCV axes)."""
    forward = target - eye
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(forward, right), forward])


def _small_rotation(angles: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(angles).as_matrix())
