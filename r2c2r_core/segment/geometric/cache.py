"""Disk cache of a prepared capture, in the project's own codec; a damaged file counts as absent."""

import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.runs.handles import GridHandle
from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import Cell, PlaneGrid
from r2c2r_core.segment.runs.relief import Relief
from r2c2r_core.segment.runs.run import Run

T = TypeVar("T")

_STORED = (Cell, Evidence, GridHandle, PlaneGrid, PlaneRegion, Relief, Run)


def kept(path: Path, compute: Callable[[], T]) -> T:
    """What `path` holds, else the computed value, stored there. The folder's name must say what it was computed from."""
    try:
        found: T = decode_noun(path.read_bytes(), _STORED)[0]
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile):
        found = compute()
        _write(path, encode_noun(found, {}, _STORED))
    return found


def _write(path: Path, content: bytes) -> None:
    """Readers see the whole file or none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    temporary.write_bytes(content)
    temporary.replace(path)
