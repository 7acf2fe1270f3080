"""A reconstruction on disk: location and key of each noun, and whether it can be reused.

WORKDIR/
├── capture/<key>/                               frames, normalised (ingest/store.py); the key identifies their source
├── cache/                                       a segmenter's prepared data
├── nouns/<stage>/<name>.noun                    one file per stage and object, written atomically
├── seconds.json                                 duration of each stage
└── bundle.zip                                   the result

A noun's key is the hash of its stage's version and configuration and of its inputs' keys, so a changed setting or click
re-runs exactly its dependents, and a run resumes where a crash stopped it.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import threading
import time
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from r2c2r_core.codec import decode_header, decode_noun, encode_noun
from r2c2r_core.disk import explained_io
from r2c2r_core.errors import CaptureError, EnvironmentProblem
from r2c2r_core.model.capture import Capture, Scan

T = TypeVar("T")

_UNREADABLE = (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile)


class Workspace:
    """The folder of one reconstruction, created by the first write, not by reading."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.computed: list[str] = []  # "stage/name" of nouns computed by this process rather than loaded

    def store(self, key: str) -> Path:
        """Folder of the normalised frames with this key."""
        return self.root / "capture" / key

    @property
    def frames(self) -> Path:
        """Folder of the frames of the last stored capture."""
        return frames_folder(self.root)

    def keep_frames(self, key: str) -> None:
        """Delete the frames of all other keys, which no noun refers to any more."""
        for path in self.store("").iterdir():
            if path.name != key:
                shutil.rmtree(path, ignore_errors=True)

    @property
    def cache(self) -> Path:
        """Cache folder of a segmenter."""
        return self.root / "cache"

    @property
    def bundle(self) -> Path:
        """The finished bundle."""
        return self.root / "bundle.zip"

    def keep_seconds(self, seconds: Mapping[str, float]) -> None:
        """Store the duration of each stage, here and not in the bundle, whose bytes depend on its inputs only."""
        write_atomically(self.root / "seconds.json", json.dumps({k: round(v, 3) for k, v in seconds.items()}).encode())

    def seconds(self) -> dict[str, float]:
        """Duration of each stage of the last finished run; empty without one."""
        try:
            return {str(stage): float(taken) for stage, taken in json.loads((self.root / "seconds.json").read_bytes()).items()}
        except (OSError, ValueError, TypeError, AttributeError):
            return {}

    def noun_path(self, stage: str, name: str) -> Path:
        """File of one noun."""
        return noun_path(self.root, stage, name)

    def once(self, stage: str, name: str, key: str, compute: Callable[[], T]) -> tuple[T, float]:
        """The stored noun if its key matches, else computed and stored; with the seconds its computation took."""
        found = self.find(stage, name, key)
        if found is not None:
            return found
        started = time.monotonic()
        noun = compute()
        seconds = time.monotonic() - started
        self.computed.append(f"{stage}/{name}")
        self.save(stage, name, noun, {"key": key, "seconds": seconds})
        return noun, seconds

    def find(self, stage: str, name: str, key: str) -> tuple[Any, float] | None:
        """The stored noun and its seconds if its key matches; a damaged one, or one that lacks a frame, counts as absent."""
        path = self.noun_path(stage, name)
        try:
            if decode_header(path)["key"] != key:
                return None
            noun, header = decode_noun(path.read_bytes())
            return self._attached(noun, header), float(header["seconds"])
        except (*_UNREADABLE, CaptureError):
            return None

    def load_latest(self, stage: str, name: str) -> Any | None:
        """The stored noun regardless of its key (for display, never for computation); None without one."""
        path = self.noun_path(stage, name)
        try:
            noun, header = decode_noun(path.read_bytes())
        except _UNREADABLE:
            return None
        return self._attached(noun, header)

    def load_bare(self, stage: str, name: str) -> Any | None:
        """`load_latest` without a capture's images, for code that needs only its cameras."""
        try:
            return decode_noun(self.noun_path(stage, name).read_bytes())[0]
        except _UNREADABLE:
            return None

    def names(self, stage: str) -> list[str]:
        """Names of the objects with stored nouns of a stage; names with a hyphen are results for all objects, and omitted."""
        return sorted(path.stem for path in (self.root / "nouns" / stage).glob("*.noun") if "-" not in path.stem)

    def save(self, stage: str, name: str, noun: object, header: dict[str, Any]) -> None:
        """Store a noun atomically."""
        if isinstance(noun, Capture | Scan):
            header = {**header, "frames": getattr(noun.images, "store", Path()).name}
            noun = replace(noun, images=None)  # type: ignore[arg-type]  # re-attached by _attached when loaded
        write_atomically(self.noun_path(stage, name), encode_noun(noun, header))

    def forget(self, stage: str, name: str) -> None:
        """Delete a stored noun, so that it is computed again."""
        self.noun_path(stage, name).unlink(missing_ok=True)

    @contextlib.contextmanager
    def locked(self, parts: Collection[str] = ()) -> Iterator[None]:
        """Lock the workspace, or only these parts of it ("stage/name"), while other processes may lock other parts.

        Raises EnvironmentProblem when another process has locked it, or one of the parts.
        """
        with explained_io(self.root), contextlib.ExitStack() as opened:
            self.root.mkdir(parents=True, exist_ok=True)
            whole = opened.enter_context((self.root / ".lock").open("w"))
            shares = opened.enter_context((self.root / ".parts").open("w")) if parts else whole
            held = opened.pop_all()
        with held:
            try:
                fcntl.flock(whole, (fcntl.LOCK_SH if parts else fcntl.LOCK_EX) | fcntl.LOCK_NB)
                for part in parts:
                    fcntl.lockf(shares, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _byte_of(part))
            except OSError as error:
                raise EnvironmentProblem(
                    f"{self.root}: another run is using this folder", hint="wait for it, or choose another --workdir"
                ) from error
            yield

    def _attached(self, noun: Any, header: Mapping[str, Any]) -> Any:
        if not isinstance(noun, Capture | Scan):
            return noun
        from r2c2r_core.ingest.stage import open_images

        return replace(noun, images=open_images(self.store(header.get("frames", "")), noun.frames))


def _byte_of(part: str) -> int:
    """Byte offset in the lock file that represents the part; it need not exist."""
    return int.from_bytes(hashlib.sha256(part.encode()).digest()[:7])


def noun_path(root: Path, stage: str, name: str) -> Path:
    """File of one noun below a workspace; it need not exist."""
    return root.joinpath("nouns", stage, f"{name}.noun")


def frames_folder(root: Path) -> Path:
    """Folder of the frames of the last stored capture below a workspace; `capture` itself without one."""
    try:
        header = decode_header(noun_path(root, "ingest", "scene"))
    except _UNREADABLE:
        header = {}
    return root / "capture" / str(header.get("frames", ""))


def content_key(*parts: object) -> str:
    """Short hash of configurations, inputs and other keys; equal parts give equal keys."""
    return hashlib.sha256(json.dumps(_plain(parts), sort_keys=True).encode()).hexdigest()[:32]


def file_key(path: Path) -> str:
    """Key of a recording: a file by its content, a folder by its members' names, sizes and times."""
    if path.is_file():
        with path.open("rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    members = sorted(p for p in path.rglob("*") if p.is_file())
    return content_key([[str(p.relative_to(path)), p.stat().st_size, p.stat().st_mtime_ns] for p in members])


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically, so that readers see either the old or the new content.

    Threads and processes may write the same file at once: the last one wins.
    """
    with explained_io(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, content)


def replace_file(path: Path, content: bytes) -> None:
    """Write a file atomically into an existing folder; raises OSError."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}.tmp")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _plain(value: Any) -> Any:
    if value is None or type(value) in (str, int, float, bool):  # the most common types; a subclass may be NumPy's
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bytes):  # of a packed mask
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    return value
