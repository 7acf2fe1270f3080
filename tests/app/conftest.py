"""Fixtures with an app of their own, whose workers are stand-ins controlled by the tests."""

import asyncio
import atexit
import shutil
import sqlite3
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from sqlalchemy import URL, Connection, Engine, event
from starlette.testclient import TestClient

from app.db.engine import open_engine
from app.jobs.plans import Commands
from app.main import create_app
from app.services import descriptions, launch_keys
from app.services.context import Context
from app.settings import DATABASE, Settings
from app.viewer.client import Viewer
from tests.app import postgres
from tests.app.object_server import ObjectServer, object_server
from tests.app.postgres import PostgresServer
from tests.waiting import PATIENCE_S, until

FAKES = Path(__file__).parent / "fakes"
ORIGIN = "http://127.0.0.1:8000"
SOCKETS = "ws://127.0.0.1:8000"
COOKIE = "r2c2r_session_8000"


def fake(name: str, *options: str) -> tuple[str, ...]:
    return sys.executable, *options, str(FAKES / f"{name}.py")


BARE = "-IS"  # no site packages: starts in a third of the time
FAKE_COMMANDS = Commands(
    probe=fake("probe", BARE),
    worker=fake("worker", BARE),
    ingest=fake("ingest", BARE),
    sample=fake("sample", BARE),
    vary=fake("vary", BARE),
    live=fake("live"),
)


descriptions.PAUSE_S = 0.05  # tests wait for project.json; at 2 s, its usual pace, they would take a minute longer
PATIENT = {"viewer_answer_s": PATIENCE_S, "viewer_page_s": PATIENCE_S, "busy_s": PATIENCE_S}  # settings for a slow machine


@dataclass
class Running:
    """A started app, a signed-in client, and shorthands."""

    app: FastAPI
    client: TestClient
    settings: Settings
    plain: bool = False  # all settings and stand-ins are the tests' usual ones

    @property
    def context(self) -> Context:
        context: Context = self.app.state.context
        return context

    def printed(self) -> str:
        """A further printed address, without its host."""
        return f"/?token={launch_keys.new(self.context.engine)}"

    def get(self, path: str, status: int = 200, **options: Any) -> Any:
        return self._checked(self.client.get(path, **options), status)

    def post(self, path: str, body: Any = None, status: int | None = None, **options: Any) -> Any:
        answer = self.client.post(path, json=body, **options) if body is not None else self.client.post(path, **options)
        return self._checked(answer, status)

    def patch(self, path: str, body: Any, status: int = 200) -> Any:
        return self._checked(self.client.patch(path, json=body), status)

    def delete(self, path: str, status: int = 200) -> Any:
        return self._checked(self.client.delete(path), status)

    def sample(self) -> str:
        """Id of a ready project with the objects drawer_1 and mug_1; the first one of a plain app is a copy."""
        return copy_sample(self.settings) if self.plain and not self.get("/api/projects") else self.import_sample()

    def import_sample(self) -> str:
        """The same, imported by the jobs of this app."""
        project = self.post("/api/projects/sample", {}, 202)["id"]
        self.until(lambda: self.get(f"/api/projects/{project}")["status"] == "ready")
        return str(project)

    def job(self, job: int, *states: str) -> Any:
        """Wait until the job is in one of the states; return it."""
        self.until(lambda: self.get(f"/api/jobs/{job}")["state"] in states)
        return self.get(f"/api/jobs/{job}")

    @staticmethod
    def until(condition: Callable[[], object]) -> None:
        until(condition)

    @staticmethod
    def _checked(answer: Any, status: int | None) -> Any:
        wanted = (status,) if status else (200, 201, 202)
        assert answer.status_code in wanted, f"{answer.status_code}: {answer.text[:500]}"
        return answer.json()


@cache
def migrated() -> Path:
    """A database without rows, migrated to the newest tables once per process."""
    folder = Path(tempfile.mkdtemp(prefix="r2c2r-db-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    open_engine(folder / DATABASE).dispose()
    return folder / DATABASE


COPIED = ("projects", "jobs", "job_events", "objects", "prompt_points", "events")  # tables with rows of an imported sample


@cache
def imported() -> tuple[Path, str]:
    """Data folder of an app that has imported the sample, and the project's id; made once per process."""
    folder = Path(tempfile.mkdtemp(prefix="r2c2r-sample-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    with running(folder / "data") as web:
        return folder / "data", web.import_sample()


def copy_sample(settings: Settings) -> str:
    """Id of the sample's project, copied with its files and rows into the data folder of an app without projects."""
    made, project = imported()
    folder = shutil.copytree(made / "projects" / project, settings.data_dir / "projects" / project)
    facts = folder / "facts.json"
    facts.write_text(facts.read_text().replace(str(made), str(settings.data_dir)))
    with closing(sqlite3.connect(settings.database)) as rows, rows:
        rows.execute("ATTACH ? AS made", [str(made / DATABASE)])
        for table in COPIED:
            rows.execute(f"INSERT INTO main.{table} SELECT * FROM made.{table}")
        for table, column in (("projects", "source_path"), ("jobs", "log_path")):
            rows.execute(f"UPDATE {table} SET {column} = replace({column}, ?, ?)", [str(made), str(settings.data_dir)])
    return project


@contextmanager
def running(
    data_dir: Path, commands: Commands = FAKE_COMMANDS, viewer: Viewer | None = None, **options: Any
) -> Iterator[Running]:
    """The app on a data folder, and a client that opened the printed address."""
    given = {
        "host": "127.0.0.1",
        "min_free_bytes": 0,
        "job_memory_bytes": 0,
        "kill_grace_s": 0.5,
        "beat_s": 3600.0,  # no heartbeats among the statements that a test counts
        "prepare_imports": False,
        "user": "tester",
        "import_roots": (data_dir.parent,),
        **PATIENT,
    }
    rows = {"postgres": _POSTGRES[-1].of_folder(data_dir)} if _POSTGRES else {}
    settings = Settings(data_dir=data_dir, **{**given, **rows, **options})
    if not data_dir.exists() and not settings.postgres:
        data_dir.mkdir(parents=True)
        shutil.copy(migrated(), settings.database)
    app = create_app(settings, commands=commands, viewer_client=viewer)
    with TestClient(app, base_url=ORIGIN, headers={"X-Requested-With": "tests"}, raise_server_exceptions=False) as client:
        client.get(f"/?token={settings.launch_token}")
        plain = commands is FAKE_COMMANDS and viewer is None and not options and not settings.postgres
        yield Running(app, client, settings, plain)
        blocked = [stack for database, stack in ASKED_ON_THE_LOOP if database == app.state.context.engine.url]
        assert blocked == [], "everybody waited for the database"


_POSTGRES: list[PostgresServer] = []  # the server of the current test, if it uses Postgres
ASKED_ON_THE_LOOP: list[tuple[URL, str]] = []
"""The database, and what asked it on the thread of an event loop, where everybody waits for the answer."""
_COUNTED: dict[URL, list[str]] = {}  # statements sent to a database while a test counts them
_COMMITTED: dict[URL, list[Connection]] = {}  # commits of a database while a test counts them
_SILENT: dict[URL, Exception] = {}  # errors that a database raises instead of starting a transaction


@contextmanager
def statements(engine: Engine) -> Iterator[list[str]]:
    """Statements sent to the database within the block, by any thread."""
    _COUNTED[engine.url] = []
    try:
        yield _COUNTED[engine.url]
    finally:
        del _COUNTED[engine.url]


@contextmanager
def commits(engine: Engine) -> Iterator[list[Connection]]:
    """Transactions committed within the block, by any thread except those that run jobs, which send heartbeats."""
    _COMMITTED[engine.url] = []
    try:
        yield _COMMITTED[engine.url]
    finally:
        del _COMMITTED[engine.url]


@contextmanager
def refusing(engine: Engine, error: Exception) -> Iterator[None]:
    """Make the database refuse every transaction within the block."""
    _SILENT[engine.url] = error
    try:
        yield
    finally:
        del _SILENT[engine.url]


# Listeners are on the class and set before any engine exists: an engine used by threads accepts none later, nor does its class
@event.listens_for(Engine, "before_cursor_execute")
def _note_statement(connection: Connection, _cursor: object, statement: str, *_: object) -> None:
    if (counted := _COUNTED.get(connection.engine.url)) is not None:
        counted.append(statement)


@event.listens_for(Engine, "commit")
def _note_commit(connection: Connection) -> None:
    counted = _COMMITTED.get(connection.engine.url)
    if counted is not None and not threading.current_thread().name.startswith("jobs-"):
        counted.append(connection)


@event.listens_for(Engine, "begin")
def _refuse(connection: Connection) -> None:
    if (error := _SILENT.get(connection.engine.url)) is not None:
        raise error


@event.listens_for(Engine, "begin")
def _note_where_asked(connection: Connection) -> None:
    with suppress(RuntimeError):  # no loop runs on this thread, as expected
        asyncio.get_running_loop()
        ASKED_ON_THE_LOOP.append((connection.engine.url, "".join(traceback.format_stack(limit=12))))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Tests that start the app run on SQLite, and also on Postgres where the outcome could differ."""
    starts = "start" in metafunc.fixturenames or hasattr(metafunc.module, "running")
    if starts and (wanted := metafunc.definition.get_closest_marker("both_databases")):
        marks = () if wanted.kwargs.get("quick", True) else (pytest.mark.slow,)
        metafunc.parametrize("rows_in", ["sqlite", pytest.param("postgres", marks=marks)], indirect=True)


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[PostgresServer]:
    with postgres.server() as found:
        yield found


@pytest.fixture(scope="session")
def s3() -> Iterator[ObjectServer]:
    """An S3 server for all tests: each keeps its files below a name of its own."""
    with object_server() as found:
        yield found


@pytest.fixture(autouse=True)
def rows_in(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Database of this test's apps; commands that it runs get that of the folder used by `start`."""
    if getattr(request, "param", "sqlite") == "sqlite":
        yield
        return
    found: PostgresServer = request.getfixturevalue("postgres_server")
    monkeypatch.setenv("R2C2R_DATABASE", found.of_folder(tmp_path / "data"))
    _POSTGRES.append(found)
    yield
    _POSTGRES.clear()
    found.drop_all()


@pytest.fixture
def start(tmp_path: Path) -> Callable[..., Any]:
    """Start the app on this test's data folder; may be called again, as a restart."""
    if not _POSTGRES:
        imported()  # now, before the test replaces parts of the import

    def begin(**options: Any) -> Any:
        return running(tmp_path / "data", **options)

    return begin


@pytest.fixture
def web(start: Callable[..., Any]) -> Iterator[Running]:
    with start() as found:
        yield found


@pytest.fixture(scope="session")
def shared_web(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """One app with the sample's project, for all tests that only read."""
    with running(tmp_path_factory.mktemp("shared") / "data") as found:
        found.sample()
        yield found
