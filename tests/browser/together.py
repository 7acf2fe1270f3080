"""Restartable app with accounts and stand-ins for its slow parts, and helpers to sign people in."""

import shutil
from functools import cache
from pathlib import Path
from typing import Any, Self

import httpx2
from playwright.sync_api import BrowserContext, Page

from app.db.engine import open_engine
from app.services import accounts
from app.settings import DATABASE
from tests.app.conftest import migrated
from tests.browser.stand_in import serve_stand_in
from tests.forked import Forked
from tests.ports import free_port
from tests.waiting import PATIENCE_S

PASSWORD = "correct horse battery"
PEOPLE = {"ann": "admin", "bea": "reviewer", "cleo": "annotator"}
EMPTY = "/static/icons/logo.svg"  # a page that loads nothing else
ASK = """async ([method, path, body]) => {
  const options = { method, headers: { "content-type": "application/json", "x-requested-with": "r2c2r" } };
  const answer = await fetch(path, body === null ? options : { ...options, body: JSON.stringify(body) });
  return [answer.status, answer.status === 204 ? null : await answer.json()];
}"""


class Server:
    """The app on its own port, restartable on the same data; Ann, Bea and Cleo have accounts.

    `live` is the live segmenter among tests/app/fakes; 3D views are empty unless there are `scenes`.
    """

    def __init__(self, data: Path, live: str = "live", *, scenes: bool = False) -> None:
        self.data, self.port, self.live, self.scenes = data, free_port(), live, scenes
        self.process: Forked | None = None
        self._clients: dict[str, httpx2.Client] = {}
        shutil.copy(_with_people(), data / DATABASE)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process is not None
        for client in self._clients.values():
            client.close()
        self.process.end()  # it ends its workers; those of a killed server would go on

    @property
    def address(self) -> str:
        return f"http://localhost:{self.port}"

    def start(self) -> None:
        how = {"live": self.live, "scenes": self.scenes, "names": ["localhost"]}
        self.process = Forked(serve_stand_in, data_dir=self.data, port=self.port, **how)
        said = self.process.readline()
        if "http://localhost" not in said:
            self.kill()
            raise AssertionError(f"the server did not start: {said}")

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()

    def client(self, name: str) -> httpx2.Client:
        """A client of the person, who signs in once per server, as checking passwords takes time."""
        if name not in self._clients:
            headers = {"x-requested-with": "tests", "origin": self.address}
            anew = httpx2.Limits(max_keepalive_connections=0)  # the server may close an idle one just as it is used
            made = self._clients[name] = httpx2.Client(base_url=self.address, headers=headers, timeout=PATIENCE_S, limits=anew)
            made.post("/api/login", json={"name": name, "password": PASSWORD}).raise_for_status()
        return self._clients[name]

    def clear(self) -> None:
        """Delete every project, with its running jobs and processes."""
        admin = self.client("ann")
        for place in ("projects", "trash"):
            for found in admin.get(f"/api/{place}").raise_for_status().json():
                admin.delete(f"/api/{place}/{found['id']}").raise_for_status()


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


def signed_in(context: BrowserContext, server: Server, name: str) -> Page:
    """An empty page of the person, who is signed in."""
    cookies = server.client(name).cookies.jar
    context.add_cookies([{"name": one.name, "value": one.value or "", "url": server.address} for one in cookies])
    page = context.new_page()
    page.goto(f"{server.address}{EMPTY}")
    return page


def ask(page: Page, method: str, path: str, body: Any = None) -> Any:
    """What the API answers to the page, with its session."""
    status, answer = page.evaluate(ASK, [method, path, body])
    assert status < 400, answer
    return answer


def post(page: Page, path: str, body: dict[str, Any]) -> None:
    """POST to the API from the page, with its session."""
    ask(page, "POST", path, body)
