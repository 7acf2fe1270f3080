"""The files of a recording, given as a folder or a zip; nothing is unpacked to disk."""

import hashlib
import os
import stat
import zipfile
import zlib
from collections.abc import Iterable
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import BinaryIO, Protocol, cast

from r2c2r_core.disk import is_below
from r2c2r_core.documents import kind_of_file
from r2c2r_core.errors import CaptureError

_MAX_MEMBERS = 400_000  # three files a frame, 60 frames/s: 37 minutes
_MAX_MEMBER_BYTES = 256 * 2**20  # the largest honest member is a 12-megapixel PNG
_VIDEOS = (".mp4", ".mov", ".m4v")  # are streamed, so they may be larger
_LFS_POINTER = b"version https://git-lfs.github.com/spec/"  # what Git has in the place of a large file that was not fetched
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
_DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, UnicodeDecodeError, OSError)
_MAX_RATIO, _RATIO_MATTERS_BYTES = 300, 256 * 2**20  # deflate reaches 1000 on zeros only


class Files(Protocol):
    """Read-only files with `/`-separated names relative to the recording's root."""

    @property
    def source(self) -> Path:
        """The folder or the zip, for messages."""

    def names(self) -> frozenset[str]:
        """All file names."""

    def read(self, name: str) -> bytes:
        """The content; raises CaptureError when it cannot be read."""

    def open(self, name: str) -> BinaryIO:
        """The content as a stream that can seek; raises CaptureError when it cannot be read."""

    def place(self, name: str) -> tuple[str, ...]:
        """The file's location for another process: an absolute path, followed by the member's name if that is a zip."""

    def sha256(self, names: Iterable[str]) -> str:
        """Digest that identifies the recording: of the zip itself, or of the named files with their sizes and content."""


def open_files(source: Path) -> Files:
    """The files of a recording given as a folder or a zip (.r3d is one); raises CaptureError when it is neither."""
    if source.is_dir():
        return FolderFiles(source)
    if not source.exists():
        raise CaptureError(f"{source}: no such file or folder", hint="check the path of the recording")
    if not source.is_file():  # reading a pipe would block
        raise CaptureError(f"{source}: {kind_of_file(source.stat().st_mode)}", hint="give a folder or a file")
    return ZipFiles(source)


class FolderFiles:
    """The files below a folder, or only those at its top; links that leave it are refused."""

    def __init__(self, source: Path, *, deep: bool = True) -> None:
        self.source = source
        paths = source.rglob("*") if deep else source.glob("*")
        found = (path.relative_to(source).as_posix() for path in paths if path.is_file())
        self._names = frozenset(islice((name for name in found if not _is_clutter(name)), _MAX_MEMBERS + 1))
        if len(self._names) > _MAX_MEMBERS:
            raise CaptureError(f"{source}: more than {_MAX_MEMBERS} files", hint="choose the folder of one recording")

    def names(self) -> frozenset[str]:
        """All file names."""
        return self._names

    def read(self, name: str) -> bytes:
        """The content; raises CaptureError when it cannot be read."""
        with self.open(name) as stream:
            size = os.fstat(stream.fileno()).st_size
            if size > _MAX_MEMBER_BYTES:
                raise CaptureError(
                    f"{self.source / name}: {size >> 20} MiB, expected at most 256 MiB", hint="check that it is an image"
                )
            return _fetched(stream.read(), str(self.source / name))

    def open(self, name: str) -> BinaryIO:
        """The content as a stream; raises CaptureError when it cannot be read."""
        path = self._below(name)
        try:
            return path.open("rb")
        except OSError as problem:
            raise CaptureError(f"{path}: {problem.strerror or problem}", hint="check that the file can be read") from problem

    def place(self, name: str) -> tuple[str, ...]:
        """The file's path; raises CaptureError when it is a link that leaves the folder."""
        return (str(self._below(name).absolute()),)

    def sha256(self, names: Iterable[str]) -> str:
        """Digest of the sorted names with sizes and content."""
        digest = hashlib.sha256()
        for name in sorted(names):
            with self.open(name) as stream:
                digest.update(f"{name}\0{os.fstat(stream.fileno()).st_size}\0".encode())
                while chunk := stream.read(1 << 20):
                    digest.update(chunk)
        return digest.hexdigest()

    def _below(self, name: str) -> Path:
        path = self.source / name
        if not is_below(path, self.source):
            raise CaptureError(f"{path}: a link to a file outside the recording's folder", hint="copy the file into the folder")
        return path


class ZipFiles:
    """The members of a zip, read into memory one at a time; backslashes in names (from Windows) are read as slashes."""

    def __init__(self, source: Path) -> None:
        self.source = source
        try:
            self._zip = zipfile.ZipFile(source)
        except (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, EOFError) as problem:
            raise CaptureError(
                f"{source}: not a readable zip ({problem}); a recording is a folder, a .r3d or a zip of a folder",
                hint="export or copy the recording again; it may have been cut off in transfer",
            ) from problem
        except OSError as problem:
            raise CaptureError(f"{source}: {problem.strerror or problem}", hint="check that the file can be read") from problem
        self._refuse_hostile()
        members = {info.filename.replace("\\", "/"): info.filename for info in self._zip.infolist()}
        self._members = {name: member for name, member in members.items() if name[-1:] != "/" and not _is_clutter(name)}

    def names(self) -> frozenset[str]:
        """All file names."""
        return frozenset(self._members)

    def read(self, name: str) -> bytes:
        """The content; raises CaptureError when the member is damaged."""
        try:
            return _fetched(self._zip.read(self._members.get(name, name)), f"{self.source}: member '{name}'")
        except _DAMAGED as problem:
            raise self._damaged(name, problem) from problem

    def open(self, name: str) -> BinaryIO:
        """The member as a stream; raises CaptureError when it is damaged."""
        try:
            return cast(BinaryIO, self._zip.open(self._members.get(name, name)))
        except _DAMAGED as problem:
            raise self._damaged(name, problem) from problem

    def place(self, name: str) -> tuple[str, ...]:
        """The zip's path and the member."""
        return str(self.source.absolute()), self._members.get(name, name)

    def sha256(self, names: Iterable[str]) -> str:
        """Digest of the zip file itself."""
        with self.source.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()

    def _refuse_hostile(self) -> None:
        members = self._zip.infolist()
        if len(members) > _MAX_MEMBERS:
            raise self._hostile(f"{len(members)} members, expected at most {_MAX_MEMBERS}")
        for info in members:
            path = PurePosixPath(info.filename.replace("\\", "/"))
            if path.is_absolute() or ".." in path.parts or ":" in info.filename.split("/")[0]:
                raise self._hostile(f"member '{info.filename}' points outside the archive")
            if stat.S_ISLNK(info.external_attr >> 16):
                raise self._hostile(f"member '{info.filename}' is a symbolic link")
            if info.flag_bits & 0x1:
                raise self._hostile(f"member '{info.filename}' is encrypted")
            if info.compress_type not in _METHODS:
                raise CaptureError(
                    f"{self.source}: member '{info.filename}' is compressed by method {info.compress_type} (Windows packs "
                    "large folders by 9, Deflate64), which is not read",
                    hint="pack the folder with 7-Zip as zip, method Deflate, or give the folder itself",
                )
            if info.file_size > _MAX_MEMBER_BYTES and path.suffix.lower() not in _VIDEOS:
                raise self._hostile(f"member '{info.filename}' unpacks to {info.file_size >> 20} MiB, expected at most 256 MiB")
        unpacked, packed = sum(i.file_size for i in members), sum(i.compress_size for i in members)
        if unpacked > _RATIO_MATTERS_BYTES and unpacked > _MAX_RATIO * max(packed, 1):
            raise self._hostile(f"unpacks to {unpacked >> 20} MiB from {packed >> 10} KiB, recordings never compress that well")

    def _damaged(self, name: str, problem: Exception) -> CaptureError:
        return CaptureError(
            f"{self.source}: member '{name}' is damaged ({problem or type(problem).__name__})", hint="copy the recording again"
        )

    def _hostile(self, found: str) -> CaptureError:
        return CaptureError(f"{self.source}: {found}", hint="export the recording again from the app that made it")


class SubFiles:
    """A subfolder of other files, presented as a root (a zip of a folder has one at its top)."""

    def __init__(self, files: Files, folder: str) -> None:
        self._files, self._prefix = files, f"{folder}/"
        self.source = files.source
        self._names = frozenset(n[len(self._prefix) :] for n in files.names() if n.startswith(self._prefix))

    def names(self) -> frozenset[str]:
        """All file names below the folder."""
        return self._names

    def read(self, name: str) -> bytes:
        """The content."""
        return self._files.read(self._prefix + name)

    def open(self, name: str) -> BinaryIO:
        """The content as a stream."""
        return self._files.open(self._prefix + name)

    def place(self, name: str) -> tuple[str, ...]:
        """The file's location."""
        return self._files.place(self._prefix + name)

    def sha256(self, names: Iterable[str]) -> str:
        """Digest of the underlying files."""
        return self._files.sha256([self._prefix + n for n in names])


def top_folders(files: Files) -> tuple[str, ...]:
    """Names of the folders at the top, sorted."""
    return tuple(sorted({n.split("/", 1)[0] for n in files.names() if "/" in n}))


def _fetched(content: bytes, where: str) -> bytes:
    """The content of a file; raises CaptureError where Git has only a pointer to it."""
    if content.startswith(_LFS_POINTER):
        raise CaptureError(f"{where}: a pointer of Git LFS, not the file itself", hint="run `git lfs pull` in its repository")
    return content


def _is_clutter(name: str) -> bool:
    return name.startswith("__MACOSX/") or PurePosixPath(name).name in {".DS_Store", "Thumbs.db"} or "/._" in f"/{name}"
