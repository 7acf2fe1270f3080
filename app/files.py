"""Where a project's files are, and names that cannot leave their folder."""

import contextlib
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from app.errors import Forbidden, NoSpace

_UNSAFE = re.compile(r"[^A-Za-z0-9._ -]+")


@dataclass(frozen=True, slots=True)
class ProjectFiles:
    """The folder of one project."""

    root: Path
    work: Path  # the core's workspace

    @property
    def source(self) -> Path:
        """The recording as it was uploaded."""
        return self.root / "source"

    @property
    def previews(self) -> Path:
        """Images and meshes made for the browser; may be deleted at any time."""
        return self.root / "previews"

    @property
    def masks(self) -> Path:
        """Live masks, one file per object and prompt state."""
        return self.root / "masks"

    @property
    def proposals(self) -> Path:
        """What the segmenter proposed without a click; may be deleted at any time."""
        return self.root / "proposals.json"

    @property
    def uploads(self) -> Path:
        """Meshes people gave as candidates."""
        return self.root / "uploads"

    @property
    def bundles(self) -> Path:
        """Finished bundles, one per version."""
        return self.root / "bundles"

    @property
    def finished_prompts(self) -> Path:
        """The clicks that the masks in the workspace were made from."""
        return self.root / "finished-prompts.json"

    @property
    def frames(self) -> Path:
        """The frame table (frames.json), written when the recording was read."""
        return self.root / "frames.json"

    @property
    def facts(self) -> Path:
        """What the recording is (facts.json), written when it was read."""
        return self.root / "facts.json"

    @property
    def scan_pictures(self) -> tuple[Path, ...]:
        """Pictures of the fused scan that there may be."""
        return tuple(self.root.glob("scan-*.png"))


def project_files(data_dir: Path, project_id: str, work: str | None = None) -> ProjectFiles:
    """The files of a project; `work` when its workspace is elsewhere."""
    root = data_dir / "projects" / project_id
    return ProjectFiles(root, Path(work) if work else root / "work")


def safe_name(name: str, fallback: str = "recording") -> str:
    """A file name without folders, control characters or a leading dot, at most 120 characters."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    cleaned = _UNSAFE.sub("_", last).strip(" .")
    return cleaned[-120:] or fallback


def inside(root: Path, *parts: str) -> Path:
    """The path below `root`; raises Forbidden when it leads out of it, through `..` or a link."""
    base = root.resolve()
    path = base.joinpath(*parts).resolve()
    if not path.is_relative_to(base):
        raise Forbidden("the path leads out of the project")
    return path


def require_free(folder: Path, needed: int, reserve: int) -> None:
    """Raise NoSpace unless `needed` bytes fit and `reserve` stay free."""
    free = free_bytes(folder)
    if free < needed + reserve:
        raise NoSpace(
            f"{free / 1e9:.1f} GB free on the disk of {folder}, {(needed + reserve) / 1e9:.1f} GB needed",
            hint="delete a project or start with --data on a larger disk",
        )


def free_bytes(folder: Path) -> int:
    """Free bytes on the disk of a folder that may not exist yet."""
    place = folder
    while not place.exists():
        place = place.parent
    return shutil.disk_usage(place).free


def folder_bytes(folder: Path) -> int:
    """Bytes of all files below the folder; links are not followed.

    Workers write while this walks: a file that is renamed or deleted between
    its listing and its measuring counts nothing.
    """
    total = 0
    for parent, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(FileNotFoundError):
                total += os.lstat(os.path.join(parent, name)).st_size
    return total


def delete_folder(folder: Path) -> int:
    """Delete the folder and say how many bytes that was."""
    freed = folder_bytes(folder)
    if folder.is_symlink():
        folder.unlink()
    elif folder.exists():
        shutil.rmtree(folder)
    return freed
