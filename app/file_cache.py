"""LRU cache of values derived from files, invalidated by modification time and bounded by bytes."""

import os
import threading
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class FileCache(Generic[T]):
    """Thread-safe cache; two concurrent callers may both compute a value, of which one is kept."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes, self._bytes = most_bytes, 0
        self._kept: OrderedDict[Any, tuple[int, int, T]] = OrderedDict()  # mtime, bytes, value; least recently used first
        self._lock = threading.Lock()

    def get(self, path: Path | str, make: Callable[[], T], size_of: Callable[[T, int], int], about: Any = None) -> T | None:
        """Value made from the file, with `about` distinguishing several values per file; None where there is no file.

        `size_of` gives the bytes of a value, from it and the size of the file.
        """
        try:
            found = os.stat(path)
        except FileNotFoundError:
            return None
        key = (path, about)
        with self._lock:
            kept = self._kept.get(key)
            if kept is not None and kept[0] == found.st_mtime_ns:
                self._kept.move_to_end(key)
                return kept[2]
        made = make()
        self._keep(key, found.st_mtime_ns, size_of(made, found.st_size), made)
        return made

    @property
    def bytes(self) -> int:
        """Size of the cache in bytes."""
        return self._bytes

    def _keep(self, key: Any, changed: int, size: int, made: T) -> None:
        with self._lock:
            old = self._kept.pop(key, None)
            self._bytes += size - (old[1] if old else 0)
            self._kept[key] = (changed, size, made)
            while self._bytes > self._most_bytes:
                _, (_, freed, _) = self._kept.popitem(last=False)
                self._bytes -= freed
