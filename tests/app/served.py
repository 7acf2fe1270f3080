"""An app on a real port of this machine, for what a client in memory cannot show."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import uvicorn
from fastapi import FastAPI

from tests.waiting import until


@contextmanager
def served(app: FastAPI, **options: Any) -> Iterator[int]:
    """The port on which it answers while the block lasts; `options` are uvicorn's."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(app, log_level="warning", proxy_headers=False, **options))
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            until(lambda: server.started or not thread.is_alive())  # uvicorn tells of its start by this flag alone
            assert server.started
            yield listening.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join()
