"""What a stage stored, and the recording's cameras: read once for every time they change."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from app.file_cache import FileCache
from app.files import ProjectFiles
from r2c2r_core import workspace
from r2c2r_core.model.capture import Frame
from r2c2r_core.workspace import Workspace

T = TypeVar("T")


def latest(files: ProjectFiles, stage: str, name: str) -> Any:
    """The stage's newest noun of that name; None while there is none."""
    work = Workspace(files.work)
    return _NOUNS.get(work.noun_path(stage, name), lambda: work.load_latest(stage, name), lambda _, size: _UNPACKED * size)


def facts(files: ProjectFiles, stage: str, name: str, told: Callable[[Any], T]) -> T | None:
    """What `told` says of the stage's newest noun of that name, as JSON; None while there is none."""
    work = Workspace(files.work)

    def read() -> T | None:
        noun = work.load_latest(stage, name)
        return None if noun is None else told(noun)

    return _FACTS.get(work.noun_path(stage, name), read, lambda found, _: len(json.dumps(found)), about=told)


def frame_of(files: ProjectFiles, index: int) -> Frame | None:
    """A frame's cameras and pose; None while the recording is being read, or when it has no such frame."""
    work = Workspace(files.work)
    found = _CAMERAS.get(work.noun_path("ingest", "scene"), lambda: _frames(work), lambda frames, _: _FRAME_BYTES * len(frames))
    return found.get(index) if found else None


def frames_folder(files: ProjectFiles) -> Path:
    """Where the recording's images are; which reading they are of stands in a file that grows with the recording."""
    path = files.work / "nouns" / "ingest" / "scene.noun"
    return _FOLDERS.get(path, lambda: workspace.frames_folder(files.work), lambda *_: 1) or workspace.frames_folder(files.work)


def _frames(work: Workspace) -> dict[int, Frame]:
    capture = work.load_latest("ingest", "scene")
    return {frame.index: frame for frame in capture.frames} if capture is not None else {}


_UNPACKED = 4  # bytes in memory of one in a noun's file: meshes and masks are compressed there to a quarter and less
_FRAME_BYTES = 2000  # of a frame's cameras and pose

_FOLDERS: FileCache[Path] = FileCache(1000)  # counted, for each is a path
_NOUNS: FileCache[Any] = FileCache(256 << 20)
_FACTS: FileCache[Any] = FileCache(64 << 20)  # of some 8000 objects, as JSON
_CAMERAS: FileCache[dict[int, Frame]] = FileCache(64 << 20)
