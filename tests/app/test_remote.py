"""Remote client with a token: upload, click, run, wait and download."""

import json
import os
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from app.main import create_app
from app.services import tokens
from app.settings import Settings
from r2c2r_core import client
from r2c2r_core.cli import main
from r2c2r_core.client import Refused, Server
from r2c2r_core.errors import EnvironmentProblem, InputError
from tests.app.conftest import FAKE_COMMANDS
from tests.app.served import served
from tests.app.test_imports import R3D

PROMPTS = {
    "version": 1,
    "objects": [{"name": "drawer_1", "category": "drawer", "points": [{"frame": 3, "x": 10.0, "y": 20.0, "label": 1}]}],
}


class Served:
    """An app on a port, and an API token for it."""

    def __init__(self, tmp_path: Path) -> None:
        settings = Settings(data_dir=tmp_path / "data", host="127.0.0.1", min_free_bytes=0, job_memory_bytes=0)
        self.app = create_app(settings, commands=FAKE_COMMANDS)

    def token(self, scope: str = "annotator") -> str:
        return tokens.add(self.app.state.context.engine, None, "a script", scope)[0]


@pytest.fixture
def remote(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    found = Served(tmp_path)
    monkeypatch.setattr(client, "PAUSE_S", 0.0)
    monkeypatch.setattr(client, "ASK_EVERY_S", 0.05)
    with served(found.app) as port:
        monkeypatch.setenv("R2C2R_SERVER", f"http://127.0.0.1:{port}")
        monkeypatch.setenv("R2C2R_TOKEN", found.token())
        yield found


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    path = tmp_path / "kitchen.r3d"
    path.write_bytes(R3D)
    return path


def test_the_remote_commands_turn_a_recording_into_a_bundle(
    remote: Served, scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prompts, bundle = tmp_path / "prompts.json", tmp_path / "kitchen.zip"
    prompts.write_text(json.dumps(PROMPTS))
    assert main(["remote", "upload", str(scan), "--name", "Aunt's"]) == 0
    project = capsys.readouterr().out.strip()
    assert main(["remote", "wait", project]) == 0
    assert main(["remote", "click", project, str(prompts)]) == 0
    assert "drawer_1: drawer" in capsys.readouterr().out
    assert main(["remote", "run", project]) == 0
    assert main(["remote", "wait", project]) == 0
    assert main(["remote", "list"]) == 0
    assert "Aunt's  ready" in capsys.readouterr().out
    assert main(["remote", "download", project, "-o", str(bundle)]) == 0
    kept = tmp_path / "data" / "projects" / project / "bundles" / "v1.zip"
    assert bundle.read_bytes() == kept.read_bytes()
    assert not bundle.with_name("kitchen.zip.part").exists()


def test_a_project_is_exported_and_uploaded_as_one_file(
    remote: Served, scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prompts, file = tmp_path / "prompts.json", tmp_path / "kitchen.r2c2r.zip"
    prompts.write_text(json.dumps(PROMPTS))
    assert main(["remote", "upload", str(scan)]) == 0
    project = capsys.readouterr().out.strip()
    assert main(["remote", "wait", project]) == 0
    assert main(["remote", "click", project, str(prompts)]) == 0
    assert main(["remote", "export", project, "-o", str(file), "--recording"]) == 0
    capsys.readouterr()
    assert main(["remote", "upload", str(file)]) == 0
    other = capsys.readouterr().out.strip()
    assert main(["remote", "wait", other]) == 0
    objects = Server(os.environ["R2C2R_SERVER"], os.environ["R2C2R_TOKEN"])._json("GET", f"/api/projects/{other}/objects")
    assert [item["name"] for item in objects] == ["drawer_1"]
    scan.unlink()
    assert main(["remote", "export", "none", "-o", str(file)]) == 2


def test_waiting_for_a_failed_job_prints_its_reason(remote: Served, scan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = scan.with_name("broken.r3d")
    scan.rename(broken)
    assert main(["remote", "upload", str(broken)]) == 0
    project = capsys.readouterr().out.strip()
    assert main(["remote", "wait", project]) == 1
    assert "no depth in it; record again" in capsys.readouterr().err


def test_missing_wrong_and_read_only_tokens_are_refused(
    remote: Served, scan: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setenv("R2C2R_TOKEN", remote.token("read"))
    assert main(["remote", "upload", str(scan)]) == 2
    assert "this token allows only read" in capsys.readouterr().err
    monkeypatch.setenv("R2C2R_TOKEN", "r2c2r_wrong")
    assert main(["remote", "list"]) == 2
    monkeypatch.delenv("R2C2R_TOKEN")
    assert main(["remote", "list"]) == 2
    assert "R2C2R_TOKEN is not set" in capsys.readouterr().err


def test_an_interrupted_upload_resumes_at_its_offset(
    remote: Served, scan: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(client, "PIECE_BYTES", 100)
    server = Server(os.environ["R2C2R_SERVER"], os.environ["R2C2R_TOKEN"])
    sent: list[int] = []
    send = server._send_piece

    def breaks_off(where: str, at: int, piece: bytes) -> int:
        if len(sent) == 2:
            raise EnvironmentProblem("the line is cut")
        sent.append(at)
        return send(where, at, piece)

    monkeypatch.setattr(server, "_send_piece", breaks_off)
    with pytest.raises(EnvironmentProblem):
        server.upload(scan)
    again: list[int] = []
    monkeypatch.setattr(server, "_send_piece", lambda where, at, piece: again.append(at) or send(where, at, piece))
    project = server.upload(scan)
    assert (sent, again[0]) == ([0, 100], 200)
    assert (tmp_path / "data" / "projects" / project / "source" / "kitchen.r3d").read_bytes() == R3D


class Stub(BaseHTTPRequestHandler):
    """HTTP stub that returns the test's responses and records requests."""

    answers: list[Callable[["Stub"], None]]
    asked: list[tuple[str, dict[str, str]]]

    def do_GET(self) -> None:
        self.asked.append((self.path, {name.lower(): value for name, value in self.headers.items()}))
        self.rfile.read(int(self.headers.get("content-length", 0)))
        self.answers.pop(0)(self)

    do_POST = do_GET  # noqa: N815  # the name is the base class's

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def stub(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Server, type[Stub]]]:
    monkeypatch.setattr(client, "PAUSE_S", 0.0)
    handler = type("OfThisTest", (Stub,), {"answers": [], "asked": []})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield Server(f"http://127.0.0.1:{server.server_address[1]}", "r2c2r_secret"), handler
        server.shutdown()


def says(status: int, body: Any, **headers: str) -> Callable[[Stub], None]:
    def answer(stub: Stub) -> None:
        content = body if isinstance(body, bytes) else json.dumps(body).encode()
        stub.send_response(status)
        for name, value in {"Content-Length": str(len(content)), **headers}.items():
            stub.send_header(name, value)
        stub.end_headers()
        stub.wfile.write(content)

    return answer


def hangs_up(stub: Stub) -> None:
    stub.close_connection = True


def test_retried_requests_keep_their_idempotency_key(stub: tuple[Server, type[Stub]]) -> None:
    server, handler = stub
    handler.answers = [hangs_up, says(503, b"a proxy's page"), says(202, {"id": 7})]
    assert server.run("p") == 7
    keys = {headers["idempotency-key"] for _, headers in handler.asked}
    assert (len(handler.asked), len(keys)) == (3, 1)


def test_the_token_is_not_sent_to_another_host_on_redirect(stub: tuple[Server, type[Stub]], tmp_path: Path) -> None:
    server, handler = stub
    content, elsewhere = b"PK of a bundle", server.address.replace("127.0.0.1", "localhost")
    handler.answers = [
        says(200, [{"version": 1, "size": len(content)}]),
        says(302, b"", Location=f"{elsewhere}/store?signed=1"),
        says(200, content),
    ]
    assert server.download("p", tmp_path / "kitchen.zip") == 1
    assert (tmp_path / "kitchen.zip").read_bytes() == content
    assert ["authorization" in headers for _, headers in handler.asked] == [True, True, False]


def test_an_incomplete_download_keeps_the_existing_file(stub: tuple[Server, type[Stub]], tmp_path: Path) -> None:
    server, handler = stub
    kept = tmp_path / "kitchen.zip"
    kept.write_bytes(b"the one before")
    handler.answers = [says(200, [{"version": 1, "size": 100}])] + [says(200, b"half")] * client.TRIES
    with pytest.raises(EnvironmentProblem, match="4 of 100 bytes"):
        server.download("p", kept)
    assert [path.name for path in tmp_path.iterdir()] == ["kitchen.zip"]
    assert kept.read_bytes() == b"the one before"


def test_responses_that_are_not_from_r2c2r_raise(stub: tuple[Server, type[Stub]]) -> None:
    server, handler = stub
    handler.answers = [says(404, b"<html>nginx"), says(200, b"<html>hello")]
    with pytest.raises(Refused, match="404"):
        server.projects()
    with pytest.raises(EnvironmentProblem, match="not from r2c2r"):
        server.projects()


@pytest.mark.parametrize("address", ["kitchens.example", "ftp://kitchens.example", "http://", "file:///etc/passwd"])
def test_an_invalid_server_address_is_rejected(address: str) -> None:
    with pytest.raises(InputError, match="not a server's address"):
        Server(address, "r2c2r_x")
