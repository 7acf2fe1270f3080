"""App served on a free port over a data folder, its printed addresses, and helpers that wait for its pages."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from playwright.sync_api import BrowserContext, FloatRect, Locator, Page, expect

from app.serve import new_address, serve
from tests.browser.stand_in import serve_stand_in
from tests.forked import forked
from tests.waiting import until

NewContext = Callable[..., BrowserContext]
"""Takes what `Browser.new_context` takes."""

STEADY = 4  # number of equal positions in a row
REMEMBER = """new MutationObserver((changes) => {
  const added = changes.flatMap(({ addedNodes }) => [...addedNodes]);
  const toasts = added.filter((node) => node instanceof Element && node.matches(".toast") && node.checkVisibility());
  (window.toasted ??= []).push(...toasts.map((toast) => toast.textContent));
}).observe(document, { childList: true, subtree: true });"""
TAKE = """(text) => {
  const found = (window.toasted ?? []).findIndex((said) => said.includes(text));
  return found >= 0 && window.toasted.splice(found, 1);
}"""

_folders: dict[str, Path] = {}  # of running servers, by address


def printed_again(address: str) -> str:
    """A further printed address of the same server: each signs in one browser."""
    return new_address(_folders[address.split("?")[0]])


@contextmanager
def served(data: Path, *, stand_ins: bool = False) -> Iterator[str]:
    """The app on a free port over a data folder, maybe with stand-ins for its slow parts; the address it prints."""
    run = partial(serve_stand_in, live="live", scenes=False, names=()) if stand_ins else partial(serve, host="127.0.0.1")
    with forked(run, port=0, data_dir=data) as server:
        line = server.readline()
        found = re.search(r"(http://\S+?/)\S*", line)
        assert found, line
        _folders[found.group(1)] = data
        yield found.group()


def box_of(locator: Locator) -> FloatRect:
    """Bounding box on the screen once it is stable, as the layout changes while pages are filled."""
    seen: list[FloatRect | None] = []

    def stays() -> bool:
        expect(locator).to_be_visible()
        seen.append(locator.bounding_box())
        return len(seen) >= STEADY and all(box == seen[-1] for box in seen[-STEADY:]) and seen[-1] is not None

    until(stays, f"{locator} does not stay in one place")
    assert seen[-1] is not None
    return seen[-1]


def wait_for_toast(page: Page, text: str) -> None:
    """Wait until the page has shown this toast, even if it is gone by now; each counts once."""
    page.wait_for_function(TAKE, arg=text)


def drawn(page: Page) -> None:
    """Wait until the page has rendered its current state."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
