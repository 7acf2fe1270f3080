"""API tokens: limited to their scope, revocable, and unable to create further tokens."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import select
from starlette.testclient import TestClient

from app.db.engine import reading, writing
from app.db.tables import ApiToken
from app.services import accounts, tokens
from r2c2r_core.cli import main
from tests.app.conftest import ORIGIN, SOCKETS, Running
from tests.app.people import PASSWORD, signed_in, with_accounts
from tests.app.test_people import closed_with


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with with_accounts(tmp_path_factory.mktemp("tokens") / "data") as web:
        yield web


def program(web: Running, secret: str, **headers: str) -> TestClient:
    """A client that sends its token and no page-specific headers."""
    given = {"Authorization": f"Bearer {secret}", **headers}
    return TestClient(web.app, base_url=ORIGIN, headers=given, raise_server_exceptions=False)


def made(web: Running, owner: str, scope: str) -> Any:
    with signed_in(web, owner) as client:
        answer = client.post("/api/tokens", json={"name": "of a script", "scope": scope})
        assert answer.status_code == 201, answer.text
        return answer.json()


def test_a_token_acts_as_its_owner_without_cookie_or_csrf_header(shared: Running) -> None:
    client = program(shared, made(shared, "the-reviewer", "reviewer")["secret"])
    system = client.get("/api/system").json()
    assert (system["user"], system["role"]) == ("the-reviewer", "reviewer")
    project = client.post("/api/projects/sample", json={}).json()["id"]
    shared.until(lambda: client.get(f"/api/projects/{project}").json()["status"] == "ready")
    assert client.patch(f"/api/projects/{project}", json={"name": "Scripted"}).status_code == 200
    assert client.get(f"/api/projects/{project}/history").json()[0]["who"] == "the-reviewer"


@pytest.mark.parametrize(
    ("scope", "reads", "writes", "metrics", "administers"),
    [
        ("metrics", 403, 403, 200, 403),
        ("read", 200, 403, 403, 403),
        ("annotator", 200, 422, 403, 403),
        ("admin", 200, 422, 200, 200),
    ],
)
def test_a_scope_allows_exactly_its_operations(
    shared: Running, scope: str, reads: int, writes: int, metrics: int, administers: int
) -> None:
    client = program(shared, made(shared, "the-admin", scope)["secret"])
    assert client.get("/api/projects").status_code == reads
    assert client.post("/api/projects/sample", json={"frames": "many"}).status_code == writes
    assert client.get("/metrics").status_code == metrics
    assert client.get("/api/accounts").status_code == administers


def test_a_scope_cannot_exceed_the_current_role_of_its_owner(shared: Running) -> None:
    with signed_in(shared, "the-annotator") as client:
        for scope in ("reviewer", "admin", "metrics"):
            assert client.post("/api/tokens", json={"name": "n", "scope": scope}).status_code == 403
    accounts.add(shared.context.engine, "promoted", "reviewer", PASSWORD)
    secret = made(shared, "promoted", "reviewer")["secret"]
    accounts.change(shared.context.engine, "promoted", role="annotator")
    assert program(shared, secret).get("/api/system").json()["role"] == "annotator"
    accounts.remove(shared.context.engine, "promoted")
    shared.context.people.look_again()
    assert program(shared, secret).get("/api/system").status_code == 401


def test_a_token_cannot_create_or_revoke_tokens(shared: Running) -> None:
    token = made(shared, "the-admin", "admin")
    client = program(shared, token["secret"])
    assert client.post("/api/tokens", json={"name": "n"}).status_code == 403
    assert client.delete(f"/api/tokens/{token['id']}").status_code == 403


def test_the_secret_of_a_token_is_not_stored_or_listed(shared: Running) -> None:
    token = made(shared, "the-annotator", "read")
    program(shared, token["secret"]).get("/api/projects")
    with reading(shared.context.engine) as session:
        row = session.get_one(ApiToken, token["id"])
        assert token["secret"] not in str(row.model_dump())
        assert row.used is not None
    with signed_in(shared, "the-annotator") as client:
        assert "secret" not in client.get("/api/tokens").text
        assert {shown["owner"] for shown in client.get("/api/tokens").json()} == {"the-annotator"}  # other tests made more


def test_revoking_a_token_ends_its_access_and_connections(shared: Running) -> None:
    token = made(shared, "the-annotator", "annotator")
    client = program(shared, token["secret"])
    with signed_in(shared, "the-reviewer") as other:
        assert other.delete(f"/api/tokens/{token['id']}").status_code == 404
    with client.websocket_connect(f"{SOCKETS}/api/live") as socket:
        socket.receive_json()
        with signed_in(shared, "the-annotator") as mine:
            assert mine.delete(f"/api/tokens/{token['id']}").status_code == 204
        assert closed_with(socket) == 4401
    assert client.get("/api/projects").status_code == 401
    with signed_in(shared, "the-admin") as admin:
        record = admin.get("/api/audit").json()["entries"]
    assert next(entry["action"] for entry in record if entry["action"].startswith("token")) == "token revoked"


@pytest.mark.parametrize("authorization", ["Bearer r2c2r_wrong", "Bearer ", "Basic cjpj", "Bearer other", "bearer\tr2c2r_x"])
def test_an_invalid_token_is_unauthorized(shared: Running, authorization: str) -> None:
    client = TestClient(shared.app, base_url=ORIGIN, headers={"Authorization": authorization})
    assert client.get("/api/projects").status_code == 401
    assert client.post("/api/projects/sample", json={}).status_code in (401, 403)


def test_a_token_is_refused_from_a_foreign_origin(shared: Running) -> None:
    secret = made(shared, "the-annotator", "annotator")["secret"]
    assert program(shared, secret, Origin="http://elsewhere.example").get("/api/projects").status_code == 403


def test_tokens_are_created_listed_and_revoked_on_the_command_line(
    web: Running, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = ["--data", str(web.settings.data_dir)]
    assert main(["token", "add", "night runs", "--scope", "admin", *data]) == 0
    secret = capsys.readouterr().out.strip()
    assert program(web, secret).get("/api/system").json()["user"] == "tester"
    assert main(["token", "list", *data]) == 0
    assert "night runs" in capsys.readouterr().out
    with reading(web.context.engine) as session:
        number = session.exec(select(ApiToken.id)).one()
    assert main(["token", "revoke", str(number), *data]) == 0
    web.context.people.look_again()
    assert program(web, secret).get("/api/system").status_code == 401
    assert main(["token", "add", "n", "--scope", "everything", *data]) == 2
    assert "is no scope" in capsys.readouterr().err


def test_tokens_beyond_the_maximum_number_are_refused(web: Running) -> None:
    with writing(web.context.engine) as session:
        for number in range(tokens.MOST):
            session.add(ApiToken(digest=str(number), name="n", scope="read", created=0.0))
    assert web.client.post("/api/tokens", json={"name": "n"}).status_code == 422
