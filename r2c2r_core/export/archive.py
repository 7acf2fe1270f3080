"""Bundles as zips: reproducible bytes, atomic writes, and validated unpacking."""

import contextlib
import os
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

from r2c2r_core.disk import explained_io
from r2c2r_core.documents import kind_of_file
from r2c2r_core.errors import BundleError
from r2c2r_core.export.rules.files import is_inside

MOST_MEMBERS = 20_000
MOST_BYTES = 4 * 1024**3

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date that a zip can store
_PACKED = {".png", ".jpg"}
_CHUNK = 1 << 20


def write_zip(folder: Path, path: Path) -> None:
    """Pack a folder; members sorted, without times and owners, so that equal folders give equal files."""
    with zipfile.ZipFile(path, "w") as archive:
        for member in sorted(p for p in folder.rglob("*") if p.is_file()):
            entry = zipfile.ZipInfo(member.relative_to(folder).as_posix(), _EPOCH)
            entry.create_system = 3  # unix, on every system
            entry.external_attr = (stat.S_IFREG | 0o644) << 16
            entry.compress_type = zipfile.ZIP_STORED if member.suffix in _PACKED else zipfile.ZIP_DEFLATED
            archive.writestr(entry, member.read_bytes(), compresslevel=6)


@contextlib.contextmanager
def opened_bundle(path: Path) -> Iterator[Path]:
    """Folder of a bundle: itself, or a zip unpacked to a temporary folder; raises BundleError on anything else."""
    if path.is_dir():
        _refuse_pipes(path)
        yield _top(path, path)
        return
    if not path.is_file():
        raise BundleError(f"{path}: there is no such file", hint="give a bundle: a .zip or its folder")
    with explained_io(path), tempfile.TemporaryDirectory(prefix="r2c2r-bundle-") as scratch:
        folder = Path(scratch)
        unpack(path, folder)
        yield _top(folder, path)


def _refuse_pipes(folder: Path) -> None:
    """Raise BundleError for anything but files, folders and links to them: reading a pipe blocks for ever."""
    for path in folder.rglob("*"):
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise BundleError(f"{path}: {kind_of_file(path.stat().st_mode)}", hint="a bundle holds files and folders only")


def unpack(path: Path, folder: Path) -> None:
    """Unpack a zip of plain files of sane sizes with paths inside `folder`; raises BundleError otherwise."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            _refuse_foreign_members(path, members)
            budget = MOST_BYTES
            for member in members:
                if not member.is_dir():
                    budget -= _extract(archive, member, folder, budget, path)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, UnicodeError) as error:
        what = " ".join(str(error).split()) or type(error).__name__
        raise BundleError(f"{path.name}: not a readable zip ({what})", hint="download or export the bundle again") from error


@contextlib.contextmanager
def building_folder(destination: Path) -> Iterator[Path]:
    """A temporary folder beside the destination (a rename must not cross disks), always removed afterwards."""
    with explained_io(destination):
        destination.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{destination.name}.", suffix=".tmp", dir=destination.parent))
    try:
        with explained_io(destination):
            yield scratch
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def replace_folder(source: Path, destination: Path) -> None:
    """Replace a folder by another, using renames only."""
    old = destination.with_name(f".{destination.name}.{os.getpid()}.old")
    if destination.exists():
        destination.rename(old)
    source.rename(destination)
    shutil.rmtree(old, ignore_errors=True)


def _refuse_foreign_members(path: Path, members: list[zipfile.ZipInfo]) -> None:
    again = "not a bundle of r2c2r: export or download it again"
    if len(members) > MOST_MEMBERS:
        raise BundleError(f"{path.name}: {len(members)} members, expected at most {MOST_MEMBERS}", hint=again)
    seen: set[str] = set()
    for member in members:
        name = member.filename.rstrip("/")
        if not is_inside(name) or stat.S_ISLNK(member.external_attr >> 16):
            raise BundleError(f"{path.name}: member {name!r} leaves the bundle", hint=again)
        if name.casefold() in seen:
            raise BundleError(f"{path.name}: member {name!r} appears twice", hint=again)
        seen.add(name.casefold())


def _extract(archive: zipfile.ZipFile, member: zipfile.ZipInfo, folder: Path, budget: int, path: Path) -> int:
    """Unpack one member, counting actual bytes, as its header may be wrong; the checksum is verified at the end."""
    target = folder / member.filename
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        written = 0
        with archive.open(member) as source, target.open("wb") as sink:
            while chunk := source.read(_CHUNK):
                written += len(chunk)
                if written > budget:
                    raise BundleError(f"{path.name}: more than {MOST_BYTES >> 30} GB when unpacked", hint="use another bundle")
                sink.write(chunk)
    except (NotADirectoryError, IsADirectoryError, FileExistsError) as error:
        raise BundleError(f"{path.name}: {member.filename!r} is a file and a folder", hint="export it again") from error
    return written


def _top(folder: Path, path: Path) -> Path:
    """The folder that holds scene.urdf: this one, or the only one inside it."""
    if (folder / "scene.urdf").is_file():
        return folder
    inner = [p for p in folder.iterdir() if p.is_dir()]
    if len(inner) == 1 and (inner[0] / "scene.urdf").is_file():
        return inner[0]
    raise BundleError(f"{path.name}: no scene.urdf at its top", hint="expected a bundle written by 'r2c2r run'")
