"""The data folder as a cache of projects in an object store.

For each project the store has its files as content-addressed objects, and one manifest that maps files to contents. The
manifest is written conditionally (compare-and-swap), so that it is consistent even if a machine dies. It also names the
holder whose job makes the nouns: a machine that was silent for so long that another took over its job cannot store results
any more. A local note of each manifest as last seen separates local from remote changes; of files changed on both sides, the
last stored version wins.
"""

import hashlib
import json
import logging
import os
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import NamedTuple

from app.errors import NotFound, Unavailable
from app.files import delete_folder
from app.store.objects import Changed, NotModified, Objects, Read
from r2c2r_core.workspace import write_atomically

_log = logging.getLogger(__name__)

AT_ONCE = 16  # concurrent transfers: a recording is thousands of small objects
TRIES = 20  # for a manifest that others write too
UNUSED_S = 600.0  # minimum time that a page may read requested files
UNNAMED = timedelta(hours=1)  # minimum age of an unreferenced object to be deleted, as it may be about to be referenced
_MADE_ANEW = ("previews", "logs")  # not stored: recreated on demand; published while written: keep_log
_RECORDING = "source/"
_CLICKS_BESIDE_IT = "source/prompts.json"  # of a sample: read when it becomes a project
_MADE_BY_JOBS = ("work/", "bundles/", "variants/", "requests/", "finished-prompts.json", "finished-inputs.json")
_HALF_MADE = "half-made"


class Entry(NamedTuple):
    """One file: its content digest, and its modification time, which identifies recordings that are folders."""

    sha256: str
    size: int  # bytes
    mtime_ns: int


class Lost(NotFound):
    """Another machine has taken over the project's job."""


Names = dict[str, Entry]
_NONE = Entry("", -1, -1)


@dataclass(slots=True)
class Held:
    """Local state of a project: its files as last synchronised; `tag` is the manifest's tag if all wanted files are local."""

    names: Names = field(default_factory=dict)
    tag: str | None = None
    recording: bool = False  # whether its recording was requested


class Manifest(NamedTuple):
    """Files of a project, and the holder that writes them."""

    names: Names
    holder: str


class Mirror:
    """A Store (app.store.protocol) of objects. `quota_bytes` limits the local cache; None: unlimited."""

    def __init__(self, objects: Objects, data_dir: Path, quota_bytes: int | None = None) -> None:
        self._objects, self._quota = objects, quota_bytes
        self._projects, self._notes = data_dir / "projects", data_dir / "stored"
        self._folders: defaultdict[str, threading.RLock] = defaultdict(threading.RLock)  # note and files; never for a transfer
        self._storing: defaultdict[str, threading.RLock] = defaultdict(threading.RLock)  # one upload of a project at a time
        self._holders: dict[str, str] = {}  # this machine's holder name in manifests, by project
        self._used: dict[str, float] = {}
        self._seen: set[str] = set()  # projects requested since their last upload
        self._swept: dict[str, float] = {}

    def fetch(self, project_id: str, *, recording: bool = False) -> None:
        """Download remote changes since the last synchronisation."""
        for _ in range(TRIES):
            with self._folders[project_id]:
                self._used[project_id] = time.monotonic()
                self._seen.add(project_id)
                if not (self._projects / project_id).is_dir():
                    self._note_path(project_id).unlink(missing_ok=True)  # its files were deleted by hand
                held = self._held(project_id)
            complete = held.recording or not recording
            try:
                found = self._objects.read(_manifest(project_id), unless=held.tag if complete else None)
            except NotModified:
                return
            if found is None or self._take(project_id, held, found, recording=recording or held.recording):
                return
        raise Unavailable(f"{project_id}: its files keep changing", hint="try again in a moment")

    def keep(self, project_id: str) -> None:
        """Upload local changes since the last synchronisation.

        Raises NotFound if the project was deleted, and Lost if its job was taken over: its local results are then discarded.
        """
        root = self._projects / project_id
        with self._storing[project_id]:
            with self._folders[project_id]:
                held, here = self._held(project_id), _lying(root)
            changed = _read(root, {path: state for path, state in here.items() if held.names.get(path, _NONE)[1:] != state})
            gone = held.names.keys() - here.keys()
            if not changed and not gone:
                return
            given: set[str] = set()
            for _ in range(TRIES):
                found = self._objects.read(_manifest(project_id))
                if found is None and held.names:
                    raise NotFound(f"{project_id}: the project was deleted", hint="see the list of projects")
                before, holder = _said(found)
                if self._holders.get(project_id, holder) != holder:
                    self._drop(project_id, changed, gone)
                changed = self._give(project_id, changed, {entry.sha256 for entry in before.values()} | given)
                given |= {entry.sha256 for entry in changed.values()}
                names = {path: entry for path, entry in before.items() if path not in gone} | changed
                try:
                    tag = self._objects.write(
                        _manifest(project_id), _written(Manifest(names, holder)), after=found.tag if found else None
                    )
                except Changed:
                    continue
                with self._folders[project_id]:
                    held = self._held(project_id)
                    alone = found is None or found.tag == held.tag  # others' uploads are still to be fetched
                    mine = {path: entry for path, entry in held.names.items() if path not in gone} | changed
                    self._note(project_id, Held(mine, tag if alone else None, held.recording))
                self._sweep(project_id, names)
                return
            raise Unavailable(f"{project_id}: its files keep changing", hint="try again in a moment")

    def hold(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Enter the holder in the manifest; raises NotFound where the project was deleted."""
        with self._storing[project_id]:
            if not taken:
                self._take_hold(project_id, holder)
            self._holders[project_id] = holder

    def keep_log(self, project_id: str, log: Path) -> None:
        """Upload the log in its current state."""
        with suppress(FileNotFoundError):  # not written yet, or deleted with its project
            self._objects.put(_log_of(project_id, log), log)

    def fetch_log(self, project_id: str, log: Path) -> None:
        """Download the last uploaded log."""
        found = self._objects.read(_log_of(project_id, log))
        if found is not None:
            write_atomically(log, found.content)

    def link(self, project_id: str, path: Path, name: str) -> str | None:
        """A presigned address of a stored file."""
        root = self._projects / project_id
        entry = self._held(project_id).names.get(path.relative_to(root).as_posix())
        if entry is None:
            return None
        copy = f"projects/{project_id}/downloads/{entry.sha256}/{name}"
        return self._objects.link(_object(project_id, entry), copy, fresh=UNNAMED / 2)

    def size(self, project_id: str) -> int:
        """Size in bytes of all files in the manifest."""
        found = self._objects.read(_manifest(project_id))
        return sum(entry.size for entry in _said(found).names.values())

    def delete(self, project_id: str) -> None:
        """Delete all objects of the project, its manifest first, so that later uploads are refused."""
        with self._storing[project_id]:
            self._objects.delete([_manifest(project_id)])
            self._objects.delete(self._objects.old(f"projects/{project_id}/", timedelta()))
            self._note_path(project_id).unlink(missing_ok=True)

    def was_deleted(self, project_id: str) -> bool:
        """Whether the project was synchronised here, and its manifest no longer exists."""
        return self._note_path(project_id).exists() and not self._objects.has(_manifest(project_id))

    def tidy(self, in_use: frozenset[str]) -> None:
        """Upload pending changes of recently requested projects; delete the least recently used local ones beyond the quota."""
        seen, self._seen = self._seen, set()
        for project_id in seen:
            if (self._projects / project_id).is_dir():
                self._keep_or_forget(project_id)
        if self._quota is None:
            return
        sizes = {note.stem: sum(entry.size for entry in self._held(note.stem).names.values()) for note in self._noted()}
        over = sum(sizes.values()) - self._quota
        for project_id in sorted(sizes.keys() - in_use, key=lambda one: self._used.get(one, 0.0)):
            if over <= 0:
                return
            if self._is_unused(project_id):
                self._evict(project_id)
                over -= sizes[project_id]

    def _evict(self, project_id: str) -> None:
        with self._storing[project_id]:
            self._keep_or_forget(project_id)
            with self._folders[project_id]:
                if self._is_unused(project_id):  # it may have been requested during the upload
                    self._forget(project_id)

    def _forget(self, project_id: str) -> None:
        self._note_path(project_id).unlink(missing_ok=True)  # first, so that missing files do not count as deletions
        delete_folder(self._projects / project_id)

    def _is_unused(self, project_id: str) -> bool:
        return time.monotonic() - self._used.get(project_id, -UNUSED_S) >= UNUSED_S

    def _keep_or_forget(self, project_id: str) -> None:
        try:
            self.keep(project_id)
        except Lost as lost:
            _log.warning("%s", lost)
        except NotFound:  # permanently deleted by another machine: remove it from the cache
            with self._folders[project_id]:
                self._forget(project_id)

    def _take_hold(self, project_id: str, holder: str) -> None:
        known = self._held(project_id).names
        for _ in range(TRIES):
            found = self._objects.read(_manifest(project_id))
            if found is None and known:
                raise NotFound(f"{project_id}: the project was deleted", hint="see the list of projects")
            with suppress(Changed):
                content = _written(Manifest(_said(found).names, holder))
                self._objects.write(_manifest(project_id), content, after=found.tag if found else None)
                return
        raise Unavailable(f"{project_id}: its files keep changing", hint="try again in a moment")

    def _drop(self, project_id: str, changed: Names, gone: set[str]) -> None:
        """Discard local results of a lost job; raises Lost."""
        stale = {path for path in (*changed, *gone) if path.startswith(_MADE_BY_JOBS)}
        with self._folders[project_id]:
            for path in stale & changed.keys():
                (self._projects / project_id / path).unlink(missing_ok=True)
            held = self._held(project_id)
            kept = {path: entry for path, entry in held.names.items() if path not in stale}
            self._note(project_id, Held(kept, None, held.recording))
        del self._holders[project_id]
        raise Lost(f"{project_id}: another machine goes on with its job")

    def _take(self, project_id: str, held: Held, found: Read, *, recording: bool) -> bool:
        """Download the manifest's files that changed since `held`; False where another transfer ended meanwhile."""
        root, names = self._projects / project_id, _said(found).names
        wanted = _wanted(names, recording=recording)
        missing = {
            path: entry for path, entry in wanted.items() if held.names.get(path) != entry and _state(root / path) != entry[1:]
        }
        parts = {path: _part_of(root / path) for path in missing}
        try:
            with ThreadPoolExecutor(AT_ONCE) as pool:
                list(pool.map(lambda path: self._get(project_id, parts[path], missing[path]), missing))
            with self._folders[project_id]:
                now = self._held(project_id)
                others = {path for path in now.names.keys() | names.keys() if now.names.get(path) != held.names.get(path)}
                for path in missing.keys() - others:
                    parts[path].replace(root / path)
                for path in held.names.keys() - names.keys() - others:
                    if _state(root / path) == held.names[path][1:]:
                        (root / path).unlink(missing_ok=True)
                kept = {path: entry for path, entry in now.names.items() if path in names or path in others}
                kept |= {path: entry for path, entry in wanted.items() if path not in others}
                alone = now == held
                self._note(project_id, Held(kept, found.tag if alone else None, recording or now.recording))
                return alone
        except FileNotFoundError:  # an object was replaced, or the folder evicted
            return False
        finally:
            for part in parts.values():
                part.unlink(missing_ok=True)

    def _get(self, project_id: str, part: Path, entry: Entry) -> None:
        part.parent.mkdir(parents=True, exist_ok=True)
        name = _object(project_id, entry)
        if self._objects.get(name, part) != entry.sha256:
            raise Unavailable(f"{name}: the store returned other bytes than were stored", hint="try again in a moment")
        os.utime(part, ns=(entry.mtime_ns, entry.mtime_ns))

    def _give(self, project_id: str, changed: Names, there: set[str]) -> Names:
        """Upload missing objects and return the stored entries. A file written meanwhile is left for the next time."""
        with ThreadPoolExecutor(AT_ONCE) as pool:
            new = {path: entry for path, entry in changed.items() if entry.sha256 not in there}
            put = pool.map(lambda item: self._put(project_id, *item), new.items())
            failed = {path for path, whole in zip(new, put, strict=True) if not whole}
        return {path: entry for path, entry in changed.items() if path not in failed}

    def _put(self, project_id: str, path: str, entry: Entry) -> bool:
        file, name = self._projects / project_id / path, _object(project_id, entry)
        try:
            self._objects.put(name, file)
        except FileNotFoundError:
            return False
        whole = _state(file) == entry[1:]
        if not whole:
            self._objects.delete([name])
        return whole

    def _sweep(self, project_id: str, names: Names) -> None:
        """Occasionally delete replaced objects and download copies."""
        if time.monotonic() - self._swept.setdefault(project_id, time.monotonic()) < UNNAMED.total_seconds():
            return
        self._swept[project_id] = time.monotonic()
        named = {_object(project_id, entry) for entry in names.values()}
        old = [name for part in ("files", "downloads") for name in self._objects.old(f"projects/{project_id}/{part}/", UNNAMED)]
        self._objects.delete([name for name in old if name not in named])

    def _held(self, project_id: str) -> Held:
        if not (self._projects / project_id).is_dir():
            return Held()
        try:
            said = json.loads(self._note_path(project_id).read_text())
        except (FileNotFoundError, ValueError):
            return Held()
        return Held({path: Entry(*entry) for path, entry in said["names"].items()}, said["tag"], said["recording"])

    def _note(self, project_id: str, held: Held) -> None:
        said = {"names": held.names, "tag": held.tag, "recording": held.recording}
        write_atomically(self._note_path(project_id), json.dumps(said, separators=(",", ":")).encode())

    def _noted(self) -> Iterator[Path]:
        return self._notes.glob("*.json")

    def _note_path(self, project_id: str) -> Path:
        return self._notes / f"{project_id}.json"


def _wanted(names: Names, *, recording: bool) -> Names:
    def wanted(path: str) -> bool:
        return recording or not path.startswith(_RECORDING) or path == _CLICKS_BESIDE_IT

    return {path: entry for path, entry in names.items() if wanted(path)}


def _lying(root: Path) -> dict[str, tuple[int, int]]:
    """Size and modification time of each file to be stored."""
    found: dict[str, tuple[int, int]] = {}
    for parent, folders, files in os.walk(root):
        if Path(parent) == root:
            folders[:] = [name for name in folders if name not in _MADE_ANEW]
        for name in files:
            path = Path(parent, name)
            state = None if name == _HALF_MADE or name.endswith((".tmp", ".part")) else _state(path)
            if state is not None:
                found[path.relative_to(root).as_posix()] = state
    return found


def _part_of(path: Path) -> Path:
    """Where this thread downloads a file before it is put in place."""
    return path.with_name(f".{path.name}.{threading.get_ident()}.tmp")


def _state(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except FileNotFoundError:  # workers write during the scan
        return None
    return found.st_size, found.st_mtime_ns


def _said(found: Read | None) -> Manifest:
    if found is None:
        return Manifest({}, "")
    said = json.loads(found.content)
    return Manifest({path: Entry(*entry) for path, entry in said["files"].items()}, said.get("holder", ""))


def _written(manifest: Manifest) -> bytes:
    return json.dumps({"version": 1, "files": manifest.names, "holder": manifest.holder}, separators=(",", ":")).encode()


def _manifest(project_id: str) -> str:
    return f"projects/{project_id}/manifest.json"


def _object(project_id: str, entry: Entry) -> str:
    return f"projects/{project_id}/files/{entry.sha256}"


def _log_of(project_id: str, log: Path) -> str:
    return f"projects/{project_id}/logs/{log.name}"


def _read(root: Path, states: dict[str, tuple[int, int]]) -> Names:
    found: Names = {}
    for path, state in states.items():
        with suppress(FileNotFoundError), (root / path).open("rb") as handle:
            found[path] = Entry(hashlib.file_digest(handle, "sha256").hexdigest(), *state)
    return found
