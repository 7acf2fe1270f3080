"""A server with accounts, and the people who sign in to it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from starlette.testclient import TestClient

from app.services import accounts
from tests.app.conftest import ORIGIN, Running, running

PASSWORD = "correct horse battery"


@contextmanager
def with_accounts(data: Path) -> Iterator[Running]:
    """A server that others can reach, and three accounts whose passwords are hashed quickly."""
    quick = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    with pytest.MonkeyPatch.context() as patch, running(data, accounts_only=True) as web:
        patch.setattr(accounts, "_hasher", lambda: quick)
        for role in ("annotator", "reviewer", "admin"):
            accounts.add(web.context.engine, f"the-{role}", role, PASSWORD)
        yield web


@contextmanager
def signed_in(web: Running, name: str) -> Iterator[TestClient]:
    client = browser(web)
    assert client.post("/api/login", json={"name": name, "password": PASSWORD}).status_code == 204
    yield client
    client.post("/api/logout")


def browser(web: Running) -> TestClient:
    headers = {"X-Requested-With": "tests"}
    return TestClient(web.app, base_url=ORIGIN, headers=headers, raise_server_exceptions=False)
