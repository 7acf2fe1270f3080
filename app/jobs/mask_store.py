"""Masks on disk: one file per object and prompt state, one JSON line per mask, so that undo finds older ones.

The last line of a complete file is an index of the frames' lines, so that reading one frame reads one line.
It also lists the clicks on other objects with which the masks were computed. These are not part of the key, as only the
prepared recording shows which clicks fall on a front, long after the key is stored. The live segmenter compares them with
the current ones at its start and at every change, and recomputes the masks where they split the front differently.
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
Others = list[list[float]]  # clicks on other objects on this one's front: frame, x, y of each

_TAIL_BYTES = 1 << 16  # size of the last line of a file of some 1000 masks
OUTDATED = "outdated"  # written by a version that did not store the flat front
_END = b'{"end"'
_INDEX_BYTES = 40  # of a frame in memory


class Masks(Protocol):
    """Protocol of the masks for one state of an object's clicks."""

    end: str | None  # done | failed | cancelled | OUTDATED; None if incomplete
    error: dict[str, Any] | None
    front: dict[str, Any] | None  # its flat front, in the format of app.jobs.front_wire, or None
    others: Others  # clicks on other objects used
    doubts: list[str]  # about its front, with remedies
    motions: list[dict[str, Any]]  # of its leaves, in the format of app.jobs.motion_wire

    def __len__(self) -> int:
        """Number of frames with a mask."""

    def seen(self) -> np.ndarray:
        """(n, 3): frame, confidence, share of the image; by frame."""

    def entry(self, frame: int) -> Entry | None:
        """The mask of one frame."""


@dataclass(slots=True)
class MaskFile:
    """Masks in memory during computation."""

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
        """The mask of one frame."""
        return self.frames.get(frame)


@dataclass(slots=True)
class StoredMasks:
    """Masks in a file, with only the index in memory."""

    path: Path | str
    index: np.ndarray  # (n, 5): frame, confidence, share of the image, byte where its line begins, bytes of it; by frame
    end: str | None = None
    error: dict[str, Any] | None = None
    backend: str = ""  # segmenter that computed them, if stored in the file
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
        """The mask of one frame; None also where the file was restarted meanwhile."""
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
        """Approximate memory use in bytes."""
        return 1000 + _INDEX_BYTES * len(self.index)


def mask_path(folder: Path, object_id: int, key: str) -> Path:
    """File of an object's masks."""
    return Path(mask_file(str(folder), object_id, key))


def mask_file(folder: str, object_id: int, key: str) -> str:
    """The same as text, for loops over hundreds of objects, where constructing a Path would dominate."""
    return f"{folder}/{object_id}/{key}.jsonl"


def begin(path: Path) -> None:
    """Start an empty file, which marks the masks as wanted until an end is written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")


def append(path: Path, line: dict[str, Any]) -> None:
    """Add one line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as handle:
        handle.write(json.dumps(line) + "\n")


def finish(path: Path, end: str, error: dict[str, Any] | None, masks: Masks | None = None) -> None:
    """Append the last line: end state, flat front, other clicks used, and the index of masks."""
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
    """Write a complete file at once."""
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
    """Index of a file; a line truncated by a crash is dropped; None when there is nothing."""
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
    """A byte range of a file."""
    handle = os.open(path, os.O_RDONLY)
    try:
        return os.pread(handle, size, begin)
    finally:
        os.close(handle)


def _scanned(path: Path | str, content: bytes) -> StoredMasks:
    """The index from all lines, for an incomplete file, or a long last line."""
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
    found.front, found.others = (
        line.get("front"),
        line.get("others", []),
    )  # older files: every object was segmented independently
    found.doubts, found.motions = line.get("doubts", []), line.get("motions", [])
    if found.end == "done" and "front" not in line:
        found.end = OUTDATED
    index = line.get("index", [])  # numbers, in files of older versions
    rows = np.frombuffer(base64.b64decode(index), "<f8") if isinstance(index, str) else np.array(index, float)
    found.index = rows.reshape(-1, 5)
    return found


def _packed(index: np.ndarray) -> str:
    """The index as base64, which is read 50 times faster than JSON numbers."""
    return base64.b64encode(index.astype("<f8").tobytes()).decode()
