"""Minimal interface to object stores (S3, GCS, Azure, a folder or memory), with the app's own errors."""

import contextlib
import fcntl
import hashlib
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from app.errors import Unavailable
from r2c2r_core.errors import EnvironmentProblem, InputError

LINK_S = 600  # a download address is valid for ten minutes: to start the download, not to finish it
RETRIED_S = 10.0  # total time of retries of one call: a store that does not answer must not hold a request for minutes
_CHUNK = 8 << 20
_HINT = "s3://BUCKET/PREFIX with AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or file:///FOLDER"


class Read(NamedTuple):
    """An object's content, and the tag that changes with it."""

    content: bytes
    tag: str


class Changed(Exception):
    """The object was modified by another writer."""


class Objects:
    """One object store."""

    def __init__(self, store: Any, folder: Path | None = None) -> None:
        self._store, self._folder = store, folder  # a folder has no conditional writes of its own

    def read(self, name: str, *, unless: str | None = None) -> Read | None:
        """The object, or None. Raises NotModified if its tag equals `unless`."""
        import obstore

        with _said():
            try:
                found = obstore.get(self._store, name, options={"if_none_match": unless} if unless else {})
                return Read(bytes(found.bytes()), str(found.meta["e_tag"]))
            except FileNotFoundError:
                return None
            except obstore.exceptions.NotModifiedError as error:
                raise NotModified from error

    def write(self, name: str, content: bytes, *, after: str | None) -> str:
        """Write the object if its tag is still `after` (None: if it does not exist), and return its tag. Raises Changed."""
        import obstore

        with _said(), self._alone():
            try:
                if after is None:
                    return str(obstore.put(self._store, name, content, mode="create")["e_tag"])
                if self._folder is None:
                    return str(obstore.put(self._store, name, content, mode={"e_tag": after})["e_tag"])
                if obstore.head(self._store, name)["e_tag"] != after:
                    raise Changed
                return str(obstore.put(self._store, name, content)["e_tag"])
            except (FileNotFoundError, obstore.exceptions.AlreadyExistsError, obstore.exceptions.PreconditionError) as error:
                raise Changed from error

    def put(self, name: str, path: Path) -> None:
        """Write an object from a file, unconditionally."""
        import obstore

        with _said():
            obstore.put(self._store, name, path)

    def get(self, name: str, path: Path) -> str:
        """Write a file from an object and return its SHA-256. Raises FileNotFoundError where there is no object."""
        import obstore

        digest = hashlib.sha256()
        with _said(), path.open("wb") as file:
            for chunk in obstore.get(self._store, name).stream(min_chunk_size=_CHUNK):
                digest.update(chunk)
                file.write(chunk)
        return digest.hexdigest()

    def has(self, name: str) -> bool:
        """Whether the object exists."""
        return self._modified(name) is not None

    def old(self, prefix: str, age: timedelta) -> list[str]:
        """Names below the prefix of objects older than `age`."""
        import obstore

        with _said():
            found = [entry for chunk in obstore.list(self._store, prefix) for entry in chunk]
        return [entry["path"] for entry in found if entry["last_modified"] <= datetime.now(UTC) - age]

    def delete(self, names: list[str]) -> None:
        """Delete the existing ones of these objects."""
        import obstore

        with _said():
            for name in names:
                with contextlib.suppress(FileNotFoundError):
                    obstore.delete(self._store, name)

    def link(self, name: str, as_name: str, *, fresh: timedelta) -> str | None:
        """A presigned address of a copy of the object, valid for LINK_S, ending in `as_name`; None where the store has none.

        A copy older than `fresh` is made again, so that its age tells when it was last linked to.
        """
        import obstore

        if not isinstance(self._store, obstore.store.S3Store | obstore.store.GCSStore | obstore.store.AzureStore):
            return None
        with _said():
            made = self._modified(as_name)
            if made is None or made <= datetime.now(UTC) - fresh:
                obstore.copy(self._store, name, as_name)
            return str(obstore.sign(self._store, "GET", as_name, timedelta(seconds=LINK_S)))

    def _modified(self, name: str) -> datetime | None:
        """Time of the last change; None where there is no object."""
        import obstore

        with _said():
            try:
                modified: datetime = obstore.head(self._store, name)["last_modified"]
            except FileNotFoundError:
                return None
            return modified

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        if self._folder is None:
            yield
            return
        with (self._folder / ".lock").open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


class NotModified(Exception):
    """The object is unchanged."""


def open_objects(address: str) -> Objects:
    """The object store at an address; raises InputError for an invalid one, EnvironmentProblem without its library."""
    try:
        import obstore
    except ModuleNotFoundError as error:
        raise EnvironmentProblem(f"no module {error.name}", hint="pip install 'r2c2r[store]'") from error
    folder = Path(address.removeprefix("file://")) if address.startswith("file://") else None
    try:
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        store = obstore.store.from_url(address, retry_config={"max_retries": 3, "retry_timeout": timedelta(seconds=RETRIED_S)})
        return Objects(store, folder)
    except (obstore.exceptions.BaseError, ValueError, OSError) as error:
        raise InputError(f"R2C2R_STORE {address[:80]!r}: {_first_line(error)}", hint=_HINT) from error


@contextlib.contextmanager
def _said() -> Iterator[None]:
    import obstore

    try:
        yield
    except (obstore.exceptions.NotFoundError, obstore.exceptions.AlreadyExistsError):
        raise
    except obstore.exceptions.BaseError as error:
        raise Unavailable(f"the store of files: {_first_line(error)}", hint="try again in a moment") from error


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:200]
