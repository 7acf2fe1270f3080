"""Health endpoints for supervisors, without a session."""

import sqlite3

from sqlalchemy.exc import OperationalError
from starlette.testclient import TestClient

from tests.app.conftest import ORIGIN, Running, refusing


def test_a_server_without_database_is_alive_but_not_ready(web: Running) -> None:
    stranger = TestClient(web.app, base_url=ORIGIN, raise_server_exceptions=False)

    def asked(path: str) -> int:
        return int(stranger.get(path).status_code)

    assert (asked("/healthz"), asked("/readyz")) == (200, 200)
    away = sqlite3.OperationalError("database is locked")
    away.sqlite_errorcode = sqlite3.SQLITE_BUSY
    with refusing(web.context.engine, OperationalError("BEGIN", None, away)):
        assert (asked("/healthz"), asked("/readyz")) == (200, 503)
        assert stranger.get("/readyz").json()["kind"] == "unavailable"
    assert asked("/readyz") == 200


def test_health_endpoints_reveal_only_the_state_without_a_session(web: Running) -> None:
    stranger = TestClient(web.app, base_url=ORIGIN)
    assert stranger.get("/readyz").json() == {"state": "ready"}
    assert stranger.get("/readyz/projects").status_code in (401, 404)
    assert stranger.get("/healthz", headers={"host": "elsewhere.example"}).status_code == 421
