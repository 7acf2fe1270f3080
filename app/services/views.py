"""What a stage stored, and the recording's cameras: read once for every time they change."""

from functools import lru_cache
from pathlib import Path
from typing import Any

from app.files import ProjectFiles
from r2c2r_core.model.capture import Frame
from r2c2r_core.workspace import Workspace


def latest(files: ProjectFiles, stage: str, name: str) -> Any:
    """The stage's newest noun of that name; None while there is none."""
    path = files.work / "nouns" / stage / f"{name}.noun"
    try:
        return _latest_at(path, path.stat().st_mtime_ns, files.work, stage, name)
    except FileNotFoundError:
        return None


def frame_of(files: ProjectFiles, index: int) -> Frame | None:
    """A frame's cameras and pose; None while the recording is being read, or when it has no such frame."""
    path = files.work / "nouns" / "ingest" / "scene.noun"
    try:
        return _frames_at(path, path.stat().st_mtime_ns, files.work).get(index)
    except FileNotFoundError:
        return None


@lru_cache(maxsize=4)
def _frames_at(path: Path, _changed: int, work: Path) -> dict[int, Any]:
    capture = Workspace(work).load_latest("ingest", "scene")
    return {frame.index: frame for frame in capture.frames} if capture is not None else {}


@lru_cache(maxsize=8)
def _latest_at(path: Path, _changed: int, work: Path, stage: str, name: str) -> Any:
    return Workspace(work).load_latest(stage, name)
