"""Live masks on disk: one file per object and prompt state, one JSON line per mask, so undo finds the older ones again."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(slots=True)
class MaskFile:
    """The masks computed for one state of an object's clicks."""

    frames: dict[int, dict[str, Any]] = field(default_factory=dict)  # frame -> {"frame", "confidence", "area", "mask"}
    end: str | None = None  # done | failed | cancelled; None when it never came to an end
    error: dict[str, Any] | None = None


def prompt_key(category: str, points: Iterable[tuple[int, float, float, int]], segmenter: str) -> str:
    """Key of what the masks depend on: the clicks, the category and who draws, not the name."""
    content = json.dumps([segmenter, category, [[frame, x, y, label] for frame, x, y, label in points]])
    return hashlib.sha256(content.encode()).hexdigest()[:20]


def mask_path(folder: Path, object_id: int, key: str) -> Path:
    """File of an object's masks."""
    return folder / str(object_id) / f"{key}.jsonl"


def begin(path: Path) -> None:
    """Forget older masks; until an end is written, whoever starts next knows that these are wanted."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")


def append(path: Path, line: dict[str, Any]) -> None:
    """Add one line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as handle:
        handle.write(json.dumps(line) + "\n")


def read(path: Path) -> MaskFile | None:
    """What is stored; a line cut off by a crash is dropped; None when there is nothing."""
    try:
        text = path.read_text()
    except FileNotFoundError:
        return None
    found = MaskFile()
    for raw in text.splitlines():
        try:
            line = json.loads(raw)
        except ValueError:
            continue
        if "end" in line:
            found.end, found.error = line["end"], line.get("error")
        else:
            found.frames[int(line["frame"])] = line
    return found
