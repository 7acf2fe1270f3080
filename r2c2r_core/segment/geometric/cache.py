"""Disk cache of a prepared capture, in the project's own codec; a damaged file counts as absent."""

import fcntl
import os
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import Cell, PlaneGrid
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.runs.run import Run

T = TypeVar("T")

_UNREADABLE = (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile)
_STORED = (Cell, Evidence, GridHandle, PlaneGrid, PlaneRegion, Relief, PanelOdds, Run)


def kept(path: Path, compute: Callable[[], T]) -> T:
    """Cached value at `path`, else the computed one, which is stored there. The folder's name must identify its inputs.

    Concurrent callers, in this process or another, wait for the first one instead of computing the value too.
    """
    with suppress(*_UNREADABLE):
        return _read(path)
    with _alone_at(path):
        with suppress(*_UNREADABLE):
            return _read(path)
        found = compute()
        _write(path, encode_noun(found, {}, _STORED))
        return found


def _read(path: Path) -> Any:
    return decode_noun(path.read_bytes(), _STORED)[0]


@contextmanager
def _alone_at(path: Path) -> Iterator[None]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_name(f".{path.name}.lock").open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _write(path: Path, content: bytes) -> None:
    """Write a file atomically: readers see the whole file or none. Nothing is written to a folder deleted meanwhile."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with suppress(FileNotFoundError):  # a session with other settings deletes the caches of all others
        temporary.write_bytes(content)
        temporary.replace(path)
