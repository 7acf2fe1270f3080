"""Keystroke-level time to draw all fronts of an uncut kitchen in the elevation editor, in a real Chromium.

    r2c2r sample KITCHEN --style handleless --palette white --layout island --seed 1 --frames 150
    python benchmarks/elevation_hand.py KITCHEN [--json benchmarks/app.json]

The simulated person uses no automatically cut panel and confirms no proposal. They know the fronts as if measured on site
(truth.json): runs are dragged by eye over the picture, the doors of a run are divided by a key where seams show or by typed
widths, stacks by the number or the heights of their drawers, hinges are set by a key at the hinge side, kinds by a digit, wall
cabinets are named together. Then the reconstruction runs, and the bundle's certificate is checked. Appliances and free-standing
objects are left out: they are clicked, not drawn. Hand time is that of benchmarks/hand.py from the import to the download;
computing time is reported beside it. Exit status 1: more than five minutes of hand time, or a certificate that failed.
"""

import argparse
import itertools
import json
import re
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Page, expect, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from hand import Hand
from kept import add_options, report

from tests.browser.conftest import CHROMIUM, QUIET, served

MOST_S = 300.0
LONG_MS = 1_800_000
MARGIN_PX = 16  # margin of the page around the fitted plane
OFF_PLANE_M = 0.03
JOINED_M = 0.008  # doors this close are divided by a seam; drawers of a handleless stack are further apart
EVEN_M = 0.001  # tolerance within which drawers have the same height
DRAWN = ("drawer", "cabinet", "wall_cabinet", "double_door_cabinet", "double_door_wall_cabinet")
KINDS = {"double_door_cabinet": "4"}  # the digit key, where the shape does not imply the kind


@dataclass(frozen=True, slots=True)
class Front:
    """A front's position on a plane: metres from the plane's top left corner, y down."""

    name: str
    category: str
    hinge: str | None
    left: float
    top: float
    right: float
    bottom: float


Column = list[Front]  # drawers above each other, or one door
Row = list[Column]  # columns side by side, between common lower and upper edges


def draw_by_hand(kitchen: Path, data: Path) -> dict[str, Any]:
    """The figures of one kitchen."""
    with served(data) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
        context.set_default_timeout(LONG_MS)
        expect.set_options(timeout=LONG_MS)
        page = context.new_page()
        page.goto(address)
        hand = Hand(page, np.random.default_rng(0))
        began = time.monotonic()
        _import(hand, kitchen)
        imported = time.monotonic()
        planes = _fronts_by_plane(page, kitchen)
        for number, fronts in planes.items():
            _draw_plane(hand, number, fronts)
        expect(page.locator(".stage-tools .chip").nth(1)).to_contain_text("saved")
        page.screenshot(path=data / "elevation.png")
        drawn = time.monotonic()
        by_drawing = hand.seconds
        wrong = _edges_off_mm(page, planes)
        certificate = _run(hand)
        scene = _ask(page, "/scene")
        browser.close()
    truth = {front.name: front for fronts in planes.values() for front in fronts}
    return {
        "kitchen": kitchen.name,
        "fronts": len(truth),
        "hand_s": round(hand.seconds, 1),
        "of_it_drawing_s": round(by_drawing, 1),
        "hand": hand.counts,
        "edges_off_mm": {"median": round(float(np.median(wrong)), 1), "worst": round(max(wrong), 1)},
        "objects_of_the_scene": len(scene["items"]),
        "joints": Counter(joint["type"] for item in scene["items"] for joint in item["joints"]),
        "certified": certificate["passed"],
        "import_s": round(imported - began, 1),
        "drawing_s": round(drawn - imported, 1),
        "run_s": round(time.monotonic() - drawn, 1),
    }


def _import(hand: Hand, kitchen: Path) -> None:
    page = hand.page
    hand.think()
    with page.expect_file_chooser() as chooser:
        hand.click(page.get_by_role("button", name="Import a scan").first)
    hand.click_elsewhere()  # stands for choosing the file in the system's dialog
    chooser.value.set_files(kitchen / "scan.r3d")
    page.wait_for_url(re.compile(r"/p/\w+"))
    page.get_by_role("link", name="Click objects").wait_for()
    hand.click(page.get_by_role("link", name="Elevation"))
    page.locator(".planes li").first.wait_for()


def _ask(page: Page, path: str) -> Any:
    """A GET request about the project; not counted as an action."""
    found = re.search(r"(https?://[^/]+)/p/(\w+)", page.url)
    assert found, page.url
    answer = page.context.request.get(f"{found.group(1)}/api/projects/{found.group(2)}{path}")
    assert answer.ok, f"{path}: {answer.status}"
    return answer.json()


def _fronts_by_plane(page: Page, kitchen: Path) -> dict[int, list[Front]]:
    """The fronts to draw, each on the first plane that it lies on."""
    planes = _ask(page, "/elevations")["items"]
    found: dict[int, list[Front]] = {}
    for thing in json.loads((kitchen / "truth.json").read_text())["objects"]:
        if thing["category"] in DRAWN:
            number, front = next((plane["id"], front) for plane in planes if (front := _on_plane(plane, thing)) is not None)
            found.setdefault(number, []).append(front)
    return dict(sorted(found.items()))


def _on_plane(plane: dict[str, Any], thing: dict[str, Any]) -> Front | None:
    pose, (width, depth, height) = np.array(thing["capture_from_object"]), thing["dimensions_m"]
    corners = np.array([[-width / 2, -depth / 2, height / 2, 1], [width / 2, -depth / 2, -height / 2, 1]]) @ pose.T
    at = corners[:, :3] - plane["origin_m"]
    (left, right), (top, bottom) = at @ plane["right"], at @ plane["down"]
    off = np.abs(at @ np.cross(plane["right"], plane["down"])).max()
    inside = (
        0 < (left + right) / 2 < plane["columns"] * plane["cell_m"] and 0 < (top + bottom) / 2 < plane["rows"] * plane["cell_m"]
    )
    if off > OFF_PLANE_M or not inside or left > right:
        return None
    return Front(thing["name"], thing["category"], thing["hinge"], left, top, right, bottom)


def _rows(fronts: list[Front]) -> list[Row]:
    """Columns, joined where only a seam separates them and their heights are equal."""
    rows: list[Row] = []
    columns = itertools.groupby(sorted(fronts, key=lambda one: (round(one.left, 2), one.top)), lambda one: round(one.left, 2))
    for _, column in columns:
        drawers = list(column)
        last = rows[-1][-1] if rows else None
        if last is not None and _joined(last, drawers):
            rows[-1].append(drawers)
        else:
            rows.append([drawers])
    return rows


def _joined(left: Column, right: Column) -> bool:
    gaps = (right[0].left - left[0].right, right[0].top - left[0].top, right[-1].bottom - left[-1].bottom)
    return all(abs(gap) < JOINED_M for gap in gaps)


@dataclass(slots=True)
class _Plane:
    """Screen positions of points on a fitted plane."""

    page: Page
    size: tuple[float, float]

    def at(self, x: float, y: float) -> tuple[float, float]:
        box = self.page.locator("r2c2r-elevation-canvas canvas").bounding_box()
        assert box is not None
        scale = min((box["width"] - 2 * MARGIN_PX) / self.size[0], (box["height"] - 2 * MARGIN_PX) / self.size[1])
        left = box["x"] + (box["width"] - self.size[0] * scale) / 2
        top = box["y"] + (box["height"] - self.size[1] * scale) / 2
        return left + x * scale, top + y * scale


def _draw_plane(hand: Hand, number: int, fronts: list[Front]) -> None:
    page = hand.page
    item = next(one for one in _ask(page, "/elevations")["items"] if one["id"] == number)
    plane = _Plane(page, (item["columns"] * item["cell_m"], item["rows"] * item["cell_m"]))
    hand.think()
    hand.click(page.locator(f".planes [data-plane='{number}']"))
    page.wait_for_timeout(500)  # let the picture load
    for count, row in enumerate(_rows(fronts)):
        _draw_row(hand, plane, row, typed=bool((number + count) % 2))
    for front in fronts:
        _say_kind_and_hinge(hand, plane, front)
    hand.think()
    hand.key("Control+a")
    hand.key("Shift+K")  # none has a handle
    if all(front.category == "wall_cabinet" for front in fronts):
        hand.key("t")
        hand.write("upper")


def _draw_row(hand: Hand, plane: _Plane, row: Row, *, typed: bool) -> None:
    """Drag the row as one rectangle; divide it into columns by typed widths or a key at each seam, and these into drawers."""
    hand.think()
    hand.drag(plane.at(row[0][0].left, row[0][0].top), plane.at(row[-1][0].right, row[-1][-1].bottom))
    if typed and len(row) > 1:
        gaps = [after[0].left - before[0].right for before, after in itertools.pairwise(row)]
        widths = [1000 * (column[0].right - column[0].left) for column in row[:-1]]
        hand.key("d")
        hand.write(" ".join(str(round(width)) for width in widths) + f"/{1000 * float(np.mean(gaps)):.0f}")
    else:
        for before, after in itertools.pairwise(row):
            hand.point(*plane.at((before[0].right + after[0].left) / 2, (before[0].top + before[-1].bottom) / 2))
            hand.key("s")
    for column in row:
        if len(column) > 1:
            _draw_stack(hand, plane, column)


def _draw_stack(hand: Hand, plane: _Plane, drawers: Column) -> None:
    """Divide a stack by the number of its drawers if they are alike, otherwise by their heights."""
    first, last = drawers[0], drawers[-1]
    hand.think()
    hand.press_at(*plane.at((first.left + first.right) / 2, (first.top + last.bottom) / 2))
    heights = [1000 * (drawer.bottom - drawer.top) for drawer in drawers]
    gap = round(1000 * float(np.mean([after.top - before.bottom for before, after in itertools.pairwise(drawers)])))
    hand.key("Shift+D")
    if max(heights) - min(heights) < 1000 * EVEN_M:
        hand.write(f"{len(drawers)}/{gap}")
    else:
        hand.write(" ".join(str(round(height)) for height in heights[:-1]) + f"/{gap}")


def _say_kind_and_hinge(hand: Hand, plane: _Plane, front: Front) -> None:
    middle = (front.top + front.bottom) / 2
    if front.category in KINDS:
        hand.think()
        hand.press_at(*plane.at((front.left + front.right) / 2, middle))
        hand.key(KINDS[front.category])
    if front.hinge in ("left", "right"):
        hand.think()
        hand.point(*plane.at(front.left + 0.06 if front.hinge == "left" else front.right - 0.06, middle))
        hand.key("j")


def _edges_off_mm(page: Page, planes: dict[int, list[Front]]) -> list[float]:
    """Distance of each drawn front's edges from the truth; fails if a front is missing or drawn twice."""
    drawn = [entry["front"] for entry in _ask(page, "/prompts.json")["objects"] if entry.get("front")]
    items = {item["id"]: item for item in _ask(page, "/elevations")["items"]}
    off: list[float] = []
    for number, fronts in planes.items():
        plane = items[number]
        for front in fronts:
            rects = [_rect(plane, entry["corners_m"]) for entry in drawn]
            wanted = np.array([front.left, front.top, front.right, front.bottom])
            nearest = min((rect for rect in rects if rect is not None), key=lambda rect: float(np.abs(rect - wanted).max()))
            off += (1000 * np.abs(nearest - wanted)).tolist()
    assert len(drawn) == sum(map(len, planes.values())), f"{len(drawn)} fronts drawn"
    return off


def _rect(plane: dict[str, Any], corners: list[list[float]]) -> np.ndarray | None:
    at = np.array(corners) - plane["origin_m"]
    if np.abs(at @ np.cross(plane["right"], plane["down"])).max() > OFF_PLANE_M:
        return None
    x, y = at @ plane["right"], at @ plane["down"]
    return np.array([x.min(), y.min(), x.max(), y.max()]) if x[1] > x[0] else None


def _run(hand: Hand) -> Any:
    """Run the reconstruction; the bundle's certificate."""
    page = hand.page
    hand.think()
    hand.click(page.get_by_role("link", name="Run", exact=True))
    hand.click(page.get_by_role("button", name="Run", exact=True))
    page.get_by_role("heading", name="Result").wait_for()
    certificate = _ask(page, "/certificate")
    hand.think()
    hand.click(page.get_by_role("link", name="Download").first)
    with page.expect_download() as download:
        hand.click(page.get_by_role("link", name=re.compile("^Bundle")))
    assert download.value.path().stat().st_size > 0
    return certificate


def main() -> int:
    """Measure and report; 1 if it took too much hand time or the certificate failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchen", type=Path)
    parser.add_argument("--data", type=Path, help="an empty folder to keep the app's data in, with a picture of the fronts")
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-elevation-") as folder:
        figures = draw_by_hand(options.kitchen, options.data or Path(folder))
    failed = figures["hand_s"] > MOST_S or not figures["certified"]
    return report("elevation_hand", figures, options.json, failed=failed)


if __name__ == "__main__":
    sys.exit(main())
