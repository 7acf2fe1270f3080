"""Where projects' files are: `Store` is what jobs and services ask of it, `Folder` the data folder that holds all of them."""

from pathlib import Path
from typing import Protocol

from app.files import folder_bytes


class Store(Protocol):
    """What is beyond the data folder of this machine. Each call may be made from any thread."""

    def fetch(self, project_id: str, *, recording: bool = False) -> None:
        """Have the project's files here as they were kept last; those of the recording only where they are asked for."""

    def keep(self, project_id: str) -> None:
        """Keep what was written in the project's folder; returns when no loss of this machine loses it."""

    def hold(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Be who makes the project's nouns and bundles from now on: whoever was before keeps none of them any more.

        `taken`: another machine took it, for this one to make a part.
        """

    def keep_log(self, project_id: str, log: Path) -> None:
        """Show a log that is being written here to other machines."""

    def fetch_log(self, project_id: str, log: Path) -> None:
        """Have a log here as it was shown last."""

    def link(self, project_id: str, path: Path, name: str) -> str | None:
        """An address, good for minutes, from which a browser takes the file under that name; None: send it from here."""

    def size(self, project_id: str) -> int:
        """Bytes of the project's files."""

    def delete(self, project_id: str) -> None:
        """Delete the project's files for good, but for those here."""

    def was_deleted(self, project_id: str) -> bool:
        """Whether the folder here is of a project that another machine deleted for good."""

    def tidy(self, in_use: frozenset[str]) -> None:
        """Keep what was written since, and make room where none of these projects is."""


class Folder:
    """The data folder is the truth, and nothing is beyond it."""

    def __init__(self, projects: Path) -> None:
        self._projects = projects

    def fetch(self, project_id: str, *, recording: bool = False) -> None:
        """They are here."""

    def keep(self, project_id: str) -> None:
        """They are."""

    def hold(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Workspaces are locked while somebody writes."""

    def keep_log(self, project_id: str, log: Path) -> None:
        """It is."""

    def fetch_log(self, project_id: str, log: Path) -> None:
        """It is here."""

    def link(self, project_id: str, path: Path, name: str) -> str | None:
        """None."""
        return None

    def size(self, project_id: str) -> int:
        """Bytes of the project's folder."""
        return folder_bytes(self._projects / project_id)

    def delete(self, project_id: str) -> None:
        """There are none elsewhere."""

    def was_deleted(self, project_id: str) -> bool:
        """By nobody else."""
        return False

    def tidy(self, in_use: frozenset[str]) -> None:
        """Nothing to do."""
