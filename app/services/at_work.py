"""Locks on uploads being processed, so that concurrent requests do not interfere."""

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from app.errors import Unavailable

Work = Literal["sent", "finished", "deleted"]

_WAIT_FOR: dict[Work, tuple[Work, ...]] = {  # an upload may be deleted while it is still being sent
    "sent": ("sent", "finished", "deleted"),
    "finished": ("sent", "finished", "deleted"),
    "deleted": ("finished", "deleted"),
}
_SAID: dict[Work, tuple[str, str]] = {
    "sent": ("another request is still sending this file", "wait a moment, then ask for its offset"),
    "finished": ("this upload is being turned into a project", "wait a moment, then delete the project"),
    "deleted": ("this upload is being deleted", "begin it anew"),
}


@dataclass(slots=True)
class AtWork:
    """Upload locks of one server, as a data folder has one server at a time."""

    _under_way: dict[str, list[Work]] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @contextlib.contextmanager
    def on(self, upload_id: str, work: Work) -> Iterator[None]:
        """Context of work on the upload; raises Unavailable during conflicting work."""
        with self._lock:
            others = self._under_way.get(upload_id, [])
            for other in _WAIT_FOR[work]:
                if other in others:
                    raise Unavailable(_SAID[other][0], hint=_SAID[other][1])
            self._under_way.setdefault(upload_id, []).append(work)
        try:
            yield
        finally:
            with self._lock:
                self._under_way[upload_id].remove(work)
                if not self._under_way[upload_id]:
                    del self._under_way[upload_id]
