import io
import json
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from app.serve import serve
from r2c2r_core.cli import main
from r2c2r_core.errors import EnvironmentProblem
from tests.app.conftest import Running


def test_a_taken_port_is_one_line_with_the_next_step(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(EnvironmentProblem) as caught:
            serve(host="127.0.0.1", port=port, data_dir=tmp_path)
    assert str(port) in caught.value.message
    assert "--port" in caught.value.hint
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("host", "names"), [("0.0.0.0", []), ("::", []), ("127.0.0.1", ["kitchens.example"])])
def test_other_machines_are_not_let_in_by_accident(tmp_path: Path, host: str, names: list[str]) -> None:
    with pytest.raises(EnvironmentProblem, match="nobody has an account"):
        serve(host=host, port=0, data_dir=tmp_path, names=names)


def test_accounts_are_made_and_changed_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def user(*words: str, said: str = "") -> tuple[int, str]:
        monkeypatch.setattr("sys.stdin", io.StringIO(said))
        code = main(["user", *words, "--data", str(tmp_path)])
        captured = capsys.readouterr()
        return code, captured.out + captured.err

    assert user("add", "Ann", "--role", "admin", said="three plain words\n") == (0, "")
    assert user("role", "ann", "reviewer") == (0, "")
    assert "ann   reviewer" in user("list")[1]
    for words, said, part in (
        (("add", "ann"), "three plain words", "already"),
        (("add", "bob"), "short", "5 characters"),
        (("add", "bob", "--role", "king"), "three plain words", "no role"),
        (("add", "../bob"), "three plain words", "no name"),
        (("remove", "eve"), "", "no account eve"),
    ):
        code, text = user(*words, said=said)
        assert (code > 0, text.count("\n"), part in text) == (True, 1, True), text
    assert user("remove", "ann") == (0, "")
    assert "ann" not in user("list")[1]


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(EnvironmentProblem):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path / "file" / "data")


def test_the_server_prints_its_address_and_holds_its_folder(tmp_path: Path) -> None:
    call = f"serve(host='127.0.0.1', port=0, data_dir=Path({str(tmp_path)!r}))"
    code = f"from pathlib import Path; from app.serve import serve; {call}"
    server = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = server.stdout.readline().split(" ", 1)[1].strip()
        assert address.startswith("http://127.0.0.1:")
        Running.until(lambda: _answers(address))
        with pytest.raises(EnvironmentProblem, match=f"process {server.pid}"):
            serve(host="127.0.0.1", port=0, data_dir=tmp_path)
    finally:
        server.terminate()
        assert server.wait(timeout=60) in (0, -15)
        server.stdout.close()  # type: ignore[union-attr]


def _answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(f"{address.split('/?')[0]}/api/health", timeout=60) as answer:
            return bool(json.load(answer)["state"] == "ok")
    except OSError:
        return False
