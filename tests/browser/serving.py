"""The app served on a free port over a data folder, and its printed addresses."""

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import FloatRect, Locator, expect

from app.serve import new_address

PATIENCE_MS = 180_000  # a busy machine that draws 3D in software; nothing waits longer than what it waits for takes

_folders: dict[str, Path] = {}  # of running servers, by their addresses


def printed_again(address: str) -> str:
    """Another printed address of the same server: each opens one browser."""
    return new_address(_folders[address.split("?")[0]])


@contextmanager
def served(data: Path) -> Iterator[str]:
    """The app on a free port over a data folder; the address it prints."""
    serve = f"serve(host='127.0.0.1', port=0, data_dir=Path({str(data)!r}))"
    code = f"from pathlib import Path; from app.serve import serve; {serve}"
    server = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    line = server.stdout.readline()
    found = re.search(r"(http://\S+?/)\S*", line)
    assert found, line
    _folders[found.group(1)] = data
    yield found.group()
    server.terminate()
    server.wait(timeout=60)
    server.stdout.close()


def box_of(locator: Locator) -> FloatRect:
    """Where it is on the screen, once it stays there: pages are laid out while they are filled."""
    until, before = time.monotonic() + PATIENCE_MS / 1000, None
    while time.monotonic() < until:
        expect(locator).to_be_visible()
        box = locator.bounding_box()
        if box and box == before:
            return box
        before = box
        locator.page.wait_for_timeout(50)
    raise AssertionError(f"{locator} does not stay in one place: {before}")
