"""Overload by one person's expensive requests: others are still served, and the server still shuts down."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import anyio
import httpx2 as httpx
import psutil
import pytest
from sqlmodel import select

from app.db.engine import open_engine, reading
from app.db.tables import Upload
from app.errors import TooMany
from app.gates import Gate
from app.services import accounts
from tests.app.conftest import Running
from tests.app.test_uploads import archive
from tests.waiting import LOOK_S, PATIENCE_S

ROOT = Path(__file__).parents[2]
CROWD = 44  # more than the 40 threads that requests share
PASSWORD = "three plain words"
SERVER = """
import sys
from functools import partial
from pathlib import Path
from app import serve
from app.main import create_app
from app.settings import Settings
from app.viewer.client import Viewer
from tests.app.conftest import FAKE_COMMANDS, PATIENT, fake
data = Path(sys.argv[1])
viewer = Viewer(Settings(data_dir=data, **PATIENT), fake("viewer"))
vars(serve)["create_app"] = partial(create_app, commands=FAKE_COMMANDS, viewer_client=viewer)
serve.serve(host="127.0.0.1", port=0, data_dir=data)
"""


def test_heavy_requests_of_one_person_do_not_block_others_or_shutdown(tmp_path: Path) -> None:
    with (
        ThreadPoolExecutor(2 * CROWD) as crowd,  # closed last: its requests end with the server
        served(tmp_path) as (server, printed),
        browser(printed) as ann,
        browser(printed) as eve,
    ):
        ann.get(printed)
        project = ann.post("/api/projects/sample", json={}).json()["id"]
        uploads = [uploaded(ann, f"{n}.r3d", archive(("endless", b"%d" % n))) for n in range(CROWD)]
        Running.until(lambda: ann.get(f"/api/projects/{project}").json()["status"] == "ready")
        answers = Answers()
        show = f"/api/projects/{project}/viewer/show"
        for upload in uploads:
            crowd.submit(answers.ask, ann, f"/api/uploads/{upload}/finish", None)
            crowd.submit(answers.ask, ann, show, {"mode": "cloud", "opacity": 0.321})
        for path in ("finish", "show"):  # 4 of each are accepted, and never end
            Running.until(lambda path=path: answers.count(path) == CROWD - 4)  # type: ignore[misc]
        assert {status for _, status, _ in answers.all} == {429}
        assert all(int(retry) > 0 for _, _, retry in answers.all)
        assert eve.get("/api/health").json() == {"state": "ok"}
        for _ in range(50):  # more than threads
            assert ann.get("/api/system").status_code == 200
        assert eve.post("/api/login", json={"name": "eve", "password": PASSWORD}).status_code == 204
        theirs = uploaded(eve, "good.r3d", archive(("frame", b"x")))
        assert eve.post(f"/api/uploads/{theirs}/finish").status_code == 202  # queued behind one of Ann's at most
        helpers = helpers_of(server)
        assert len(helpers) > 1  # at least a probe and the 3D view
        server.terminate()
        assert server.wait(timeout=PATIENCE_S) in (0, -15)
        assert psutil.wait_procs(helpers, timeout=PATIENCE_S)[1] == []
    engine = open_engine(tmp_path / "r2c2r.db")
    with reading(engine) as session:
        assert set(session.exec(select(Upload.id))) == set(uploads)  # uploads that could not be examined are kept
    engine.dispose()


def test_a_gate_runs_one_task_per_person_and_refuses_beyond_their_quota() -> None:
    async def scene() -> None:
        gate = Gate("looks", at_once=2, each=3, retry_s=7)
        going, done, most = threading.Event(), list[str](), list[int]()
        at_work: list[str] = []

        def work(who: str) -> str:
            at_work.append(who)
            most.append(at_work.count("ann"))
            going.wait(PATIENCE_S)
            at_work.remove(who)
            return who

        async def ask(who: str) -> None:
            done.append(await gate.run(who, work, who))

        async with anyio.create_task_group() as group:
            for who in ("ann", "ann", "ann", "bob"):
                group.start_soon(ask, who)
            try:
                with anyio.fail_after(PATIENCE_S):
                    while sorted(at_work) != ["ann", "bob"]:
                        await anyio.sleep(LOOK_S)
                with pytest.raises(TooMany, match="3 looks are already running") as refused:
                    await gate.run("ann", work, "ann")
                assert refused.value.retry_s == 7
            finally:
                going.set()
        assert (sorted(done), max(most)) == (["ann", "ann", "ann", "bob"], 1)
        assert gate._askers == {}
        assert await gate.run("ann", work, "ann") == "ann"

    anyio.run(scene)


class Answers:
    """(path's last word, status, Retry-After) of received responses."""

    def __init__(self) -> None:
        self.all: list[tuple[str, int, str]] = []

    def ask(self, client: httpx.Client, path: str, body: Any) -> None:
        with suppress(httpx.HTTPError):  # the server has ended
            answer = client.post(path, json=body)
            self.all.append((path.rsplit("/", 1)[1], answer.status_code, answer.headers.get("retry-after", "0")))

    def count(self, path: str) -> int:
        return sum(last == path for last, _, _ in tuple(self.all))


def browser(address: str) -> httpx.Client:
    limits = httpx.Limits(max_connections=2 * CROWD + 1)
    said = {"X-Requested-With": "tests"}
    return httpx.Client(base_url=address.split("/?")[0], headers=said, timeout=PATIENCE_S, limits=limits)


def uploaded(client: httpx.Client, name: str, content: bytes) -> str:
    upload = client.post("/api/uploads", json={"file_name": name, "size": len(content)}).json()["id"]
    assert client.patch(f"/api/uploads/{upload}", content=content, headers={"Upload-Offset": "0"}).status_code == 204
    return str(upload)


@contextmanager
def served(data: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server with stand-ins for its slow parts and an account for Eve; the address that it prints."""
    engine = open_engine(data / "r2c2r.db")
    accounts.add(engine, "eve", "annotator", PASSWORD)
    engine.dispose()
    words = [sys.executable, "-c", SERVER, str(data)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    server = subprocess.Popen(words, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert server.stdout is not None
        yield server, server.stdout.readline().split(" ", 1)[1].strip()
    finally:
        helpers = helpers_of(server)
        server.kill()
        server.wait()
        for each in helpers:
            with suppress(psutil.NoSuchProcess):
                each.kill()
        server.stdout.close()  # type: ignore[union-attr]


def helpers_of(server: subprocess.Popen[str]) -> list[psutil.Process]:
    """Running processes that it started; empty for a server that has ended."""
    try:
        return psutil.Process(server.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
