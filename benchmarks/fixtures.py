"""Carcasses of this project and of NVIDIA Scene Synthesizer compared: boards, mass, travel of a drawer and build time.

    python benchmarks/fixtures.py

Every category that opens, at its usual size, with either provider (`pip install 'r2c2r[scene-synthesizer]'`). Takes about ten
seconds.
"""

import time

import numpy as np

from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.kitchen.category import Category
from r2c2r_core.synthesize.fixtures.carcass import CARCASSES
from r2c2r_core.synthesize.fixtures.spec import Build, Order
from r2c2r_core.synthesize.fixtures.table import fixture_of
from r2c2r_core.terminal import table

_REPEATS = 3


def main() -> None:
    """Print the table."""
    rows = [_row(category) for category in CATEGORIES if category.fixture is not None and category.opens != "fixed"]
    print(table(("category", "boards", "theirs", "kg", "theirs", "travel m", "theirs", "ms", "theirs"), rows))


def _row(category: Category) -> tuple[str, ...]:
    (ours, own_ms), (theirs, their_ms) = (_built(category, name) for name in ("boards", "scene-synthesizer"))
    pairs = ((f"{measure(ours)}", f"{measure(theirs)}") for measure in (_boards, _mass, _travel))
    return (category.name, *(value for pair in pairs for value in pair), f"{own_ms:.1f}", f"{their_ms:.0f}")


def _built(category: Category, provider: str) -> tuple[Build, float]:
    """The fixture, and the milliseconds of the fastest of several builds."""
    fixture = fixture_of(category)
    assert fixture is not None
    carcass = CARCASSES.load(provider)
    size = np.array(category.usual_m)
    order = Order(dimensions_m=size, material=category.material, hinge=category.hinge, handle=None, carcass=carcass)
    seconds = []
    for _ in range(_REPEATS):
        start = time.perf_counter()
        build = fixture.build(order)
        seconds.append(time.perf_counter() - start)
    return build, 1000 * min(seconds)


def _boards(build: Build) -> int:
    return sum(len(part.boxes) for part in build.parts)


def _mass(build: Build) -> str:
    solid = ((part.density_kg_m3, float(np.prod(box.size_m))) for part in build.parts for box in part.boxes)
    return f"{sum(density * volume for density, volume in solid):.2f}"


def _travel(build: Build) -> str:
    slides = [motion.upper for motion in build.motions if motion.type == "prismatic"]
    return f"{slides[0]:.3f}" if slides else "-"


if __name__ == "__main__":
    main()
