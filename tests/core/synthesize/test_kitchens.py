"""Whole kitchens of other layouts (L, U, island, two rows), measured with noise and compared with the true positions."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.layout import Layout, overlapping_pairs
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.test_layout import arranged

DEPTH, WIDTH, GAP = 0.58, 0.5, 0.003


def run(name: str, start: tuple[float, float], yaw: float, kinds: Sequence[str], *, z: float = 0.5) -> list[Unit]:
    """Units side by side from `start`, the left end of the front line, to the right as seen from the front."""
    right = np.array([np.cos(yaw), np.sin(yaw)])
    into = np.array([-np.sin(yaw), np.cos(yaw)])
    units = []
    for k, kind in enumerate(kinds):
        depth, height = (0.35, 0.7) if kind == "wall_cabinet" else (DEPTH, 0.7)
        x, y = np.array(start) + right * (WIDTH / 2 + k * (WIDTH + GAP)) + into * depth / 2
        units.append(
            Unit(f"{name}_{k}", kind, (float(x), float(y), z), (WIDTH, depth, height), yaw=yaw, handle=Handle(0.2, 0.2))
        )
    return units


def measured(units: Sequence[Unit], rng: np.random.Generator, noise_m: float = 0.002) -> list[Unit]:
    """The units as a scan would place them: edges off by 2-3 mm, yaw off by half a degree, unseen backs 2 cm too deep."""
    noisy = []
    for unit in units:
        deeper = np.array([-np.sin(unit.yaw), np.cos(unit.yaw), 0.0]) * 0.01
        centre = np.array(unit.centre) + deeper + rng.normal(size=3) * noise_m
        width, height = (unit.size[k] + float(rng.normal()) * noise_m for k in (0, 2))
        yaw = unit.yaw + float(rng.normal()) * np.deg2rad(0.4)
        place = (float(centre[0]), float(centre[1]), float(centre[2]))
        noisy.append(Unit(unit.name, unit.category, place, (width, unit.size[1] + 0.02, height), yaw=yaw, handle=unit.handle))
    return noisy


BASES = ("cabinet", "drawer", "cabinet", "double_door_cabinet")
NORTH = run("n", (0.6, 0.0), 0.0, BASES)
WALL = run("w", (0.6, 0.23), 0.0, ["wall_cabinet"] * 4, z=1.75)
EAST = run("e", (3.2, -0.1), -np.pi / 2, BASES[:3])
WEST = run("v", (0.02, -1.70), np.pi / 2, BASES[:3])
ISLAND = run("i", (1.0, -2.2), np.pi, BASES[:2])
BACK_TO_BACK = [*run("p", (0.0, 0.0), 0.0, BASES[:3]), *run("q", (1.509, 1.17), np.pi, BASES[:3])]
KITCHENS = {
    "one wall": [*NORTH, *WALL],
    "L": [*NORTH, *EAST],
    "U": [*NORTH, *EAST, *WEST],
    "island": [*NORTH, *ISLAND],
    "back to back": BACK_TO_BACK,
}


@pytest.fixture(scope="module", params=list(KITCHENS))
def kitchen(request: pytest.FixtureRequest) -> tuple[list[Unit], Layout]:
    true = KITCHENS[request.param]
    return true, arranged(*measured(true, np.random.default_rng(7)), manhattan=0.0)


def fronts(layout: Layout, run_name: str) -> list[MeasuredObject]:
    return [item for item in layout.objects if item.name.startswith(f"{run_name}_")]


def test_layouts_have_no_overlaps_or_warnings(kitchen: tuple[list[Unit], Layout]) -> None:
    _, layout = kitchen
    assert overlapping_pairs(layout.objects) == []
    assert layout.warnings == ()


def test_runs_are_coplanar_and_level_with_uniform_gaps(kitchen: tuple[list[Unit], Layout]) -> None:
    true, layout = kitchen
    for name in {unit.name.split("_")[0] for unit in true}:
        items = fronts(layout, name)
        outward, right = items[0].outward, items[0].world_from_object.rotation[:, 0]
        assert np.ptp([item.front_centre @ outward for item in items]) < 1e-6
        assert np.ptp([item.world_from_object.translation[2] + item.dimensions_m[2] / 2 for item in items]) < 1e-6
        edges = sorted((item.front_centre @ right, item.dimensions_m[0]) for item in items)
        for (a, width_a), (b, width_b) in pairwise(edges):
            assert b - width_b / 2 - (a + width_a / 2) == pytest.approx(GAP, abs=1e-4)


def test_fronts_stay_within_1_cm_of_their_true_position(kitchen: tuple[list[Unit], Layout]) -> None:
    true, layout = kitchen
    for unit, item in zip(true, layout.objects, strict=True):
        half = np.array([0.0, -unit.size[1] / 2, 0.0])
        assert np.linalg.norm(item.front_centre - unit.world_from_object.apply(half)) < 0.01, unit.name
        assert abs(np.arctan2(item.outward[0], -item.outward[1]) - unit.yaw) % (2 * np.pi) < np.deg2rad(0.5)
        assert abs(item.dimensions_m[0] - unit.size[0]) < 0.01
    assert max(layout.moves_m.values()) < 0.01


def test_units_back_to_back_lose_depth_instead_of_moving() -> None:
    """An island of two rows: the backs were measured 2 cm too deep each and would run into each other."""
    layout = arranged(*measured(BACK_TO_BACK, np.random.default_rng(1), noise_m=0.0), manhattan=0.0)
    assert max(layout.moves_m.values()) < 0.008
    assert overlapping_pairs(layout.objects) == []


def test_a_worktop_and_a_plinth_are_fitted_to_the_run() -> None:
    """Measured 9 mm above the units and 7 mm into them; a shelf half a metre higher is left alone."""
    worktop = Unit("top", "worktop", (1.6, 0.29, 0.85 + 0.009 + 0.02), (2.02, 0.62, 0.04), kind="thing")
    plinth = Unit("plinth", "plinth", (1.6, 0.05, 0.15 + 0.007 - 0.05), (2.0, 0.018, 0.1), kind="thing")
    shelf = Unit("shelf", "open shelf", (1.6, 0.4, 1.5), (0.8, 0.25, 0.3), kind="thing")
    layout = arranged(*NORTH, worktop, plinth, shelf, manhattan=0.0)
    top = max(item.world_from_object.translation[2] + item.dimensions_m[2] / 2 for item in fronts(layout, "n"))
    bottom = min(item.world_from_object.translation[2] - item.dimensions_m[2] / 2 for item in fronts(layout, "n"))
    placed = {item.name: item for item in layout.objects}
    assert low(placed["top"]) - top == pytest.approx(GAP, abs=2e-4)
    assert bottom - (low(placed["plinth"]) + placed["plinth"].dimensions_m[2]) == pytest.approx(GAP, abs=2e-4)
    assert layout.moves_m["shelf"] < 1e-6
    assert max(layout.moves_m[item.name] for item in fronts(layout, "n")) < 0.003
    assert overlapping_pairs(layout.objects) == []


def low(item: MeasuredObject) -> float:
    return float(item.world_from_object.translation[2] - item.dimensions_m[2] / 2)
