"""Frame latency while ten people scrub a project at once, over loopback, each on their own connection.

    python benchmarks/scrubbing.py [--people 10] [--steps 200] [--json benchmarks/app.json]

A project of full-size frames (960x720 of a 1920x1440 recording would be shown) is scrubbed back and forth without any cache;
each step requests the next frame when the previous one has arrived. The first pass makes the previews; both passes are
reported, and the time to the first frame of the annotate page in a Chromium without a cache.
"""

import argparse
import json
import random
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import httpx2 as httpx
import numpy as np
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(1, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report
from kill_journey import Journey
from kill_server import Server
from waiting import until

from tests.browser.conftest import CHROMIUM, QUIET

FRAMES = 60
SIZE = (1440, 1920)  # rows, columns
VISITS = 5
FRAME_IS_DRAWN = """() => {
  const canvas = document.querySelector("r2c2r-frame-canvas canvas");
  if (!canvas?.width) return 0;
  const pixel = canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data;
  return pixel[3] ? performance.now() : 0;
}"""


def scrub(folder: Path, people: int, steps: int) -> dict[str, Any]:
    """Milliseconds per frame, in the first pass and later ones, and the slowest response of the API meanwhile."""
    server = Server(folder / "data", real=False)
    server.start()
    journey = Journey(server, random.Random(0), None)
    try:
        journey.sign_in()
        project = journey.ask("POST", "/api/projects/sample", json={})["id"]
        until(lambda: journey.ask("GET", f"/api/projects/{project}")["status"] == "ready", 300)
        _full_size_frames(folder / "data" / "projects" / project)
        address = f"{server.address}/media/{project}/frames"
        cookies = dict(journey.client.cookies)
        first = _together(address, cookies, people=1, steps=FRAMES, stride=1)
        later = _together(address, cookies, people=people, steps=steps, stride=None)
        shown = _page_to_first_frame(cookies, f"{server.address}/p/{project}/annotate")
    finally:
        journey.client.close()
        server.stop()
    return {"people": people, "steps_each": steps, "first_pass": first, "all_at_once": later, "page_to_first_frame": shown}


def _full_size_frames(project: Path) -> None:
    """Textured pictures of the size that a phone records."""
    rng = np.random.default_rng(0)
    table = []
    for index in range(FRAMES):
        coarse = rng.integers(0, 255, (60, 80, 3), dtype=np.uint8)
        picture = cv2.resize(coarse, SIZE[::-1], interpolation=cv2.INTER_CUBIC)
        path = project / "work" / "capture" / "rgb" / f"{index:06d}.jpg"
        cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, 90])
        facts = {"index": index, "timestamp_s": index / 10, "width": SIZE[1], "height": SIZE[0], "sharpness": 1.0}
        table.append({**facts, "camera": [0.0, 0.0, 1.5]})
    (project / "frames.json").write_text(json.dumps(table))


def _together(address: str, cookies: dict[str, str], *, people: int, steps: int, stride: int | None) -> dict[str, float]:
    taken: list[float] = []
    began = time.monotonic()
    threads = [threading.Thread(target=_person, args=(address, cookies, n, steps, stride, taken)) for n in range(people)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wall = time.monotonic() - began
    figures = {f"p{q}_ms": round(float(np.percentile(taken, q)) * 1000, 1) for q in (50, 95, 99)}
    return {**figures, "frames_per_s": round(len(taken) / wall, 1)}


def _page_to_first_frame(cookies: dict[str, str], address: str) -> dict[str, float]:
    """Milliseconds from requesting the annotate page to its first frame on the canvas, in browsers with an empty cache."""
    taken = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        for _ in range(VISITS):
            context = browser.new_context(viewport={"width": 1280, "height": 720})
            context.add_cookies([{"name": name, "value": value, "url": address} for name, value in cookies.items()])
            page = context.new_page()
            page.goto(address, wait_until="commit")
            taken.append(page.wait_for_function(FRAME_IS_DRAWN, polling="raf", timeout=120_000).json_value())
            context.close()
        browser.close()
    return {"p50_ms": round(float(np.median(taken))), "worst_ms": round(max(taken))}


def _person(address: str, cookies: dict[str, str], number: int, steps: int, stride: int | None, taken: list[float]) -> None:
    rng, at = random.Random(number), number * 7 % FRAMES
    with httpx.Client(cookies=cookies, timeout=60) as client:
        for step in range(steps):
            at = step % FRAMES if stride else (at + rng.choice((-1, 1, 1, 1))) % FRAMES
            began = time.monotonic()
            answer = client.get(f"{address}/{at}.jpg", params={"w": 960, "v": "1"})
            taken.append(time.monotonic() - began)
            assert answer.status_code == 200, answer.text[:200]
            assert answer.content[:2] == b"\xff\xd8"


def main() -> int:
    """Scrub, report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--steps", type=int, default=200)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-scrub-") as folder:
        figures = scrub(Path(folder), options.people, options.steps)
    return report("scrubbing", figures, options.json)


if __name__ == "__main__":
    sys.exit(main())
