"""How a page looks in the light and in the dark theme: its screenshots, and what axe-core says of it."""

import os
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Page

from tests.waiting import PATIENCE_MS, until

LONG_MS = 4 * PATIENCE_MS  # a software GL draws when it can
PICTURES = os.environ.get("R2C2R_PICTURES")  # a folder: tests leave screenshots of the pages there
AXE = Path(__file__).parents[2] / "static" / "node_modules" / "axe-core" / "axe.min.js"
SETTLE = "document.getAnimations().forEach((one) => one.effect.getComputedTiming().endTime < Infinity && one.finish())"
FINDINGS = "axe.run({ exclude: ['iframe'] }, { resultTypes: ['violations'] })"  # viser's own page is not ours to mend


def each_theme(page: Page) -> Iterator[str]:
    """Show the page in either theme, as when the system changes its own; afterwards in the one it had."""
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)  # type: ignore[arg-type]
        page.evaluate(SETTLE)
        yield theme
    page.emulate_media(color_scheme="null")


def picture(page: Page, name: str, *, still: bool = False) -> None:
    """Leave a screenshot in either theme; a still one when two in a row are alike, as a software GL draws when it can."""
    if not PICTURES:
        return
    for theme in each_theme(page):
        taken = [b""]

        def taken_twice(taken: list[bytes] = taken) -> bool:
            taken.append(page.screenshot(timeout=LONG_MS))
            return not still or taken[-1] == taken[-2]

        until(taken_twice, f"{name} goes on changing")
        Path(f"{PICTURES}/{name}-{theme}.png").write_bytes(taken[-1])


def serious(page: Page, where: str) -> list[str]:
    """What axe calls serious or critical in either theme; its context needs `bypass_csp`."""
    page.add_script_tag(path=AXE) if page.evaluate("typeof axe") == "undefined" else None
    return [
        f"{where}, {theme}: {v['id']} {node['target']} {node.get('failureSummary', '')[:160]}"
        for theme in each_theme(page)
        for v in page.evaluate(FINDINGS)["violations"]
        if v["impact"] in ("serious", "critical")
        for node in v["nodes"]
    ]
