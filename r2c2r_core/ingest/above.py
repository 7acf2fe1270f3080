"""Calibration files from the parent folder: data sets keep one calibration for all sequences below it."""

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from r2c2r_core.ingest.files import Files, FolderFiles

_CALIBRATIONS = (r"camera-intrinsics\.txt", r"intrinsics_color\.txt", r"[^/]+\.ya?ml")


class WithAbove:
    """The files of a folder, plus the parent folder's calibrations of kinds that the folder lacks."""

    def __init__(self, files: Files, above: Files) -> None:
        self._files, self._above = files, above
        self.source = files.source
        self.borrowed = frozenset(_lacking(files.names(), above.names()))

    def names(self) -> frozenset[str]:
        """All file names, with borrowed files listed as if they were in the folder."""
        return self._files.names() | self.borrowed

    def read(self, name: str) -> bytes:
        """The content."""
        return self._holder(name).read(name)

    def open(self, name: str) -> BinaryIO:
        """The content as a stream."""
        return self._holder(name).open(name)

    def place(self, name: str) -> tuple[str, ...]:
        """The path of the file."""
        return self._holder(name).place(name)

    def sha256(self, names: Iterable[str]) -> str:
        """Digest of the folder's files, and of the borrowed files among `names`."""
        wanted = frozenset(names)
        own = self._files.sha256(wanted - self.borrowed)
        if not wanted & self.borrowed:
            return own
        return hashlib.sha256(f"{own}\0{self._above.sha256(wanted & self.borrowed)}".encode()).hexdigest()

    def _holder(self, name: str) -> Files:
        return self._above if name in self.borrowed else self._files


def with_folder_above(files: Files, source: Path) -> Files:
    """The files of a recording: of a folder, with the calibration beside it; of a zip, only its own."""
    return WithAbove(files, FolderFiles(source.resolve().parent, deep=False)) if source.is_dir() else files


def calibrations_beside(source: Path) -> tuple[Path, ...]:
    """Calibration files beside a recording's folder that it may borrow; changing them changes the recording."""
    if not source.is_dir():
        return ()
    beside = sorted(source.resolve().parent.iterdir())
    return tuple(p for p in beside if p.is_file() and any(re.fullmatch(pattern, p.name) for pattern in _CALIBRATIONS))


def borrowed_by(files: Files, names: Iterable[str]) -> list[str]:
    """Names of the files borrowed from the parent folder."""
    return sorted(files.borrowed.intersection(names)) if isinstance(files, WithAbove) else []


def _lacking(here: frozenset[str], above: frozenset[str]) -> list[str]:
    """The parent folder's calibration of each kind missing here; skipped where several files match."""
    lacking = []
    for pattern in _CALIBRATIONS:
        candidates = [name for name in above if re.fullmatch(pattern, name)]
        if len(candidates) == 1 and not any(re.fullmatch(pattern, name) for name in here):
            lacking += candidates
    return lacking
