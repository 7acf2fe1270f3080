"""Fixtures of browser tests: a served app and a real Chromium."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from app.settings import DATABASE
from tests.app.conftest import migrated
from tests.browser.serving import REMEMBER, NewContext, printed_again, served
from tests.browser.together import Server
from tests.waiting import PATIENCE_MS

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")  # the first takes two thirds of the time
CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)

expect.set_options(timeout=PATIENCE_MS)

QUIET = [  # otherwise Chromium contacts its vendor's servers; a software GL draws the 3D view
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "tests/browser" in str(item.path):
            item.add_marker(pytest.mark.browser)
            if CHROMIUM is None and not os.environ.get("R2C2R_REQUIRE_ALL"):
                item.add_marker(pytest.mark.skip(reason="no Chromium on this machine"))


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """The app on a free port, with an empty database."""
    data = tmp_path / "served"
    data.mkdir()
    shutil.copy(migrated(), data / DATABASE)
    with served(data) as found:
        yield found


@pytest.fixture(scope="package")  # its event loop must end with the browser tests: others start their own
def browser() -> Iterator[Browser]:
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=PATIENCE_MS) as opened,
    ):
        yield opened


@pytest.fixture
def new_context(browser: Browser) -> Iterator[NewContext]:
    """Factory of contexts that end with the test, by default of 1280 x 720 pixels."""
    with ExitStack() as opened:

        def make(**how: Any) -> BrowserContext:
            context = opened.enter_context(browser.new_context(**how))
            context.set_default_timeout(PATIENCE_MS)
            context.set_default_navigation_timeout(PATIENCE_MS)
            context.add_init_script(REMEMBER)
            return context

        yield make


@pytest.fixture
def page(address: str, new_context: NewContext) -> Iterator[Page]:
    """A signed-in page that fails the test if our code throws an error."""
    opened = new_context().new_page()
    thrown: list[str] = []
    opened.on("pageerror", lambda error: thrown.append(str(error)))
    opened.goto(printed_again(address))
    yield opened
    assert thrown == []


@pytest.fixture
def live() -> str:
    """Name of the stand-in live segmenter in tests/app/fakes that `server` runs; modules may override it."""
    return "live"


@pytest.fixture
def scenes() -> bool:
    """Whether `server` draws 3D views; tests that look at them override it."""
    return False


@pytest.fixture(scope="session")
def servers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str, bool], Server]]:
    """Running servers of this process, by live segmenter and whether they draw 3D views; each starts when first asked for."""
    with ExitStack() as running:

        @cache
        def started(live: str, scenes: bool) -> Server:
            return running.enter_context(Server(tmp_path_factory.mktemp("data"), live, scenes=scenes))

        yield started


@pytest.fixture
def server(servers: Callable[[str, bool], Server], live: str, scenes: bool) -> Server:
    """An app without projects, with stand-ins for its slow parts and accounts of Ann, Bea and Cleo.

    Tests that kill it, or change more than projects, take `own_server`.
    """
    found = servers(live, scenes)
    found.clear()
    return found


@pytest.fixture
def own_server(tmp_path: Path, live: str) -> Iterator[Server]:
    """Like `server`, for one test."""
    data = tmp_path / "data"
    data.mkdir()
    with Server(data, live) as running:
        yield running
