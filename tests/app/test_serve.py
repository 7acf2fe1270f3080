import io
import json
import pwd
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from app.db.engine import open_engine
from app.privacy import without_places
from app.serve import serve
from app.services import accounts, audit
from app.settings import Settings
from r2c2r_core.cli import main
from r2c2r_core.errors import EnvironmentProblem, InputError
from tests.app.conftest import Running, running
from tests.app.nouns import finish
from tests.forked import forked
from tests.waiting import PATIENCE_S


def test_a_port_in_use_is_reported_in_one_line_with_a_hint(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(EnvironmentProblem) as caught:
            serve(host="127.0.0.1", port=port, data_dir=tmp_path)
    assert str(port) in caught.value.message
    assert "--port" in caught.value.hint
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("host", "names"), [("0.0.0.0", []), ("::", []), ("127.0.0.1", ["kitchens.example"])])
def test_serving_other_machines_without_accounts_is_refused(tmp_path: Path, host: str, names: list[str]) -> None:
    with pytest.raises(EnvironmentProblem, match="nobody has an account"):
        serve(host=host, port=0, data_dir=tmp_path, names=names)


def test_accounts_are_managed_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def user(*words: str, said: str = "") -> tuple[int, str]:
        monkeypatch.setattr("sys.stdin", io.StringIO(said))
        code = main(["user", *words, "--data", str(tmp_path)])
        captured = capsys.readouterr()
        return code, captured.out + captured.err

    assert user("add", "Ann", "--role", "admin", said="three plain words\n") == (0, "")
    assert "only admin" in user("role", "ann", "reviewer")[1]
    assert user("add", "Zoe", "--role", "admin", said="three plain words\n") == (0, "")
    assert user("role", "ann", "reviewer") == (0, "")
    assert "ann   reviewer" in user("list")[1]
    for words, said, part in (
        (("add", "ann"), "three plain words", "already"),
        (("add", "bob"), "short", "5 characters"),
        (("add", "bob"), "bob1234567", "own name"),
        (("remove", "zoe"), "", "only admin"),
        (("add", "bob", "--role", "king"), "three plain words", "no role"),
        (("add", "../bob"), "three plain words", "not a valid account name"),
        (("remove", "eve"), "", "no account eve"),
    ):
        code, text = user(*words, said=said)
        assert (code > 0, text.count("\n"), part in text) == (True, 1, True), text
    assert user("remove", "ann") == (0, "")
    assert "ann" not in user("list")[1]


def test_a_data_folder_that_cannot_be_created_is_reported_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main(["serve", "--port", "0", "--data", str(tmp_path / "file" / "data")]) == EnvironmentProblem.exit_code
    captured = capsys.readouterr()
    (line,) = (captured.out + captured.err).splitlines()
    assert "file/data: Not a directory; choose another folder with --data" in line


def test_a_demo_that_is_not_served_leaves_a_project_titled_like_its_bundle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def film(out: Path, **_: Any) -> None:  # without the recording itself, which only a re-reading needs
        out.mkdir(parents=True)
        (out / "prompts.json").write_text('{"version": 1, "objects": []}')

    def write_bundle(scan: Path, prompts: Path, destination: Path, *, workdir: Path) -> bool:
        finish(workdir)
        titles.append(scan.stem)  # the name that ingest gives a recording
        return True

    titles: list[str] = []
    monkeypatch.setattr("r2c2r_core.commands.demo.write_recording", film)
    monkeypatch.setattr("r2c2r_core.commands.demo.write_bundle", write_bundle)
    assert main(["demo", "--no-serve", "--data", str(tmp_path)]) == 0
    with running(tmp_path) as web:
        (project,) = web.get("/api/projects")
        assert (project["name"], project["status"]) == ("Sample kitchen", "ready")
        assert titles == [project["name"]]


def test_the_server_prints_its_address_and_locks_its_data_folder(tmp_path: Path) -> None:
    with forked(serve, host="127.0.0.1", port=0, data_dir=tmp_path) as server:
        address = server.readline().split(" ", 1)[1].strip()
        assert address.startswith("http://127.0.0.1:")
        Running.until(lambda: _answers(address))
        with pytest.raises(EnvironmentProblem, match=f"process {server.pid}"):
            serve(host="127.0.0.1", port=0, data_dir=tmp_path)
        assert server.end() in (0, -15)


def test_r2c2r_key_prints_single_use_addresses_of_a_running_server(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def key() -> tuple[int, str]:
        code = main(["key", "--data", str(tmp_path)])
        captured = capsys.readouterr()
        return code, (captured.out or captured.err).strip()

    code, said = key()
    assert (code > 0, "no r2c2r serves" in said, said.count("\n")) == (True, True, 0)
    with served(tmp_path) as address:
        early = key()[1]  # while the server is starting: forgotten keys are those of earlier servers
        Running.until(lambda: _answers(address))
        assert [_status(early), _status(address), _status(address)] == [200, 200, 401]
        code, printed = key()
        assert (code, printed.split("token=")[0]) == (0, address.split("token=")[0])
        assert [_status(printed), _status(printed)] == [200, 401]
        left = key()[1].split("/?")[1]
    with served(tmp_path) as address:
        Running.until(lambda: _answers(address))
        assert _status(f"{address.split('/?')[0]}/?{left}") == 401
    accounts.add(engine := open_engine(tmp_path / "r2c2r.db"), "ann", "admin", "three plain words")
    engine.dispose()
    with served(tmp_path, names=["localhost"]) as address:
        Running.until(lambda: _answers(address))
        assert "sign in to this server by name" in key()[1]


def test_forwarded_client_addresses_are_used_only_from_a_trusted_proxy(tmp_path: Path) -> None:
    for behind, seen in (([], "127.0.0.1"), (["127.0.0.1"], "203.0.113.7"), (["10.0.0.0/8"], "127.0.0.1")):
        data = tmp_path / "-".join(["data", *behind]).replace("/", "_")
        data.mkdir()
        accounts.add(engine := open_engine(data / "r2c2r.db"), "ann", "admin", "three plain words")
        with served(data, names=["localhost"], behind_proxy=behind) as address:
            Running.until(lambda address=address: _answers(address))  # type: ignore[misc]
            headers = {"X-Requested-With": "t", "X-Forwarded-For": "203.0.113.7", "Content-Type": "application/json"}
            wrong = json.dumps({"name": "ann", "password": "x"}).encode()
            request = urllib.request.Request(f"{address.rstrip('/')}/api/login", wrong, headers)
            with pytest.raises(urllib.error.HTTPError, match="401"):
                urllib.request.urlopen(request, timeout=PATIENCE_S)
        (refused,) = [entry for entry in audit.entries(engine, None, 50).entries if entry.action == "refused"]
        assert refused.client == seen
        engine.dispose()


@pytest.mark.parametrize("address", ["proxy.example", "*", "10.0.0.1/8", ""])
def test_an_invalid_proxy_address_is_refused(tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match="--behind-proxy"):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path, behind_proxy=[address])


@contextmanager
def served(data: Path, **options: Any) -> Iterator[str]:
    """A server in its own process; the address it prints."""
    with forked(serve, host="127.0.0.1", port=0, data_dir=data, **options) as server:
        yield server.readline().split(" ", 1)[1].strip()


def _status(address: str) -> int:
    """HTTP status for a client without cookies."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    try:
        with browser.open(address, timeout=PATIENCE_S) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def _answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(f"{address.split('/?')[0].rstrip('/')}/api/health", timeout=PATIENCE_S) as answer:
            return bool(json.load(answer)["state"] == "ok")
    except OSError:
        return False


def test_import_from_adds_an_import_root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class _StoppedError(Exception):
        """Raised before anything is served."""

    roots: list[Path] = []

    def create(settings: Settings) -> None:
        roots.extend(settings.roots)
        raise _StoppedError

    monkeypatch.setattr("app.serve.create_app", create)
    scans = tmp_path / "scans"
    scans.mkdir()
    with pytest.raises(_StoppedError):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path / "data", import_from=[scans])
    assert roots == [Path.home(), tmp_path / "data", scans]


def test_a_missing_import_folder_is_reported_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--data", str(tmp_path), "--import-from", str(tmp_path / "none")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "none: no such file or folder" in line


def test_without_a_home_folder_recordings_are_imported_from_the_data_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Settings(data_dir=tmp_path).roots == (Path.home(), tmp_path)
    monkeypatch.setenv("HOME", "/")  # of a service: not the whole disk
    assert Settings(data_dir=tmp_path).roots == (tmp_path,)
    monkeypatch.delenv("HOME")
    monkeypatch.setattr(pwd, "getpwuid", {}.__getitem__)
    assert Settings(data_dir=tmp_path).roots == (tmp_path,)
    monkeypatch.setattr(Path, "cwd", lambda: tmp_path.joinpath("deleted").resolve(strict=True))
    assert without_places(f"{tmp_path}/a", Settings(data_dir=tmp_path)) == "…/a"
