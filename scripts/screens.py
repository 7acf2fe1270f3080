"""Pictures of the documentation, made from a real run: `make screens`.

    python -m scripts.screens [--data build/screens]

Reconstructs the sample kitchen as `make demo` does (a second call uses its results again), opens the app on it in Chromium, and
writes annotate.png, elevation.png, review.png, kitchen.png and styles.jpg in docs.
"""

import argparse
import re
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, expect, sync_playwright

from r2c2r_core.cli import main as r2c2r
from r2c2r_core.commands.demo import NAME
from r2c2r_core.synthetic.choices import STYLES, Choice
from r2c2r_core.synthetic.stage import write_sample
from tests.browser.conftest import CHROMIUM, QUIET, served
from tests.browser.test_together import viewed

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGE_PX = {"width": 1280, "height": 720}
LONG_MS = 600_000
REST_MS = 4000
KITCHEN_WIDTH_PX = 1800
STYLE_PX = (320, 240)
STYLE_PALETTES = ("painted", "wood", "painted", "white", "dark", "wood", "painted", "two-tone")
STYLE_COLUMNS = 4


def main() -> int:
    """Make all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT / "build" / "screens")
    data: Path = parser.parse_args().data
    if r2c2r(["demo", "--data", str(data), "--no-serve"]):
        return 1
    draw_kitchen(data / "demo" / "sample" / f"{NAME}.r3d", data / "demo" / "kitchen.zip")
    draw_styles()
    with opened_app(data) as page:
        project = page.url
        photograph_annotate(page, f"{project}/annotate")
        photograph_elevation(page, f"{project}/elevation")
        photograph_review(page, f"{project}/review")
    return 0


def draw_kitchen(scan: Path, bundle: Path) -> None:
    """A photo of the scan beside the bundle's own preview, closed and open."""
    with zipfile.ZipFile(scan) as archive:
        photo = _decoded(archive.read("rgbd/0.jpg"))
    with zipfile.ZipFile(bundle) as archive:
        preview = _decoded(archive.read(next(name for name in archive.namelist() if name.endswith("preview.png"))))
    height = preview.shape[0]
    photo = cv2.resize(photo, (round(photo.shape[1] * height / photo.shape[0]), height), interpolation=cv2.INTER_AREA)
    whole = np.hstack([photo, preview])
    size = (KITCHEN_WIDTH_PX, round(height * KITCHEN_WIDTH_PX / whole.shape[1]))
    cv2.imwrite(str(DOCS / "kitchen.png"), cv2.resize(whole, size, interpolation=cv2.INTER_AREA))


def draw_styles() -> None:
    """One frame of a synthetic kitchen in each style, captioned."""
    pictures = []
    for seed, (style, palette) in enumerate(zip(STYLES, STYLE_PALETTES, strict=True)):
        frames: list[np.ndarray] = []
        with tempfile.TemporaryDirectory() as folder:
            choice = Choice(style=style, palette=palette)
            write_sample(Path(folder), seed=seed, frames=1, size=STYLE_PX, choice=choice, show=frames.append)
        picture = np.ascontiguousarray(frames[0][..., ::-1])
        cv2.rectangle(picture, (0, STYLE_PX[1] - 22), (12 + 9 * len(style), STYLE_PX[1]), (255, 255, 255), cv2.FILLED)
        cv2.putText(picture, style, (5, STYLE_PX[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (32, 32, 32), 1, cv2.LINE_AA)
        pictures.append(picture)
    rows = [np.hstack(pictures[k : k + STYLE_COLUMNS]) for k in range(0, len(pictures), STYLE_COLUMNS)]
    cv2.imwrite(str(DOCS / "styles.jpg"), np.vstack(rows))


@contextmanager
def opened_app(data: Path) -> Iterator[Page]:
    """Overview of the demo's project, in a Chromium that is signed in to the app on this data folder."""
    expect.set_options(timeout=LONG_MS)
    with served(data) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        page = browser.new_page(viewport=PAGE_PX)
        page.set_default_timeout(LONG_MS)
        page.goto(address)
        page.get_by_role("link", name=NAME).first.click()
        page.wait_for_url("**/p/*")
        yield page
        browser.close()


def photograph_annotate(page: Page, address: str) -> None:
    """Annotate with all masks, and an object chosen."""
    page.goto(address)
    expect(page.locator(".transport .chip").first).to_have_text("ready")
    page.locator(".object-list > li").nth(2).locator(".pick").click()
    expect(page.get_by_text(re.compile(r"from \d+ frames"))).to_be_visible()
    photograph_at_rest(page, DOCS / "annotate.png")


def photograph_elevation(page: Page, address: str) -> None:
    """Elevation of the units, to scale."""
    page.goto(address)
    page.get_by_text("6 fronts").wait_for()
    expect(page.get_by_text("Loading")).to_be_hidden()
    photograph_at_rest(page, DOCS / "elevation.png")


def photograph_review(page: Page, address: str) -> None:
    """Review with the scene in 3D, opened, and the candidates of a cabinet."""
    page.goto(address)
    page.get_by_role("button", name="Scene", exact=True).click()
    page.get_by_role("button", name="cabinet_1").first.click()
    page.get_by_role("button", name="Open all").click()
    viewed(page)
    photograph_at_rest(page, DOCS / "review.png")


def photograph_at_rest(page: Page, path: Path) -> None:
    """Photograph a page once it stays the same for REST_MS, as a software GL draws slowly."""
    last = b""
    while (now := page.screenshot()) != last:
        last = now
        page.wait_for_timeout(REST_MS)
    path.write_bytes(now)


def _decoded(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


if __name__ == "__main__":
    sys.exit(main())
