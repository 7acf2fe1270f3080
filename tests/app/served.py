"""An app on a real port, for tests that an in-memory client cannot serve."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI

from app.main import create_app
from app.settings import Settings
from app.work import run_jobs
from tests.app.conftest import FAKE_COMMANDS
from tests.waiting import until

UNLIMITED = {"min_free_bytes": 0, "job_memory_bytes": 0}


@contextmanager
def served(app: FastAPI, **options: Any) -> Iterator[int]:
    """The port on which the app answers within the block; `options` are uvicorn's."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(app, log_level="warning", proxy_headers=False, **options))
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            until(lambda: server.started or not thread.is_alive())  # uvicorn signals its start only by this flag
            assert server.started
            yield listening.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join()


def serve_fakes(data: Path, port: int = 0) -> None:
    """Serve the app with stand-in workers in a process of its own, until it is killed."""
    settings = Settings(data_dir=data, launch_token="key", import_roots=(data.parent,), **UNLIMITED)  # type: ignore[arg-type]
    uvicorn.run(create_app(settings, commands=FAKE_COMMANDS), host="127.0.0.1", port=port, log_level="critical")


def take_jobs(data: Path, options: dict[str, Any]) -> None:
    """`r2c2r work` with stand-in workers in a process of its own, until it is killed."""
    run_jobs(Settings(data_dir=data, **UNLIMITED, **options), FAKE_COMMANDS, threading.Event())
