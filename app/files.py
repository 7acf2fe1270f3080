"""Where a project's files are, and names that cannot leave their folder."""

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
        """There while an upload is being made this project: until then the folder is the upload's, and goes with it."""
        return self.root / "half-made"

    @property
    def half_made(self) -> bool:
        """Whether the folder is still an upload's."""
        return self.half_made_mark.exists() and not self.description.exists()

    @property
    def description(self) -> Path:
        """What the project is (services/descriptions.py): by it the folder is known when the database is lost."""
        return self.root / "project.json"

    @property
    def previews(self) -> Path:
        """Images and meshes made for the browser; may be deleted at any time."""
        return self.root / "previews"

    @property
    def arriving(self) -> Path:
        """The newest frame of a sample that is being rendered; gone with the other previews once it was read."""
        return self.previews / "arriving.jpg"

    @property
    def kept_facts(self) -> Path:
        """What was read from nouns for the browser; may be deleted at any time."""
        return self.previews / "facts.json"

    @property
    def elevations(self) -> Path:
        """The planes of the scan as fronts are drawn on them, made by the live segmenter; may be deleted at any time."""
        return self.previews / "elevations"

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
    def variants(self) -> Path:
        """Variants of bundles, a folder each."""
        return self.root / "variants"

    @property
    def finished_prompts(self) -> Path:
        """The clicks that the masks in the workspace were made from."""
        return self.root / "finished-prompts.json"

    def request(self, job_id: int) -> Path:
        """What a job was given: its request.json, with the clicks and corrections of then beside it."""
        return self.requests / str(job_id) / "request.json"

    @property
    def requests(self) -> Path:
        """What its jobs were given, a folder each."""
        return self.root / "requests"

    def here(self, path: str) -> Path:
        """Where a file is that a machine named by a path of its own: what it had in this project's folder is in this one."""
        _, in_project, below = path.partition(f"/projects/{self.root.name}/")
        return self.root / below if in_project else Path(path)

    def write(self, path: Path, content: bytes) -> None:
        """Write a file below the project's folder; raises NotFound where the project was deleted meanwhile.

        A folder that came back after its deletion would be in the way of whoever adopts a copy of the project.
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
        """The frames of the recording that an imported project was made from (awaited-frames.json): no other may be read."""
        return self.root / "awaited-frames.json"

    @property
    def facts(self) -> Path:
        """What the recording is (facts.json), written when it was read."""
        return self.root / "facts.json"

    @property
    def scan_pictures(self) -> tuple[Path, ...]:
        """Pictures of the fused scan that there may be."""
        return tuple(self.root.glob("scan-*.png"))


@dataclass(frozen=True, slots=True)
class VariantFiles:
    """Variants of one bundle that were made together; they are whole once there are facts."""

    folder: Path

    @property
    def archive(self) -> Path:
        """All of them, as `r2c2r vary` makes them."""
        return self.folder / "variants.zip"

    @property
    def wall(self) -> Path:
        """The first of them, as a picture."""
        return self.folder / "wall.jpg"

    @property
    def facts(self) -> Path:
        """How many of which seed, and what was found of them."""
        return self.folder / "facts.json"


def project_files(data_dir: Path, project_id: str, work: str | None = None) -> ProjectFiles:
    """The files of a project; `work` when its workspace is elsewhere."""
    root = data_dir / "projects" / project_id
    return ProjectFiles(root, Path(work) if work else root / "work")


def receiving(folder: Path, name: str) -> Path:
    """Where a file is received that nobody can go on sending: left over, it may go."""
    return folder / f"{_RECEIVED}{name}"


def half_received(path: Path) -> bool:
    """Whether the file is what such a reception left."""
    return path.name.startswith(_RECEIVED)


def safe_name(name: str, fallback: str = "recording") -> str:
    """A file name without folders, control characters or a leading dot, at most 120 characters."""
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    cleaned = _UNSAFE.sub("_", last).strip(" .")
    return cleaned[-120:] or fallback


def free_name(folder: Path, name: str) -> Path:
    """A path in the folder at which nothing is."""
    target, number = folder / name, 1
    while target.exists():
        number += 1
        target = folder / f"{name}-{number}"
    return target


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
    """Delete the folder, at once for whoever writes to it, and say how many bytes that was."""
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
    """Hold the data folder against a second server: two queues on one table would run jobs twice.

    Gives what says more about this server to others, beside its process id: see running_server.
    """
    with (data_dir / "server.lock").open("a+") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            owner = _said_in(handle).get("process", "unknown")
            raise EnvironmentProblem(
                f"{data_dir}: another r2c2r serves this folder (process {owner})", hint="use that one, or another --data"
            ) from error

        def announce(facts: dict[str, Any]) -> None:
            handle.truncate(0)
            handle.write(json.dumps({"process": os.getpid(), **facts}))
            handle.flush()

        announce({})
        yield announce


def running_server(data_dir: Path) -> dict[str, Any] | None:
    """What the server that holds the data folder says of itself; None when none does, or it is only starting."""
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
    except ValueError:  # it is just being written
        return {}
    return said if isinstance(said, dict) else {}
