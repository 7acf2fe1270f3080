"""Folders that other processes write to while they are measured and deleted."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.errors import NotFound
from app.files import delete_folder, folder_bytes, project_files
from app.services.media import kept_file
from r2c2r_core.workspace import Workspace


def test_a_file_that_vanishes_during_size_measurement_counts_zero_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kept").write_bytes(b"12345")
    listed = os.walk

    def listed_too_early(folder: Path) -> Iterator[tuple[str, list[str], list[str]]]:
        for parent, folders, names in listed(folder):
            yield parent, folders, [*names, ".overrides.json.1.tmp"]

    monkeypatch.setattr("app.files.os.walk", listed_too_early)
    assert folder_bytes(tmp_path) == 5


def test_writing_a_cached_file_does_not_recreate_a_deleted_project(tmp_path: Path) -> None:
    files = project_files(tmp_path, "0123456789ab")
    files.root.mkdir(parents=True)
    files.write(files.previews / "frames" / "160" / "000003.jpg", b"there")

    def deleted_meanwhile() -> bytes:
        assert delete_folder(files.root) == 5
        return b"made"

    with pytest.raises(NotFound, match="was deleted"):
        kept_file(files, files.previews / "scan.png", deleted_meanwhile)
    assert list((tmp_path / "projects").iterdir()) == []


def test_a_folder_written_to_during_deletion_is_deleted_completely(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = project_files(tmp_path, "0123456789ab")
    files.root.mkdir(parents=True)
    files.write(files.description, b"{}")
    delete = shutil.rmtree

    def written_meanwhile(folder: Path) -> None:
        with pytest.raises(NotFound):
            files.write(files.description, b"{}")
        delete(folder)

    monkeypatch.setattr("app.files.shutil.rmtree", written_meanwhile)
    delete_folder(files.root)
    assert list((tmp_path / "projects").iterdir()) == []


def test_loading_from_a_missing_workspace_creates_no_folder(tmp_path: Path) -> None:
    assert Workspace(tmp_path / "projects" / "0123456789ab" / "work").load_latest("export", "scene") is None
    assert list(tmp_path.iterdir()) == []
