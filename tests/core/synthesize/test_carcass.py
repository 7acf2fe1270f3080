"""Carcasses: invariants of every plan, and comparison with NVIDIA Scene Synthesizer's."""

import importlib.util
import itertools
import tomllib
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from r2c2r_core.model.scene import Box
from r2c2r_core.synthesize.fixtures.boards import Boards
from r2c2r_core.synthesize.fixtures.carcass import CARCASSES, CarcassPlan, FrontKind, Panels
from r2c2r_core.synthesize.fixtures.carcass import Params as CarcassParams
from r2c2r_core.tuning import tuned

SIZE = np.array([0.6, 0.58, 0.72])
PLANS = {
    "door": CarcassPlan(dimensions_m=SIZE, fronts=("door",)),
    "drawer": CarcassPlan(dimensions_m=np.array([0.5, 0.6, 0.2]), fronts=("drawer",)),
    "pair": CarcassPlan(dimensions_m=SIZE, fronts=("door", "door"), seams_m=(0.05,)),
    "stack": CarcassPlan(dimensions_m=SIZE, fronts=("drawer",) * 3, seams_m=(0.2, -0.1), stacked=True),
    "strip above": CarcassPlan(dimensions_m=SIZE, fronts=("fixed", "door"), seams_m=(0.28,), stacked=True, wall_m=0.03),
    "strip beside": CarcassPlan(dimensions_m=np.array([0.5, 0.35, 0.28]), fronts=("door", "fixed"), seams_m=(0.12,)),
    "tiny": CarcassPlan(dimensions_m=np.array([0.08, 0.06, 0.1]), fronts=("door",), wall_m=0.03, front_m=0.05),
}
needs_scene_synthesizer = pytest.mark.skipif(
    importlib.util.find_spec("scene_synthesizer") is None, reason="pip install 'r2c2r[scene-synthesizer]'"
)
PROVIDERS = ["boards", pytest.param("scene-synthesizer", marks=needs_scene_synthesizer)]
every_plan = pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)


def corners(box: Box) -> tuple[np.ndarray, np.ndarray]:
    return box.link_from_box.translation - box.size_m / 2, box.link_from_box.translation + box.size_m / 2


def apart_m(a: Box, b: Box) -> float:
    """The gap between two boxes; negative for the depth of their overlap."""
    (low_a, high_a), (low_b, high_b) = corners(a), corners(b)
    return float(np.maximum(low_b - high_a, low_a - high_b).max())


@every_plan
def test_boards_fill_the_outer_size_without_overlap(plan: CarcassPlan) -> None:
    panels = Boards().panels(plan)
    everything = [*panels.base, *(box for leaf in panels.movers for box in leaf)]
    np.testing.assert_allclose(np.min([corners(b)[0] for b in everything], axis=0), -plan.dimensions_m / 2, atol=1e-12)
    np.testing.assert_allclose(np.max([corners(b)[1] for b in everything], axis=0), plan.dimensions_m / 2, atol=1e-12)
    assert min(box.size_m.min() for box in everything) > 0.004
    for body in (panels.base, *panels.movers):
        assert all(apart_m(a, b) > -1e-9 for a, b in itertools.combinations(body, 2))


@pytest.mark.parametrize("provider", PROVIDERS)
@every_plan
def test_moving_parts_keep_gaps_to_the_body_and_to_other_fronts(plan: CarcassPlan, provider: str) -> None:
    carcass_params = tuned(CarcassParams)
    panels = CARCASSES.load(provider).panels(plan)
    for leaf in panels.movers:
        assert leaf[0].role == "front"
        assert {box.role for box in leaf[1:]} <= {"inner"}
        assert all(apart_m(a, b) > carcass_params.seat_gap_m - 1e-9 for a in leaf for b in panels.base)
    for a, b in itertools.combinations([*(leaf[0] for leaf in panels.movers), *of_role(panels, "front")], 2):
        assert apart_m(a, b) > carcass_params.front_gap_m - 1e-9


@pytest.mark.parametrize("provider", PROVIDERS)
@every_plan
def test_fronts_follow_the_order_and_seams_of_the_plan(plan: CarcassPlan, provider: str) -> None:
    carcass_params = tuned(CarcassParams)
    panels = CARCASSES.load(provider).panels(plan)
    moving = [span for kind, span in zip(plan.fronts, plan.spans_m, strict=True) if kind != "fixed"]
    axis = 2 if plan.stacked else 0
    half = plan.dimensions_m[axis] / 2
    for (low, high), leaf in zip(moving, panels.movers, strict=True):
        start, end = (float(corner[axis]) for corner in corners(leaf[0]))
        assert start == pytest.approx(low + (0 if low <= -half else carcass_params.front_gap_m / 2), abs=1e-9)
        assert end == pytest.approx(high - (0 if high >= half else carcass_params.front_gap_m / 2), abs=1e-9)
    assert [travel > 0 for travel in panels.travel_m] == [kind == "drawer" for kind in plan.fronts if kind != "fixed"]


def test_a_drawer_keeps_part_of_its_tray_inside_at_full_travel() -> None:
    panels = Boards().panels(PLANS["drawer"])
    _, high = corners(next(box for box in panels.movers[0] if box.name == "tray_back"))
    inside = float(high[1]) - PLANS["drawer"].seat_y_m
    assert 0.8 * inside < panels.travel_m[0] < inside


@needs_scene_synthesizer
@every_plan
def test_own_boards_match_those_of_scene_synthesizer(plan: CarcassPlan) -> None:
    """Outer boards, fronts and travel are equal; Scene Synthesizer splits the bottom of a pair, and its tray boards overlap."""
    ours, theirs = Boards().panels(plan), CARCASSES.load("scene-synthesizer").panels(plan)
    for role in ("carcass", "inner", "front"):
        assert solid_m3(of_role(ours, role)) == pytest.approx(solid_m3(of_role(theirs, role)), abs=1e-9)
    for own, other, travel, other_travel in zip(ours.movers, theirs.movers, ours.travel_m, theirs.travel_m, strict=True):
        np.testing.assert_allclose(corners(own[0]), corners(other[0]), atol=1e-9)
        assert travel == pytest.approx(other_travel, abs=1e-9)
        if len(own) > 1:
            np.testing.assert_allclose(together(own[1:]), together(other[1:]), atol=1e-9)
            assert solid_m3(own[1:]) == pytest.approx(solid_m3(other[1:]), rel=0.06)


def of_role(panels: Panels, role: str) -> list[Box]:
    return [box for box in panels.base if box.role == role]


def solid_m3(boxes: "list[Box] | tuple[Box, ...]") -> float:
    return float(sum(np.prod(box.size_m) for box in boxes))


def together(boxes: tuple[Box, ...]) -> tuple[np.ndarray, np.ndarray]:
    return np.min([corners(b)[0] for b in boxes], axis=0), np.max([corners(b)[1] for b in boxes], axis=0)


def test_the_test_plans_cover_every_kind_of_front() -> None:
    kinds: set[FrontKind] = {kind for plan in PLANS.values() for kind in plan.fronts}
    assert kinds == {"door", "drawer", "fixed"}


def test_a_plain_install_excludes_scene_synthesizer_and_triangle() -> None:
    project = tomllib.loads((Path(__file__).resolve().parents[3] / "pyproject.toml").read_text())["project"]
    brought = closure(project["dependencies"])
    assert {"trimesh", "networkx", "yourdfpy"} <= brought  # the requirements were resolved
    assert not {"scene-synthesizer", "triangle"} & brought
    assert {"scene-synthesizer", "triangle"} <= closure(project["optional-dependencies"]["scene-synthesizer"])


def closure(requirements: list[str]) -> set[str]:
    """Names of all transitive dependencies, from the metadata of installed packages."""
    brought: set[tuple[str, frozenset[str]]] = set()
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        wanted = waiting.pop()
        key = (canonicalize_name(wanted.name), frozenset(wanted.extras))
        if key in brought:
            continue
        brought.add(key)
        try:
            further = [Requirement(text) for text in requires(wanted.name) or ()]
        except PackageNotFoundError:  # for another platform, or removed after installation
            continue
        extras = ("", *wanted.extras)
        waiting += [r for r in further if r.marker is None or any(r.marker.evaluate({"extra": e}) for e in extras)]
    return {name for name, _ in brought}


def test_an_observed_inner_depth_thins_the_front_unless_it_does_not_fit() -> None:
    """The door of an appliance is no thicker than its clear depth allows."""
    machine = CarcassPlan(dimensions_m=np.array([0.6, 0.62, 1.8]), fronts=("door",), front_m=0.05)
    seen, too_deep = replace(machine, inner_depth_m=0.59), replace(machine, inner_depth_m=0.7)
    assert (machine.keeps_depth, seen.keeps_depth, too_deep.keeps_depth) == (False, True, False)
    assert machine.front_board_m == pytest.approx(0.05)
    assert seen.front_board_m == pytest.approx(0.027)
    assert seen.rear_y_m - (seen.front_board_m - 0.31) == pytest.approx(0.59)
    assert too_deep.rear_y_m == machine.rear_y_m
