"""Invalid file paths."""

import os
from pathlib import Path

import pytest

from r2c2r_core.disk import is_below, resolved
from r2c2r_core.errors import InputError


@pytest.mark.parametrize("name", ["a\0b", "n" * 300, "loop/inside"])
def test_an_impossible_path_raises_a_one_line_error(tmp_path: Path, name: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError, match="check the path") as said:
        resolved(tmp_path / name)
    assert "\n" not in str(said.value)
    assert "\0" not in str(said.value)


def test_a_path_that_does_not_exist_yet_is_resolved(tmp_path: Path) -> None:
    assert resolved(tmp_path / "new" / ".." / "folder") == Path(os.path.realpath(tmp_path)) / "folder"


def test_is_below_rejects_paths_that_leave_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "loop").symlink_to("loop")
    (inside / "out").symlink_to(tmp_path)
    found = {name: is_below(inside / name, inside) for name in ("mesh.obj", "../other", "loop", "out", "a\0b")}
    assert found == {"mesh.obj": True, "../other": False, "loop": False, "out": False, "a\0b": False}
