"""Cached access to stage results and the recording's cameras, invalidated by changes."""

import contextlib
import json
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from app.file_cache import FileCache
from app.files import ProjectFiles
from r2c2r_core import workspace
from r2c2r_core.errors import R2C2RError
from r2c2r_core.model.capture import Frame
from r2c2r_core.workspace import Workspace, noun_path

T = TypeVar("T")


def latest(files: ProjectFiles, stage: str, name: str) -> Any:
    """The stage's newest noun of that name, or None."""
    path = noun_path(files.work, stage, name)
    return _NOUNS.get(path, lambda: Workspace(files.work).load_latest(stage, name), lambda _, size: _UNPACKED * size)


def facts(files: ProjectFiles, stage: str, name: str, told: Callable[[Any], T]) -> T | None:
    """JSON facts that `told` extracts from the stage's newest noun of that name, or None."""
    work = Workspace(files.work)

    def read() -> T | None:
        noun = work.load_latest(stage, name)
        return None if noun is None else told(noun)

    return _FACTS.get(work.noun_path(stage, name), read, lambda found, _: len(json.dumps(found)), about=told)


class KeptFacts:
    """`facts` of many nouns, cached in a file of the project, so that a restarted server need not read every noun.

    Each entry records its source; changed ones are read again. The file may be deleted at any time.
    """

    def __init__(self, files: ProjectFiles) -> None:
        self._files, self._new = files, False

    def of(self, stage: str, name: str, told: Callable[[Any], T]) -> T | None:
        """Facts that `told` extracts from the stage's newest noun of that name, or None."""
        path = noun_path(self._files.work, stage, name)
        return _FACTS.get(
            path, lambda: self._read(path, stage, name, told), lambda found, _: len(json.dumps(found)), about=told
        )

    def keep(self) -> None:
        """Write new entries; on a full disk they stay in memory only."""
        if self._new:
            with contextlib.suppress(R2C2RError, OSError):
                self._files.write(self._files.kept_facts, json.dumps({"version": FACTS_VERSION, "facts": self._kept}).encode())

    def _read(self, path: Path, stage: str, name: str, told: Callable[[Any], T]) -> T | None:
        found = path.stat()
        key, stamp = f"{stage}/{name}/{told.__name__}", [found.st_mtime_ns, found.st_size]
        kept = self._kept.get(key)
        if kept is not None and kept["of"] == stamp:
            said: T | None = kept["said"]
            return said
        noun = Workspace(self._files.work).load_latest(stage, name)
        made = None if noun is None else told(noun)
        self._kept[key], self._new = {"of": stamp, "said": made}, True
        return made

    @cached_property
    def _kept(self) -> dict[str, Any]:
        try:
            stored = json.loads(self._files.kept_facts.read_bytes())
            return dict(stored["facts"]) if stored["version"] == FACTS_VERSION else {}
        except (OSError, ValueError, TypeError, KeyError):
            return {}


FACTS_VERSION = 1  # of the extracted facts: older cache files are ignored


def frame_of(files: ProjectFiles, index: int) -> Frame | None:
    """A frame's cameras and pose; None while the recording is being read, or for an unknown frame."""
    path = noun_path(files.work, "ingest", "scene")
    found = _CAMERAS.get(path, lambda: _frames(Workspace(files.work)), lambda frames, _: _FRAME_BYTES * len(frames))
    return found.get(index) if found else None


def frames_folder(files: ProjectFiles) -> Path:
    """Folder of the recording's images, cached, as finding it reads a file that grows with the recording."""
    path = noun_path(files.work, "ingest", "scene")
    return _FOLDERS.get(path, lambda: workspace.frames_folder(files.work), lambda *_: 1) or workspace.frames_folder(files.work)


def _frames(work: Workspace) -> dict[int, Frame]:
    capture = work.load_bare("ingest", "scene")
    return {frame.index: frame for frame in capture.frames} if capture is not None else {}


_UNPACKED = 4  # memory per byte of a noun's file, where meshes and masks are compressed to a quarter or less
_FRAME_BYTES = 2000  # of a frame's cameras and pose

_FOLDERS: FileCache[Path] = FileCache(1000)  # by count, as each is a path
_NOUNS: FileCache[Any] = FileCache(256 << 20)
_FACTS: FileCache[Any] = FileCache(64 << 20)  # of some 8000 objects, as JSON
_CAMERAS: FileCache[dict[int, Frame]] = FileCache(64 << 20)
