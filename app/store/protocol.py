"""Storage of projects' files: the protocol `Store` used by jobs and services, and `Folder`, the local data folder."""

from pathlib import Path
from typing import Protocol

from app.files import folder_bytes


class Store(Protocol):
    """Storage beyond this machine's data folder. All methods are thread-safe."""

    def fetch(self, project_id: str, *, recording: bool = False) -> None:
        """Fetch the project's files as last kept; the recording's only if requested."""

    def keep(self, project_id: str) -> None:
        """Store changes in the project's folder; returns once they survive the loss of this machine."""

    def hold(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Become the only writer of the project's nouns and bundles; the previous holder can store none any more.

        `taken`: another machine has claimed it, and this one computes a part.
        """

    def keep_log(self, project_id: str, log: Path) -> None:
        """Publish a log that is being written here to other machines."""

    def fetch_log(self, project_id: str, log: Path) -> None:
        """Fetch a log as last published."""

    def link(self, project_id: str, path: Path, name: str) -> str | None:
        """An address, valid for minutes, from which a browser downloads the file under that name; None: serve it from here."""

    def size(self, project_id: str) -> int:
        """Size of the project's files in bytes."""

    def delete(self, project_id: str) -> None:
        """Delete the project's files permanently, except the local ones."""

    def was_deleted(self, project_id: str) -> bool:
        """Whether another machine has permanently deleted the local folder's project."""

    def tidy(self, in_use: frozenset[str]) -> None:
        """Store pending changes, and free space of projects that are not in use."""


class Folder:
    """Store that is only the local data folder."""

    def __init__(self, projects: Path) -> None:
        self._projects = projects

    def fetch(self, project_id: str, *, recording: bool = False) -> None:
        """Nothing to do: files are local."""

    def keep(self, project_id: str) -> None:
        """Nothing to do: files are local."""

    def hold(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Nothing to do: workspaces are locked while they are written."""

    def keep_log(self, project_id: str, log: Path) -> None:
        """Nothing to do: logs are local."""

    def fetch_log(self, project_id: str, log: Path) -> None:
        """Nothing to do: logs are local."""

    def link(self, project_id: str, path: Path, name: str) -> str | None:
        """No address: files are served from here."""
        return None

    def size(self, project_id: str) -> int:
        """Bytes of the project's folder."""
        return folder_bytes(self._projects / project_id)

    def delete(self, project_id: str) -> None:
        """Nothing to do: there are no other files."""

    def was_deleted(self, project_id: str) -> bool:
        """False, as there is no other machine."""
        return False

    def tidy(self, in_use: frozenset[str]) -> None:
        """Nothing to do."""
