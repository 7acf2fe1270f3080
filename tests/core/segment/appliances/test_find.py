"""Choice of the plane for a click on an appliance."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.appliances.find import appliance_front
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.prepared import PreparedCapture
from tests.core.segment.motion.boards import CAMERA, cast_rays
from tests.core.segment.scenes import look_at


def plane(centre: tuple[float, float, float], outward: tuple[float, float], width_m: float, height_m: float) -> PlaneRegion:
    """A fully observed plane; `outward` in plan."""
    normal = np.array([*outward, 0.0]) / np.hypot(*outward)
    shape = (round(height_m / 0.02), round(width_m / 0.02))
    pose = Rigid3(front_rotation(normal), np.array(centre))
    return PlaneRegion(pose, width_m, height_m, np.ones(shape, bool), 0.02, width_m * height_m)


FRONT = plane((0.0, 0.0, 0.87), (0.0, -1.0), 0.60, 1.74)
SIDE = plane((-0.32, 0.33, 0.87), (-1.0, 0.0), 0.60, 1.74)
ROUNDED = plane((-0.30, 0.02, 0.87), (-0.5, -1.0), 0.06, 1.60)  # from fusion of the edge between them


WIDE = plane((0.0, 0.0, 0.87), (0.0, -1.0), 0.91, 1.74)
BESIDE = plane((-0.46, 0.33, 0.87), (-1.0, 0.0), 0.68, 1.74)


def asked_for(
    point: Vector3,
    kind: str = "refrigerator",
    planes: tuple[PlaneRegion, ...] = (FRONT, SIDE, ROUNDED),
    *,
    eye: tuple[float, float, float] = (-1.2, -1.6, 1.4),
    elsewhere: tuple[float, float, float] | None = None,
) -> PlaneRegion:
    """The plane whose run a click on a refrigerator at a world point requests.

    One camera sees it, with its eye at `eye`; five others at `elsewhere` look away from it.
    """
    return run_for(point, kind, planes, eye=eye, elsewhere=elsewhere)[0]


def run_for(
    point: Vector3,
    kind: str,
    planes: tuple[PlaneRegion, ...],
    *,
    eye: tuple[float, float, float] = (-1.2, -1.6, 1.4),
    elsewhere: tuple[float, float, float] | None = None,
    has_depth: bool = True,
) -> tuple[PlaneRegion, float]:
    """The plane of the requested run, and its margin."""
    asked: list[tuple[PlaneRegion, float]] = []
    half = planes[0].width_m / 2
    box = (Rigid3(np.eye(3), np.zeros(3)), (-half, 0.0, 0.0), (half, 0.66, 1.74))
    looks = [look_at(np.array(eye), np.array([0.0, 0.2, 0.8]))]
    looks += [] if elsewhere is None else [look_at(np.array(elsewhere), 3 * np.array(elsewhere))] * 5
    frames = tuple(
        Frame(index=k, timestamp_s=0.1 * k, rgb_camera=CAMERA, depth_camera=CAMERA, world_from_camera=look, sharpness=1.0)
        for k, look in enumerate(looks)
    )
    scene = SimpleNamespace(
        frames=frames,
        ray=lambda *_: (np.array(eye), (point - eye) / np.linalg.norm(point - eye)),
        pick=lambda *_: point,
        has_depth=lambda *_: has_depth,
        depth=lambda k: cast_rays([box], looks[k]),
        noise=DepthNoise(floor_m=0.002, per_m=0.002),
    )

    def run_of(region: PlaneRegion, margin_m: float = 0.0) -> None:
        asked.append((region, margin_m))

    prepared = cast(PreparedCapture, cast(Any, SimpleNamespace(scene=scene, planes=planes, run_of=run_of)))
    prompt = ObjectPrompt(name="it", category=kind, points=(PromptPoint(frame=0, x=1.0, y=1.0, label=1),))
    assert appliance_front(prepared, prompt, category_of(kind), np.zeros((0, 3))) is None  # there is no run
    return asked[0]


def test_a_click_on_the_front_selects_the_front() -> None:
    assert asked_for(np.array([0.1, 0.0, 1.0])) is FRONT


def test_a_click_on_the_side_selects_the_front_and_not_the_rounded_edge() -> None:
    assert asked_for(np.array([-0.32, 0.12, 0.5])) is FRONT


def test_a_click_on_the_rounded_edge_selects_the_front() -> None:
    assert asked_for(np.array([-0.30, 0.02, 0.5])) is FRONT


def test_a_wide_clicked_plane_wins_over_a_side_viewed_more_squarely() -> None:
    clicked = np.array([-0.3, 0.0, 1.0])
    assert asked_for(clicked, "french_door_refrigerator", (WIDE, BESIDE), eye=(-2.4, -0.5, 1.4)) is WIDE


def test_cameras_that_look_elsewhere_do_not_decide_which_side_is_the_front() -> None:
    wide = plane((0.0, 0.0, 0.87), (0.0, -1.0), 0.88, 1.66)
    beside = plane((-0.44, 0.33, 0.91), (-1.0, 0.0), 0.70, 1.82)
    clicked = np.array([-0.3, 0.0, 1.0])
    assert asked_for(clicked, "french_door_refrigerator", (wide, beside), elsewhere=(-2.5, 0.4, 1.4)) is wide


def test_a_corner_of_the_front_that_was_not_fused_selects_the_front() -> None:
    observed = np.ones((83, 44), bool)
    observed[:20, :12] = False
    front = replace(plane((0.0, 0.0, 0.83), (0.0, -1.0), 0.88, 1.66), support=observed)
    assert asked_for(np.array([-0.35, 0.0, 1.5]), "french_door_refrigerator", (front, BESIDE)) is front


def test_a_front_that_is_glass_but_for_its_rim_and_keypad_is_searched_beyond_them() -> None:
    observed = np.zeros((15, 26), bool)
    observed[:, 17:] = observed[13:] = True
    keypad = replace(plane((0.0, 0.0, 1.05), (0.0, -1.0), 0.52, 0.30), support=observed)
    assert run_for(np.array([0.2, 0.0, 1.05]), "microwave", (keypad,))[1] > 0.25
    whole = plane((0.0, 0.0, 1.05), (0.0, -1.0), 0.52, 0.30)
    assert run_for(np.array([0.2, 0.0, 1.05]), "microwave", (whole,))[1] == 0.0


def test_a_click_on_glass_selects_the_front_and_not_the_rear_board_that_other_frames_show_behind_it() -> None:
    keypad = plane((0.16, 0.0, 1.05), (0.0, -1.0), 0.18, 0.28)
    rear = plane((-0.02, 0.33, 1.05), (0.0, -1.0), 0.32, 0.20)
    clicked = np.array([-0.02, 0.33, 1.05])
    assert run_for(clicked, "microwave", (keypad, rear), eye=(-0.1, -1.2, 1.3), has_depth=False)[0] is keypad
