"""Isolation of programs that read untrusted files."""

import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from r2c2r_core.alone import network_can_be_left
from tests.waiting import PATIENCE_S

PROGRAM = """
import os, pathlib, socket, sys
print(sorted(os.listdir()), os.getcwd())
pathlib.Path(sys.argv[1]).write_text("ours stays ours")
try:
    socket.create_connection(("127.0.0.1", int(sys.argv[2]))).close()
    print("heard")
except OSError as error:
    print("refused", error)
"""


def alone(folder: Path, *arguments: object) -> list[str]:
    """Output of the program, run from a folder with other files."""
    (folder / "looks_around.py").write_text(PROGRAM)
    command = [sys.executable, "-m", "r2c2r_core.alone", "looks_around", *map(str, arguments)]
    known = {**os.environ, "PYTHONPATH": f"{Path(__file__).parents[2]}{os.pathsep}{folder}"}
    said = subprocess.run(command, cwd=folder, env=known, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    return said.stdout.splitlines()


def test_the_sandbox_folder_starts_empty_and_is_deleted(tmp_path: Path) -> None:
    listing, folder = alone(tmp_path, tmp_path / "made", 9)[0].split(" ", 1)
    assert listing == "[]"
    assert Path(folder).parent == Path(tempfile.gettempdir()).resolve()
    assert not Path(folder).exists()
    assert (tmp_path / "made").read_text() == "ours stays ours"


def test_the_sandbox_cannot_reach_local_servers(tmp_path: Path) -> None:
    if not network_can_be_left():
        pytest.skip("this system lets no process leave its network")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S).close()  # reachable from this process
        assert alone(tmp_path, tmp_path / "made", port)[1].startswith("refused")
