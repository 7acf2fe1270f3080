"""What happened, told to every open tab: numbered messages in memory, so that a tab that was away can catch up."""

import asyncio
import secrets
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any

Message = dict[str, Any]

QUEUE_LIMIT = 5000  # messages waiting for one tab


@dataclass(eq=False, slots=True)
class Listener:
    """One tab. `project` is the one it looks at; messages of other projects reach it only when they are about jobs."""

    queue: "asyncio.Queue[Message]"
    loop: asyncio.AbstractEventLoop
    project: str | None = None
    who: str = ""  # the person; nobody's listener is not shown to others
    page: str = ""
    object: int | None = None  # the one it works on
    tab: str = field(default_factory=lambda: secrets.token_hex(4))

    def take(self, message: Message, epoch: str) -> None:
        """Queue the message; a tab that does not keep up is told to fetch everything anew instead."""
        if self.queue.qsize() >= QUEUE_LIMIT:
            while not self.queue.empty():
                self.queue.get_nowait()
            message = {"type": "hello", "epoch": epoch, "seq": message["seq"], "reset": True}
        self.queue.put_nowait(message)

    def wants(self, message: Message) -> bool:
        """Whether this tab shows what the message is about."""
        return message["type"] in ("job", "projects") or message.get("project") == self.project


@dataclass(slots=True)
class Hub:
    """Safe to publish to from any thread."""

    keep: int = 4000
    epoch: str = field(default_factory=lambda: secrets.token_hex(8))
    _seq: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _listeners: set[Listener] = field(default_factory=set)
    _recent: "deque[Message]" = field(default_factory=lambda: deque())

    def publish(self, type: str, project: str | None, **content: Any) -> None:
        """Number the message, remember it, hand it to every tab that wants it."""
        with self._lock:
            self._seq += 1
            message: Message = {"type": type, "seq": self._seq, "project": project, **content}
            self._recent.append(message)
            if len(self._recent) > self.keep:
                self._recent.popleft()
            for listener in tuple(self._listeners):
                if listener.wants(message):
                    self._hand(listener, message)

    def join(self, project: str | None, since: int | None, epoch: str | None, who: str = "") -> tuple[Listener, bool]:
        """A new listener with what it missed after `since` queued, and whether it must fetch everything anew."""
        listener = Listener(asyncio.Queue(), asyncio.get_running_loop(), project, who)
        with self._lock:
            missed, complete = self._missed(since, epoch)
            for message in missed:
                if listener.wants(message):
                    listener.queue.put_nowait(message)
            self._listeners.add(listener)
            self._tell_who_is_here(project)
        return listener, not complete

    def leave(self, listener: Listener) -> None:
        """Forget a tab."""
        with self._lock:
            self._listeners.discard(listener)
            self._tell_who_is_here(listener.project)

    def move(self, listener: Listener, project: str | None, page: str, number: int | None) -> None:
        """The tab looks at something else; everybody at the projects it comes from and goes to is told."""
        with self._lock:
            before = listener.project
            listener.project, listener.page, listener.object = project, page, number
            for told in {before, project}:
                self._tell_who_is_here(told)

    def watched(self, project: str) -> bool:
        """Whether any tab looks at the project."""
        with self._lock:
            return any(listener.project == project for listener in self._listeners)

    @property
    def seq(self) -> int:
        """Number of the last message."""
        return self._seq

    def _tell_who_is_here(self, project: str | None) -> None:
        """Presence is a state, not an event: it is told as it is now, and never told again to a tab that was away."""
        here = [
            listener for listener in self._listeners if listener.who and project is not None and listener.project == project
        ]
        people = [{"tab": each.tab, "who": each.who, "page": each.page, "object": each.object} for each in here]
        for listener in here:
            self._hand(listener, {"type": "presence", "seq": self._seq, "project": project, "people": people})

    def _missed(self, since: int | None, epoch: str | None) -> tuple[list[Message], bool]:
        if since is None or not epoch:  # its first visit: there is nothing it could have missed
            return [], True
        if since == self._seq and epoch == self.epoch:
            return [], True
        if epoch != self.epoch or since > self._seq:
            return [], False
        first = self._recent[0]["seq"] if self._recent else self._seq + 1
        return [m for m in self._recent if m["seq"] > since], first <= since + 1

    def _hand(self, listener: Listener, message: Message) -> None:
        try:
            listener.loop.call_soon_threadsafe(listener.take, message, self.epoch)
        except RuntimeError:  # its loop is gone
            self._listeners.discard(listener)
