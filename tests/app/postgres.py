"""Postgres for tests: one server per session in its own folder, and a cloned database for each data folder."""

import hashlib
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from app.db.engine import open_engine
from tests.waiting import PATIENCE_S, until

TEMPLATE = "template_r2c2r"
FAST = ("fsync=off", "synchronous_commit=off", "full_page_writes=off", "shared_buffers=32MB", "max_connections=200")
REQUIRED = bool(os.environ.get("R2C2R_REQUIRE_ALL"))


class PostgresServer:
    """A server reachable only through a socket in its folder."""

    def __init__(self, folder: Path, pid: int) -> None:
        self.folder, self.pid = folder, pid
        self.made: set[str] = set()

    def address(self, name: str) -> str:
        return f"postgresql+psycopg://postgres@/{name}?host={self.folder}"

    def of_folder(self, data_dir: Path) -> str:
        """Address of a data folder's database; created on first request with tables and without rows."""
        name = f"r2c2r_{hashlib.sha256(str(data_dir).encode()).hexdigest()[:16]}"
        if name not in self.made:
            self.run(f"CREATE DATABASE {name} TEMPLATE {TEMPLATE}")
            self.made.add(name)
        return self.address(name)

    def drop_all(self) -> None:
        for name in self.made:
            self.run(f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")
        self.made.clear()

    def run(self, statement: str) -> None:
        import psycopg

        with psycopg.connect(f"host={self.folder} user=postgres dbname=postgres", autocommit=True) as connection:
            connection.execute(statement)


def programs() -> Path | None:
    """Folder of initdb and postgres; Debian keeps them out of the PATH."""
    found = [*Path("/usr/lib/postgresql").glob("*/bin/initdb"), *map(Path, filter(None, [shutil.which("initdb")]))]
    return max(found, default=Path()).parent if found else None


@contextmanager
def server(given: Sequence[str] = FAST) -> Iterator[PostgresServer]:
    """A running server with these options; skips if it is not installed, unless everything is required."""
    bin_folder = programs()
    if bin_folder is None:
        missing = "no Postgres here: apt-get install postgresql"
        pytest.fail(missing) if REQUIRED else pytest.skip(missing)
    if not REQUIRED:
        pytest.importorskip("psycopg", reason="no psycopg: pip install 'r2c2r[postgres]'")
    folder = Path(tempfile.mkdtemp(prefix="r2c2r-pg-"))  # not pytest's: a socket's path has at most 107 characters
    user = "postgres" if os.geteuid() == 0 else None  # it refuses to be run by root
    if user:
        shutil.chown(folder, user)
    quiet = {"stdout": subprocess.DEVNULL, "user": user, "cwd": folder}
    data = str(folder / "data")
    subprocess.run(
        [bin_folder / "initdb", "-D", data, "-U", "postgres", "-A", "trust", "-E", "UTF8", "--locale=C", "--no-sync"],
        check=True,
        **quiet,  # type: ignore[call-overload]
    )
    options = [part for option in ("listen_addresses=", f"unix_socket_directories={folder}", *given) for part in ("-c", option)]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [bin_folder / "postgres", "-D", data, *options],
            stderr=log,
            **quiet,  # type: ignore[call-overload]
        )
    try:
        found = PostgresServer(folder, process.pid)
        _wait(found, process)
        found.run(f"CREATE DATABASE {TEMPLATE}")
        open_engine(found.address(TEMPLATE)).dispose()
        yield found
    finally:
        process.send_signal(signal.SIGINT)  # it closes its connections instead of waiting for them
        try:
            process.wait(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        shutil.rmtree(folder, ignore_errors=True)


def _wait(found: PostgresServer, process: "subprocess.Popen[bytes]") -> None:
    import psycopg

    def answers() -> bool:
        assert process.poll() is None, (found.folder / "log").read_text()
        with suppress(psycopg.OperationalError):
            found.run("SELECT 1")
            return True
        return False

    until(answers, "Postgres does not answer")
