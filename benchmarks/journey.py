"""Time and clicks of a practised person from upload to an approved bundle, in a real Chromium.

    python benchmarks/journey.py SAMPLE [--lab [--ray]] [--json benchmarks/app.json]

SAMPLE is a folder that `r2c2r sample` writes (180 frames, 14-15 objects). The simulated person knows the room's ground truth:
after all proposals from 80 % confidence up are confirmed with one key, each missing object gets a click where a person would
click (prompts.json), false objects are deleted, wrong categories are corrected. Then run, accept every object, send to review,
approve, download.

Clicks are counted by the app (GET …/figures): each point, each proposal confirmed (also when one key confirms them all),
dismissed or deleted, each new name or category, and each undo is one. Key and mouse presses on the whole way are counted here
as well, and so is computing time. Exit status 1: more than 10 minutes, or 1.2 clicks per object. With --lab rows are in a
Postgres, files in an S3 server, the server computes nothing and a seat does, with --ray on a Ray node.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Page, expect, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report

from app.jobs.mask_wire import bits_mask
from tests.app import postgres
from tests.app.object_server import BUCKET, object_server
from tests.app.ray_cluster import ray_node
from tests.browser.conftest import CHROMIUM, QUIET
from tests.browser.serving import served

MOST_MINUTES, MOST_CLICKS = 10.0, 1.2
SAME = 0.5  # minimum IoU for a mask to count as that object
LONG_MS = 1_800_000


@dataclass
class Person:
    """A simulated person: counts presses, and knows the room's ground truth."""

    page: Page
    sample: Path
    keys: int = 0
    mouse: int = 0
    minutes: dict[str, float] = field(default_factory=dict)

    @property
    def project(self) -> str:
        """The project's address in the API."""
        found = re.search(r"/p/(\w+)", self.page.url)
        assert found, self.page.url
        return f"/api/projects/{found.group(1)}"

    def ask(self, path: str) -> Any:
        """A GET request to the app; not counted as an action."""
        origin = re.match(r"https?://[^/]+", self.page.url)
        assert origin
        answer = self.page.context.request.get(origin.group() + path)
        assert answer.ok, f"{path}: {answer.status} {answer.text()[:200]}"
        return answer.json()

    def press(self, key: str) -> None:
        """Press one key."""
        self.keys += 1
        self.page.keyboard.press(key)

    def click(self, target: Any, **where: Any) -> None:
        """Press the mouse button once."""
        self.mouse += 1
        target.click(timeout=LONG_MS, **where)

    def write(self, target: Any, text: str) -> None:
        """Type into a field and press Enter."""
        self.click(target)
        self.keys += len(text) + 1
        target.fill(text)
        target.press("Enter")

    def answer(self, target: Any, text: str) -> None:
        """Type into the focused field of a dialog and press Ctrl+Enter."""
        self.keys += len(text) + 1
        target.fill(text)
        target.press("Control+Enter")

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Record the minutes of one phase."""
        began = time.monotonic()
        yield
        self.minutes[name] = round((time.monotonic() - began) / 60, 2)


@contextmanager
def laboratory(folder: Path, *, ray: bool) -> Iterator[None]:
    """Settings of a laboratory in the environment, and a seat that computes, on this machine or on a Ray node."""
    with ExitStack() as parts:
        rows, store = parts.enter_context(postgres.server()), parts.enter_context(object_server())
        os.environ.update(store.environment, R2C2R_DATABASE=rows.of_folder(folder), R2C2R_STORE=f"s3://{BUCKET}/journey")
        node = {"R2C2R_COMPUTE": "ray", **parts.enter_context(ray_node()).environment} if ray else {}
        command = [sys.executable, "-m", "r2c2r_core.cli", "work", "--data", str(folder / "seat")]
        seat = parts.enter_context(subprocess.Popen(command, env={**os.environ, **node}))
        parts.callback(seat.terminate)
        yield


def journey(sample: Path, data: Path, *, heavy_jobs: int) -> dict[str, Any]:
    """The figures of one journey."""
    with served(data, heavy_jobs=heavy_jobs) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
        context.set_default_timeout(LONG_MS)
        expect.set_options(timeout=LONG_MS)
        page = context.new_page()
        page.goto(address)
        person = Person(page, sample)
        with person.phase("upload and import"):
            _upload(person)
        with person.phase("proposals"):
            _confirm(person)
        with person.phase("corrections"):
            right = _correct(person)
        with person.phase("reconstruction"):
            _run(person)
        with person.phase("review"):
            unmet = _review(person)
        with person.phase("download"):
            _download(person)
        figures = person.ask(f"{person.project}/figures")
        browser.close()
    return {
        "sample": sample.name,
        "objects": figures["objects"],
        "objects_of_the_truth_found": right,
        "clicks": figures["clicks"],
        "clicks_per_object": round(figures["clicks_per_object"], 2),
        "verdicts": figures["verdicts"],
        "automatic_kept": figures["automatic_kept"],
        "upload_to_approval_minutes": round(figures["upload_to_approval_s"] / 60, 2),
        "of_it_computing_minutes": round(figures["computing_s"] / 60, 2),
        "minutes": person.minutes,
        "key_presses": person.keys,
        "mouse_presses": person.mouse,
        "approved_in_spite_of": unmet,
    }


def _upload(person: Person) -> None:
    page = person.page
    with page.expect_file_chooser() as chooser:
        person.click(page.get_by_role("button", name="Import a scan").first)
    chooser.value.set_files(person.sample / "scan.r3d")
    page.wait_for_url(re.compile(r"/p/\w+"))
    page.get_by_role("link", name="Click objects").wait_for(timeout=LONG_MS)


def _confirm(person: Person) -> None:
    """Wait for the proposals, look at them, confirm the sure ones with one key, wait for their masks."""
    page = person.page
    person.click(page.get_by_role("link", name="Annotate"))
    expect(page.get_by_label("Proposals", exact=True)).to_contain_text("Y confirms", timeout=LONG_MS)
    person.press("n")
    person.press("Shift+Y")
    expect(page.locator("r2c2r-object-list .head").first).to_be_visible(timeout=LONG_MS)
    _masks_come(person)


def _masks_come(person: Person) -> None:
    """Wait until every object has its masks."""
    while True:
        items = person.ask(f"{person.project}/objects")
        if items and all(item["segment"] in ("done", "failed") for item in items):
            return
        person.page.wait_for_timeout(300)


def _correct(person: Person) -> int:
    """Delete false and duplicate objects, correct categories, click missing ones; the resulting number of true objects."""
    wanted = {item["name"]: item["category"] for item in json.loads((person.sample / "truth.json").read_text())["objects"]}
    found = _looked_at(person)
    for item, name in found:
        if name is None or name in [other for before, other in found if before["id"] < item["id"]]:
            person.click(person.page.get_by_role("button", name=f"Delete {item['name']}", exact=True))
        elif item["category"] != wanted[name]:
            person.click(person.page.get_by_role("button", name=item["name"], exact=True))
            person.write(person.page.get_by_label(f"Category of {item['name']}"), wanted[name])
    missing = sorted(set(wanted) - {name for _, name in found})
    for name in missing:
        _click_object(person, name, wanted[name])
    _masks_come(person)
    return len(set(wanted) & {name for _, name in _looked_at(person) if name})


def _looked_at(person: Person) -> list[tuple[dict[str, Any], str | None]]:
    """Each object of the app, and the true object that it shows on the frame it was clicked on."""
    names = [item["name"] for item in json.loads((person.sample / "truth.json").read_text())["objects"]]
    found: list[tuple[dict[str, Any], str | None]] = []
    for item in person.ask(f"{person.project}/objects"):
        frame = next(point["frame"] for point in item["points"] if point["label"])
        shown = [mask for mask in person.ask(f"{person.project}/masks/{frame}") if mask["object"] == item["id"]]
        shares = {name: _iou(bits_mask(shown[0]["mask"]), _truth_mask(person.sample, name, frame)) for name in names if shown}
        best = max(shares, key=lambda name: shares[name], default=None)
        found.append((item, best if best is not None and shares[best] >= SAME else None))
    return found


def _truth_mask(sample: Path, name: str, frame: int) -> np.ndarray:
    path = sample / "truth_masks" / name / f"{frame:06d}.png"
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.exists() else None
    return picture > 0 if picture is not None else np.zeros((1, 1), bool)


def _iou(mask: np.ndarray, truth: np.ndarray) -> float:
    if not truth.any():
        return 0.0
    same = cv2.resize(truth.astype(np.uint8), mask.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    return float((mask & same).sum() / max((mask | same).sum(), 1))


def _click_object(person: Person, name: str, category: str) -> None:
    """Set the object's category and click it once, on the frame that shows it best."""
    page = person.page
    prompts = json.loads((person.sample / "prompts.json").read_text())["objects"]
    point = next(item["points"][0] for item in prompts if item["name"] == name)
    page.goto(re.sub(r"/annotate.*", f"/annotate?frame={point['frame']}", page.url))
    expect(page.locator("r2c2r-film-strip output")).to_contain_text(f"frame {point['frame']} ")
    page.locator(".chip", has_text=re.compile("^ready$")).wait_for(timeout=LONG_MS)
    before = len(person.ask(f"{person.project}/objects"))
    person.write(page.get_by_label("Category of the next object"), category)
    frames = person.ask(f"{person.project}/frames")
    facts = next(frame for frame in frames if frame["index"] == point["frame"])
    canvas = page.locator("r2c2r-frame-canvas canvas")
    box = canvas.bounding_box()
    assert box
    scale = min(box["width"] / facts["width"], box["height"] / facts["height"])
    left, top = (box["width"] - facts["width"] * scale) / 2, (box["height"] - facts["height"] * scale) / 2
    at = {"x": left + point["x"] * scale, "y": top + point["y"] * scale}
    person.click(canvas, position=at, modifiers=["Control"])  # also where another object's mask is
    while len(person.ask(f"{person.project}/objects")) == before:
        page.wait_for_timeout(50)


def _run(person: Person) -> None:
    page = person.page
    person.click(page.get_by_role("link", name="Run", exact=True))
    person.click(page.get_by_role("button", name="Run", exact=True))
    page.get_by_role("heading", name="Result").wait_for(timeout=LONG_MS)


def _review(person: Person) -> list[str]:
    """Accept every object with one key each, then step through the states; the unmet requirements at approval."""
    page = person.page
    person.click(page.get_by_role("link", name="Review").first)
    groups = person.ask(f"{person.project}/candidates")
    for number in range(len(groups) + 1):
        expect(page.get_by_text(re.compile(f"^{number} of {len(groups)} object"))).to_be_visible(timeout=LONG_MS)
        if number < len(groups):
            person.press("y")
    while not all(group["accepted"] for group in person.ask(f"{person.project}/candidates")):
        page.wait_for_timeout(300)  # shown at once, but stored one after the other
    unmet: list[str] = []
    for text in ("Send to review", "Start the review", "Approve"):
        button = page.get_by_role("button", name=text, exact=True)
        button.wait_for()
        left = next(move["unmet"] for move in person.ask(f"{person.project}/review")["moves"] if move["text"] == text)
        person.click(button)
        if left:
            unmet += left
            person.answer(page.get_by_role("dialog").get_by_role("textbox"), "seen, and good enough")
        button.wait_for(state="detached")
    return unmet


def _download(person: Person) -> None:
    page = person.page
    person.click(page.get_by_role("link", name="Download").first)
    with page.expect_download() as download:
        person.click(page.get_by_role("link", name=re.compile("^Bundle")))
    assert download.value.path().stat().st_size > 0


def main() -> int:
    """Measure and report; 1 if it took too long or too many clicks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sample", type=Path)
    add_options(parser)
    parser.add_argument("--lab", action="store_true", help="Postgres, an S3 server, a seat that computes")
    parser.add_argument("--ray", action="store_true", help="with --lab: the seat computes on Ray")
    options = parser.parse_args()
    if options.ray and not options.lab:
        parser.error("--ray needs --lab")
    with tempfile.TemporaryDirectory(prefix="r2c2r-journey-") as folder, ExitStack() as parts:
        if options.lab:
            parts.enter_context(laboratory(Path(folder), ray=options.ray))
        figures = journey(options.sample, Path(folder) / "data", heavy_jobs=0 if options.lab else 1)
    slow = figures["upload_to_approval_minutes"] > MOST_MINUTES
    part = "_".join(["journey", *["lab"] * options.lab, *["ray"] * options.ray])
    return report(part, figures, options.json, failed=slow or figures["clicks_per_object"] > MOST_CLICKS)


if __name__ == "__main__":
    sys.exit(main())
