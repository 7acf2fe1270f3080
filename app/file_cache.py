"""What was made of files, kept while they are as they were: bounded by bytes, for entries may be of any size."""

import os
import threading
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class FileCache(Generic[T]):
    """Safe to use from any thread; two that ask at once may both make it, and one stays."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes, self._bytes = most_bytes, 0
        self._kept: OrderedDict[Any, tuple[int, int, T]] = OrderedDict()  # changed, bytes, made; the longest unused first
        self._lock = threading.Lock()

    def get(self, path: Path | str, make: Callable[[], T], size_of: Callable[[T, int], int], about: Any = None) -> T | None:
        """What is made of the file, `about` telling apart several things made of it; None where there is no file.

        `size_of` says how many bytes are kept, of what was made and from the size of the file.
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
        """What is kept."""
        return self._bytes

    def _keep(self, key: Any, changed: int, size: int, made: T) -> None:
        with self._lock:
            old = self._kept.pop(key, None)
            self._bytes += size - (old[1] if old else 0)
            self._kept[key] = (changed, size, made)
            while self._bytes > self._most_bytes:
                _, (_, freed, _) = self._kept.popitem(last=False)
                self._bytes -= freed
