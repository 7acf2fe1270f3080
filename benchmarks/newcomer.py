"""Time from opening the sample kitchen to its first pictures, masks and proposals, in a real Chromium.

    python benchmarks/newcomer.py [--json benchmarks/app.json] [--picture FILE]

From the click on "Open the sample kitchen": its first picture, the page that reports it as read, then Annotate with the first
mask, with all masks, and with the last proposal. --picture saves a screenshot of Annotate at the end. Exit status 1: no picture
within 5 s, or no mask within 60 s.
"""

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import expect, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report

from tests.browser.conftest import CHROMIUM, QUIET, served

MOST_S = {"first_picture_s": 5.0, "first_mask_s": 60.0}
LONG_MS = 600_000


def newcomer(data: Path, picture: Path | None) -> dict[str, Any]:
    """Seconds from the first click to each milestone."""
    expect.set_options(timeout=LONG_MS)
    figures: dict[str, Any] = {}
    with served(data) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        page.set_default_timeout(LONG_MS)
        page.goto(address)
        page.get_by_role("button", name="Open the sample kitchen").click()
        began = time.monotonic()

        def seen(what: str) -> None:
            figures[what] = round(time.monotonic() - began, 1)

        expect(page.get_by_alt_text("The frame that was rendered last")).to_be_visible()
        seen("first_picture_s")
        page.get_by_role("heading", name="The recording").wait_for()
        seen("read_s")
        page.get_by_role("link", name="Annotate").click()
        rows = page.locator(".object-list > li")
        expect(page.get_by_role("img", name=re.compile("seen in [1-9]")).first).to_be_visible()
        seen("first_mask_s")
        expect(page.locator(".transport .chip").first).to_have_text("ready")
        seen("all_masks_s")
        figures["objects"] = rows.count()
        expect(page.get_by_label("Looking for objects")).to_be_hidden()
        seen("proposals_s")
        if picture is not None:
            rows.nth(2).locator(".pick").click()
            expect(page.get_by_text("from 10 frames")).to_be_visible()
            page.screenshot(path=picture)
        browser.close()
    return figures


def main() -> int:
    """Measure and report; 1 if a bar was missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-newcomer-") as folder:
        figures = newcomer(Path(folder), options.picture)
    return report("newcomer", figures, options.json, failed=any(figures[name] > most for name, most in MOST_S.items()))


if __name__ == "__main__":
    sys.exit(main())
