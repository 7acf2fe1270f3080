"""Restartable app with accounts and stand-ins for its slow parts, and helpers to sign people in."""

import shutil
from functools import cache
from pathlib import Path
from typing import Self

from playwright.sync_api import BrowserContext, Page

from app.db.engine import open_engine
from app.services import accounts
from app.settings import DATABASE
from tests.app.conftest import migrated
from tests.browser.stand_in import serve_stand_in
from tests.forked import Forked
from tests.ports import free_port

PASSWORD = "correct horse battery"
PEOPLE = {"ann": "admin", "bea": "reviewer", "cleo": "annotator"}


class Server:
    """The app on its own port, restartable on the same data; Ann, Bea and Cleo have accounts."""

    def __init__(self, data: Path, live: str = "live") -> None:
        self.data, self.port, self.live = data, free_port(), live
        self.process: Forked | None = None
        shutil.copy(_with_people(), data / DATABASE)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process is not None
        self.process.end()  # it ends its workers; those of a killed server would go on

    @property
    def address(self) -> str:
        return f"http://localhost:{self.port}"

    def start(self) -> None:
        self.process = Forked(serve_stand_in, self.data, self.port, self.live, ["localhost"])
        said = self.process.readline()
        if "http://localhost" not in said:
            self.kill()
            raise AssertionError(f"the server did not start: {said}")

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()


@cache
def _with_people() -> Path:
    """A database with the accounts, made once per process, as hashing passwords takes time."""
    path = migrated().with_name("people.db")
    shutil.copy(migrated(), path)
    engine = open_engine(path)
    for name, role in PEOPLE.items():
        accounts.add(engine, name, role, PASSWORD)
    engine.dispose()
    return path


def signed_in(context: BrowserContext, server: Server, name: str, password: str = PASSWORD) -> Page:
    """A page of the person, at the projects."""
    page = context.new_page()
    page.goto(f"{server.address}/login")
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Sign in").click()
    page.get_by_role("heading", name="Projects").wait_for()
    return page


def post(page: Page, path: str, body: dict[str, str]) -> None:
    """POST to the API from the page, with its session."""
    script = """async ([path, body]) => {
      const headers = { "content-type": "application/json", "x-requested-with": "r2c2r" };
      return (await fetch(path, { method: "POST", headers, body: JSON.stringify(body) })).status;
    }"""
    assert page.evaluate(script, [path, body]) in (201, 202)
