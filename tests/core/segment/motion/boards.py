"""Depth of a moving board before a hollow unit, in closed form by ray casting of boxes."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.hypotheses import Hypothesis, hypotheses
from r2c2r_core.segment.motion.leaf import Leaf
from tests.core.segment.scenes import look_at

CAMERA = Intrinsics(fx=150.0, fy=150.0, cx=96.0, cy=72.0, width=192, height=144)
THICKNESS_M = 0.018
Solid = tuple[Rigid3, tuple[float, float, float], tuple[float, float, float]]
"""A box: world_from_box, and its lowest and highest corner."""

LEAF = Leaf(
    world_from_front=Rigid3(front_rotation(np.array([0.3, -1.0, 0.0])), np.array([0.4, 0.2, 0.8])), width_m=0.5, height_m=0.6
)


@dataclass
class Film:
    """The part of a scene that motion estimation needs."""

    frames: tuple[Frame, ...]
    depths: dict[int, np.ndarray]
    floor_m: float | None = None
    noise: DepthNoise = field(default_factory=lambda: DepthNoise(floor_m=0.002, per_m=0.002))

    def depth(self, frame_index: int) -> np.ndarray:
        return self.depths[frame_index]


_HALF_W, _HALF_H = LEAF.half_m
REAR: Solid = (
    LEAF.world_from_front,
    (-_HALF_W, THICKNESS_M + 0.45, -_HALF_H),
    (_HALF_W, THICKNESS_M + 0.47, _HALF_H),
)


def joint(way: str) -> Hypothesis:
    return next(one for one in hypotheses(LEAF) if one.way == way)


def filmed(
    way: str,
    states: Sequence[float],
    *,
    noise_m: float = 0.004,
    hands: Sequence[int] = (),
    other: Sequence[int] = (),
    pivot_off: tuple[float, float, float] = (0.0, 0.0, 0.0),
    niche: bool = False,
    leans: bool = False,
    jars: bool = False,
    glass: bool = False,
    thickness_m: float = THICKNESS_M,
    seed: int = 0,
) -> Film:
    """LEAF in those states, one per frame, filmed by cameras that walk past it; an arm occludes it in frames `hands`.

    In frames `other` it is closed, and a similar board stands before it where it would be, hinged left and opened by 0.9.
    With `niche` it is closed between two appliances that protrude into the room and occlude it at the ends of the walk.
    With `leans` a board leans on the neighbour at its left in all frames, where the leaf would be if opened by 160 degrees.
    With `jars` a row of them stands on a shelf behind it, and the unit's rear board returns no depth. With `glass` its outer
    face returns none.
    """
    rng = np.random.default_rng(seed)
    moving = joint(way)
    frames, depths = [], {}
    for number, state in enumerate(states):
        t = number / max(len(states) - 1, 1) - 0.5
        eye = LEAF.world_from_front.apply(
            np.array([(3.2 if niche else 1.4) * t, -1.7 + 0.2 * np.cos(9 * t), 0.45 + 0.15 * np.sin(7 * t)])
        )
        pose = look_at(eye, LEAF.world_from_front.apply(np.array([0.2 * t, -0.15, -0.05])))
        turning = Rigid3(np.eye(3), np.array(pivot_off))
        leaf = LEAF.world_from_front @ turning @ moving.pose(state) @ turning.inverse
        before = [_arm()] if number in hands else []
        before += [_board(LEAF.world_from_front @ joint("left").pose(0.9))] if number in other else []
        before += _niche() if niche else []
        before += [_board(LEAF.world_from_front @ joint("left").pose(np.deg2rad(160)))] if leans else []
        before += _jars() if jars else []
        seen = cast_rays([*_unit(), _board(leaf, thickness_m), *before], pose)
        if jars:
            seen[seen != cast_rays([*(one for one in _unit() if one is not REAR), _board(leaf), *before], pose)] = 0.0
        if glass and leaf.inverse.apply(eye[None])[0, 1] < 0:
            seen[seen != cast_rays([*_unit(), *before], pose)] = 0.0
        frames.append(
            Frame(
                index=number,
                timestamp_s=number / 10,
                rgb_camera=CAMERA,
                depth_camera=CAMERA,
                world_from_camera=pose,
                sharpness=1.0,
            )
        )
        noisy = seen + rng.normal(0, noise_m, seen.shape) * (seen > 0)
        depths[number] = noisy.astype(np.float32)
    return Film(tuple(frames), depths)


def cast_rays(solids: Sequence[Solid], world_from_camera: Rigid3) -> np.ndarray:
    """z-depth (h, w) of the nearest of some boxes."""
    rays = pixel_rays(pixel_centres(CAMERA), CAMERA).reshape(-1, 3)
    nearest = np.full(len(rays), np.inf)
    for world_from_box, low, high in solids:
        seen = world_from_box.inverse @ world_from_camera
        turned = seen.turn(rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = ((np.array(edge) - seen.translation) / turned for edge in (low, high))
        near, far = np.minimum(first, second), np.maximum(first, second)
        enter = np.maximum(np.maximum(near[:, 0], near[:, 1]), near[:, 2])  # numpy is slow along an axis of length three
        leave = np.minimum(np.minimum(far[:, 0], far[:, 1]), far[:, 2])
        nearest = np.where((enter < leave) & (enter > 0), np.minimum(nearest, enter), nearest)
    return np.where(np.isfinite(nearest), nearest, 0.0).reshape(CAMERA.height, CAMERA.width)


def _board(world_from_leaf: Rigid3, thickness_m: float = THICKNESS_M) -> Solid:
    half_w, half_h = LEAF.half_m
    return (world_from_leaf, (-half_w + 0.0015, 0.0, -half_h + 0.0015), (half_w - 0.0015, thickness_m, half_h - 0.0015))


def _unit() -> list[Solid]:
    """Boards round a hollow half a metre deep, neighbours beside and below, a wall behind and a floor."""
    place, (w, h) = LEAF.world_from_front, LEAF.half_m
    return [
        (place, (-w - 0.6, 0.0, -h), (-w, 0.5, h)),
        (place, (w, 0.0, -h), (w + 0.6, 0.5, h)),
        (place, (-w - 0.6, 0.0, h), (w + 0.6, 0.5, h + 0.3)),
        (place, (-w - 0.6, 0.0, -h - 0.2), (w + 0.6, 0.5, -h)),
        REAR,
        (place, (-3.0, 0.5, -h - 0.5), (3.0, 0.6, 2.0)),
        (place, (-3.0, -3.0, -h - 0.3), (3.0, 0.5, -h - 0.2)),
    ]


def _niche() -> list[Solid]:
    w, h = LEAF.half_m
    deep, shallow = (-w - 0.6, -0.9, -h), (w - 0.017, -0.5, -h)
    return [(LEAF.world_from_front, deep, (-w, -0.02, h)), (LEAF.world_from_front, shallow, (w + 0.6, -0.02, h))]


def _jars() -> list[Solid]:
    jars = [(LEAF.world_from_front, (x, 0.25, 0.0), (x + 0.09, 0.32, 0.12)) for x in np.arange(-0.23, 0.2, 0.12)]
    return [(LEAF.world_from_front, (-_HALF_W, 0.04, -0.016), (_HALF_W, THICKNESS_M + 0.45, 0.0)), *jars]


def _arm() -> Solid:
    return LEAF.world_from_front, (-0.05, -0.75, -0.05), (0.07, -0.65, 0.7)
