"""Masks on disk: one file per object and prompt state, one JSON line per mask, so undo finds the older ones again.

The last line of a file that came to its end says where each frame's line is: whoever looks at one frame reads one line.
It also says with which clicks on other objects the masks were drawn. Those are no part of the key, for which clicks fall on
a front only the prepared recording tells, long after the change that makes the key is stored. The live segmenter compares
them with those of now whenever it starts and at every change, and has the masks drawn anew where they part it otherwise.
"""

import base64
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from r2c2r_core.workspace import write_atomically

Entry = dict[str, Any]  # of one frame: {"frame", "confidence", "area", "mask"}
Others = list[list[float]]  # clicks on other objects that fall on this one's front: frame, x, y of each

_TAIL_BYTES = 1 << 16  # the last line of a file of some 1000 masks
OUTDATED = "outdated"  # done before a file said what flat front was found
_END = b'{"end"'
_INDEX_BYTES = 40  # of a frame in memory


class Masks(Protocol):
    """The masks computed for one state of an object's clicks."""

    end: str | None  # done | failed | cancelled | OUTDATED; None when it never came to an end
    error: dict[str, Any] | None
    front: dict[str, Any] | None  # its flat front, as app.jobs.front_wire says it; None where it has none
    others: Others  # drawn with these
    doubts: list[str]  # about its front, with what would mend them
    motions: list[dict[str, Any]]  # of its leaves, as app.jobs.motion_wire says them

    def __len__(self) -> int:
        """On how many frames there is one."""

    def seen(self) -> np.ndarray:
        """(n, 3): frame, confidence, share of the image; by frame."""

    def entry(self, frame: int) -> Entry | None:
        """One frame's."""


@dataclass(slots=True)
class MaskFile:
    """Masks in memory, while they are computed."""

    frames: dict[int, Entry] = field(default_factory=dict)
    end: str | None = None
    error: dict[str, Any] | None = None
    front: dict[str, Any] | None = None
    others: Others = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    motions: list[dict[str, Any]] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.frames)

    def seen(self) -> np.ndarray:
        """(n, 3): frame, confidence, share of the image; by frame."""
        rows = [(e["frame"], e["confidence"], e["area"]) for e in list(self.frames.values())]
        return np.array(sorted(rows), float).reshape(-1, 3)

    def entry(self, frame: int) -> Entry | None:
        """One frame's."""
        return self.frames.get(frame)


@dataclass(slots=True)
class StoredMasks:
    """Masks in a file: only where they are is in memory."""

    path: Path | str
    index: np.ndarray  # (n, 5): frame, confidence, share of the image, byte where its line begins, bytes of it; by frame
    end: str | None = None
    error: dict[str, Any] | None = None
    backend: str = ""  # that drew them, where the file says so
    front: dict[str, Any] | None = None
    others: Others = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    motions: list[dict[str, Any]] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.index)

    def seen(self) -> np.ndarray:
        """(n, 3): frame, confidence, share of the image; by frame."""
        return self.index[:, :3]

    def entry(self, frame: int) -> Entry | None:
        """One frame's; None also where the file was begun anew meanwhile."""
        at = int(self.index[:, 0].searchsorted(frame))
        if at == len(self.index) or self.index[at, 0] != frame:
            return None
        begin, size = self.index[at, 3:].tolist()
        try:
            found: Entry = json.loads(_part(self.path, int(begin), int(size)))
        except (OSError, ValueError):
            return None
        return found if found.get("frame") == frame else None

    @property
    def bytes(self) -> int:
        """About what it takes of the memory."""
        return 1000 + _INDEX_BYTES * len(self.index)


def mask_path(folder: Path, object_id: int, key: str) -> Path:
    """File of an object's masks."""
    return Path(mask_file(str(folder), object_id, key))


def mask_file(folder: str, object_id: int, key: str) -> str:
    """The same as text, for whoever looks at hundreds of objects at once: to make a Path takes longer than to look."""
    return f"{folder}/{object_id}/{key}.jsonl"


def begin(path: Path) -> None:
    """Forget older masks; until an end is written, whoever starts next knows that these are wanted."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")


def append(path: Path, line: dict[str, Any]) -> None:
    """Add one line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as handle:
        handle.write(json.dumps(line) + "\n")


def finish(path: Path, end: str, error: dict[str, Any] | None, masks: Masks | None = None) -> None:
    """Say how it came to its end, what flat front it has, what it was drawn with, and where each mask is."""
    about = masks or MaskFile()
    said: dict[str, Any] = {"end": end, "error": error, "front": about.front, "others": about.others}
    said |= {"doubts": about.doubts, "motions": about.motions}
    found = _scanned(path, path.read_bytes() if path.exists() else b"")
    append(path, said | {"index": _packed(found.index)})


def write(
    path: Path,
    entries: list[Entry],
    backend: str,
    front: dict[str, Any] | None = None,
    others: Others | None = None,
    motions: list[dict[str, Any]] | None = None,
) -> None:
    """A whole file at once, of what the backend drew."""
    lines, index, at = [], [], 0
    for entry in sorted(entries, key=lambda entry: int(entry["frame"])):
        line = json.dumps(entry).encode() + b"\n"
        index.append([entry["frame"], entry["confidence"], entry["area"], at, len(line)])
        lines.append(line)
        at += len(line)
    end: dict[str, Any] = {"end": "done", "error": None, "backend": backend, "front": front, "others": others or []}
    end |= {"motions": motions or []}
    end |= {"index": _packed(np.array(index, float))}
    write_atomically(path, b"".join(lines) + json.dumps(end).encode() + b"\n")


def read(path: Path | str) -> StoredMasks | None:
    """Where everything in the file is; a line cut off by a crash is dropped; None when there is nothing."""
    try:
        with open(path, "rb") as handle:
            size = handle.seek(0, os.SEEK_END)
            handle.seek(max(size - _TAIL_BYTES, 0))
            tail = handle.read()
            last = tail.rstrip(b"\n").rfind(b"\n") + 1
            if not tail[last:].startswith(_END) or b'"index"' not in tail[last:]:
                handle.seek(0)
                return _scanned(path, handle.read())
    except FileNotFoundError:
        return None
    try:
        return _ended(StoredMasks(path, np.zeros((0, 5))), json.loads(tail[last:]))
    except ValueError:
        return _scanned(path, Path(path).read_bytes())


def _part(path: Path | str, begin: int, size: int) -> bytes:
    """Some bytes of a file."""
    handle = os.open(path, os.O_RDONLY)
    try:
        return os.pread(handle, size, begin)
    finally:
        os.close(handle)


def _scanned(path: Path | str, content: bytes) -> StoredMasks:
    """The same from all lines: of a file without an end, or a long one."""
    found, at = StoredMasks(path, np.zeros((0, 5))), 0
    rows: dict[int, list[float]] = {}
    for raw in content.splitlines(keepends=True):
        begin, at = at, at + len(raw)
        try:
            line = json.loads(raw)
        except ValueError:
            continue
        if "end" in line:
            _ended(found, line)
        else:
            rows[int(line["frame"])] = [line["frame"], line["confidence"], line["area"], begin, len(raw)]
    found.index = np.array([rows[frame] for frame in sorted(rows)], float).reshape(-1, 5)
    return found


def _ended(found: StoredMasks, line: dict[str, Any]) -> StoredMasks:
    found.end, found.error, found.backend = line["end"], line.get("error"), line.get("backend", "")
    found.front, found.others = line.get("front"), line.get("others", [])  # older files: every object was drawn alone
    found.doubts, found.motions = line.get("doubts", []), line.get("motions", [])
    if found.end == "done" and "front" not in line:
        found.end = OUTDATED
    index = line.get("index", [])  # numbers, in files of before they were packed
    rows = np.frombuffer(base64.b64decode(index), "<f8") if isinstance(index, str) else np.array(index, float)
    found.index = rows.reshape(-1, 5)
    return found


def _packed(index: np.ndarray) -> str:
    """The index as base64: read in a fiftieth of the time that numbers take."""
    return base64.b64encode(index.astype("<f8").tobytes()).decode()
