"""Paths of a project's files, and safe file names."""

import contextlib
import fcntl
import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from app.errors import Forbidden, NoSpace, NotFound
from r2c2r_core.disk import explained_io
from r2c2r_core.errors import EnvironmentProblem
from r2c2r_core.workspace import replace_file

_RECEIVED = "receiving-"
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
    def half_made_mark(self) -> Path:
        """Marker that exists while an upload becomes this project; until then the folder is deleted with the upload."""
        return self.root / "half-made"

    @property
    def half_made(self) -> bool:
        """Whether the folder still belongs to an upload."""
        return self.half_made_mark.exists() and not self.description.exists()

    @property
    def description(self) -> Path:
        """Description of the project (services/descriptions.py), from which it is restored when the database is lost."""
        return self.root / "project.json"

    @property
    def previews(self) -> Path:
        """Images and meshes made for the browser; may be deleted at any time."""
        return self.root / "previews"

    @property
    def arriving(self) -> Path:
        """The newest frame of a sample that is being rendered; deleted with the other previews once it was read."""
        return self.previews / "arriving.jpg"

    @property
    def kept_facts(self) -> Path:
        """Cached facts from nouns for the browser; may be deleted at any time."""
        return self.previews / "facts.json"

    @property
    def elevations(self) -> Path:
        """Elevations on which fronts are drawn, made by the live segmenter; may be deleted at any time."""
        return self.previews / "elevations"

    @property
    def masks(self) -> Path:
        """Live masks, one file per object and prompt state."""
        return self.root / "masks"

    @property
    def proposals(self) -> Path:
        """The segmenter's proposals without clicks; may be deleted at any time."""
        return self.root / "proposals.json"

    @property
    def uploads(self) -> Path:
        """Meshes uploaded as candidates."""
        return self.root / "uploads"

    @property
    def bundles(self) -> Path:
        """Finished bundles, one per version."""
        return self.root / "bundles"

    @property
    def variants(self) -> Path:
        """Variants of bundles, a folder each."""
        return self.root / "variants"

    @property
    def finished_prompts(self) -> Path:
        """The clicks that the masks in the workspace were made from."""
        return self.root / "finished-prompts.json"

    @property
    def finished_inputs(self) -> Path:
        """Key of each object's inputs in the last run (db/keys.py), by name."""
        return self.root / "finished-inputs.json"

    def request(self, job_id: int) -> Path:
        """A job's request.json, with a copy of its clicks and corrections beside it."""
        return self.requests / str(job_id) / "request.json"

    @property
    def requests(self) -> Path:
        """Requests of its jobs, a folder each."""
        return self.root / "requests"

    def here(self, path: str) -> Path:
        """Local path of a file named by another machine's path: paths in the project's folder are mapped to this folder."""
        _, in_project, below = path.partition(f"/projects/{self.root.name}/")
        return self.root / below if in_project else Path(path)

    def write(self, path: Path, content: bytes) -> None:
        """Write a file below the project's folder; raises NotFound where the project was deleted meanwhile.

        A folder recreated after its deletion would block the adoption of a copy of the project.
        """
        folder = self.root
        with explained_io(path):
            try:
                for name in path.parent.resolve().relative_to(self.root.resolve()).parts:
                    folder /= name
                    folder.mkdir(exist_ok=True)
                replace_file(path, content)
            except FileNotFoundError as error:
                raise NotFound(f"{self.root.name}: the project was deleted", hint="see the list of projects") from error

    @property
    def frames(self) -> Path:
        """The frame table (frames.json), written when the recording was read."""
        return self.root / "frames.json"

    @property
    def awaited_frames(self) -> Path:
        """Frames of an imported project's recording (awaited-frames.json); another recording is refused."""
        return self.root / "awaited-frames.json"

    @property
    def facts(self) -> Path:
        """Facts about the recording (facts.json), written when it was read."""
        return self.root / "facts.json"

    @property
    def scan_pictures(self) -> tuple[Path, ...]:
        """Existing pictures of the fused scan."""
        return tuple(self.root.glob("scan-*.png"))


@dataclass(frozen=True, slots=True)
class VariantFiles:
    """Variants of one bundle that were made together; complete once facts.json exists."""

    folder: Path

    @property
    def archive(self) -> Path:
        """Archive of all variants, as made by `r2c2r vary`."""
        return self.folder / "variants.zip"

    @property
    def wall(self) -> Path:
        """Picture of the first variants."""
        return self.folder / "wall.jpg"

    @property
    def facts(self) -> Path:
        """Facts about the variants: number, seed and test results."""
        return self.folder / "facts.json"


def project_files(data_dir: Path, project_id: str, work: str | None = None) -> ProjectFiles:
    """The files of a project; `work` when its workspace is elsewhere."""
    root = data_dir / "projects" / project_id
    return ProjectFiles(root, Path(work) if work else root / "work")


def receiving(folder: Path, name: str) -> Path:
    """Temporary path of an upload that cannot be resumed; a leftover file may be deleted."""
    return folder / f"{_RECEIVED}{name}"


def half_received(path: Path) -> bool:
    """Whether the file is a leftover of such an upload."""
    return path.name.startswith(_RECEIVED)


def safe_name(name: str, fallback: str = "recording") -> str:
    """A file name without folders, control characters or a leading dot, at most 120 characters."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    cleaned = _UNSAFE.sub("_", last).strip(" .")
    return cleaned[-120:] or fallback


def free_name(folder: Path, name: str) -> Path:
    """An unused path in the folder."""
    target, number = folder / name, 1
    while target.exists():
        number += 1
        target = folder / f"{name}-{number}"
    return target


def inside(root: Path, *parts: str) -> Path:
    """The path below `root`; raises Forbidden when it leaves it through `..` or a link."""
    base = root.resolve()
    path = base.joinpath(*parts).resolve()
    if not path.is_relative_to(base):
        raise Forbidden("the path leaves the project's folder")
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

    A file that a worker renames or deletes between listing and measuring is not counted.
    """
    total = 0
    for parent, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(FileNotFoundError):
                total += os.lstat(os.path.join(parent, name)).st_size
    return total


def delete_folder(folder: Path) -> int:
    """Delete the folder, atomically for concurrent writers, and return its size in bytes."""
    freed = folder_bytes(folder)
    if folder.is_symlink():
        folder.unlink()
    elif folder.exists():
        going = free_name(folder.parent, f".{folder.name}.deleted")
        folder.rename(going)
        shutil.rmtree(going)
    return freed


@contextlib.contextmanager
def only_server(data_dir: Path) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Lock the data folder against a second server, as two queues on one table would run jobs twice.

    Yields a function that publishes more about this server than its process id: see running_server.
    """
    with (data_dir / "server.lock").open("a+") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            owner = _said_in(handle).get("process", "unknown")
            raise EnvironmentProblem(
                f"{data_dir}: another r2c2r serves this folder (process {owner})", hint="use that server, or another --data"
            ) from error

        def announce(facts: dict[str, Any]) -> None:
            handle.truncate(0)
            handle.write(json.dumps({"process": os.getpid(), **facts}))
            handle.flush()

        announce({})
        yield announce


def running_server(data_dir: Path) -> dict[str, Any] | None:
    """Information published by the server that has locked the data folder; None without one, or while it is starting."""
    try:
        with (data_dir / "server.lock").open() as handle:
            try:
                fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError:
                said = _said_in(handle)
                return said if "address" in said else None
    except FileNotFoundError:
        pass
    return None


def _said_in(handle: IO[str]) -> dict[str, Any]:
    handle.seek(0)
    try:
        said = json.loads(handle.read(10_000))
    except ValueError:  # it is being written
        return {}
    return said if isinstance(said, dict) else {}
