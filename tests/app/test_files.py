"""Sizes of folders that others write to."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.files import folder_bytes


def test_a_file_that_vanishes_while_a_folder_is_measured_counts_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kept").write_bytes(b"12345")
    listed = os.walk

    def listed_too_early(folder: Path) -> Iterator[tuple[str, list[str], list[str]]]:
        for parent, folders, names in listed(folder):
            yield parent, folders, [*names, ".overrides.json.1.tmp"]

    monkeypatch.setattr("app.files.os.walk", listed_too_early)
    assert folder_bytes(tmp_path) == 5
