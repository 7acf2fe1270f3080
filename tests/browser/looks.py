"""Appearance of pages in the light and the dark theme: screenshots, and findings of axe-core."""

import os
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Locator, Page

from tests.waiting import PATIENCE_MS, until

LONG_MS = 4 * PATIENCE_MS  # software GL is slow
PICTURES = os.environ.get("R2C2R_PICTURES")  # a folder in which tests store screenshots of the pages
AXE = Path(__file__).parents[2] / "static" / "node_modules" / "axe-core" / "axe.min.js"
SCROLL = "element => (element.scrollIntoView({ block: 'center', behavior: 'instant' }), element.isConnected)"
SETTLE = "document.getAnimations().forEach((one) => one.effect.getComputedTiming().endTime < Infinity && one.finish())"
FINDINGS = "axe.run({ exclude: ['iframe'] }, { resultTypes: ['violations'] })"  # viser's page is third-party


def each_theme(page: Page) -> Iterator[str]:
    """Show the page in either theme, as when the system changes its own, and then restore the former one."""
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)  # type: ignore[arg-type]
        page.evaluate(SETTLE)
        yield theme
    page.emulate_media(color_scheme="null")


def scroll_to(located: Locator) -> None:
    """Scroll an element into view, again if the page replaces it meanwhile, on which Playwright's own method fails."""
    until(lambda: located.evaluate(SCROLL), f"{located} is replaced all the time")


def picture(page: Page, name: str, *, still: bool = False) -> None:
    """Store a screenshot in either theme; with `still` once two in a row are equal, as software GL is slow."""
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
    """Findings that axe rates serious or critical, in either theme; needs a context with `bypass_csp`."""
    page.add_script_tag(path=AXE) if page.evaluate("typeof axe") == "undefined" else None
    return [
        f"{where}, {theme}: {v['id']} {node['target']} {node.get('failureSummary', '')[:160]}"
        for theme in each_theme(page)
        for v in page.evaluate(FINDINGS)["violations"]
        if v["impact"] in ("serious", "critical")
        for node in v["nodes"]
    ]
