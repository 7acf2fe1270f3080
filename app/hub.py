"""Publish-subscribe hub for browser tabs: numbered messages in memory, so that a reconnecting tab can catch up.

A message is encoded once, in ASCII, so that its content cannot break a tab's connection. The history is bounded by bytes.
Where several servers share a database, each has a hub with its own numbers: messages published at one are carried to the
others (app.db.channel), which `hear` them.
"""

import asyncio
import json
import secrets
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

KEPT_BYTES = 16 * 1024 * 1024  # of messages, for reconnecting tabs; a mask is some kilobytes
WAITING_BYTES = 8 * 1024 * 1024  # of messages waiting for one tab
PRESENCE_S = 0.2  # minimum interval of presence updates: 300 tabs that connect at once get a few messages each

Presences = dict[str, list[dict[str, Any]]]  # by project: users of its tabs


@dataclass(frozen=True, slots=True)
class Message:
    """One message as it goes over the wire; `text` is ASCII, so that its length is its bytes."""

    seq: int
    type: str
    project: str | None
    text: str


@dataclass(eq=False, slots=True)
class Listener:
    """One tab. `project` is the one it shows; from other projects it gets only messages about jobs."""

    loop: asyncio.AbstractEventLoop
    project: str | None = None
    who: str = ""  # the user; an anonymous listener is not shown to others
    page: str = ""
    object: int | None = None  # the one it works on
    sees: Callable[[str | None], bool] = lambda _: True  # whether its user may see a project
    tab: str = field(default_factory=lambda: secrets.token_hex(4))
    queue: "asyncio.Queue[str]" = field(default_factory=asyncio.Queue)
    _waiting: int = 0  # bytes

    def take(self, message: Message, epoch: str) -> None:
        """Queue the message; a tab that falls behind must reload everything instead."""
        text = message.text
        if self._waiting + len(text) > WAITING_BYTES:
            while not self.queue.empty():
                self.queue.get_nowait()
            self._waiting = 0
            text = json.dumps({"type": "hello", "epoch": epoch, "seq": message.seq, "reset": True, "tab": self.tab})
        self._waiting += len(text)
        self.queue.put_nowait(text)

    async def next(self) -> str:
        """The oldest waiting message."""
        text = await self.queue.get()
        self._waiting -= len(text)
        return text

    def wants(self, message: Message) -> bool:
        """Whether the message concerns this tab's content."""
        shown = message.type in ("job", "projects") or message.project == self.project
        return shown and self.sees(message.project)


@dataclass(slots=True)
class Hub:
    """Message hub; publishing is thread-safe, while tabs join, move and leave on their event loop.

    `carry` is called with messages for other servers: kind and content.
    """

    carry: Callable[[str, dict[str, Any]], None] = lambda kind, said: None
    epoch: str = field(default_factory=lambda: secrets.token_hex(8))
    _seq: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _listeners: set[Listener] = field(default_factory=set)
    _recent: "deque[Message]" = field(default_factory=lambda: deque())
    _recent_bytes: int = 0
    _told: dict[tuple[str, int], int] = field(default_factory=dict)  # newest published versions, by type and number
    _presence_due: set[str] = field(default_factory=set)  # projects with a scheduled presence update
    _elsewhere: dict[str, Presences] = field(default_factory=dict)  # by server

    def publish(self, type: str, project: str | None, **content: Any) -> None:
        """Number and store the message, and send it to all interested tabs, here and at other servers."""
        self.hear(type, project, content)
        self.carry("message", {"type": type, "project": project, "content": content})

    def publish_state(self, type: str, project: str, number: int, version: int, **content: Any) -> None:
        """Publish a row's current state, unless a newer version was already published, as publications may be reordered."""
        self.hear(type, project, content, (number, version))
        self.carry("message", {"type": type, "project": project, "content": content, "state": (number, version)})

    def hear(self, type: str, project: str | None, content: dict[str, Any], state: Sequence[int] | None = None) -> None:
        """Send a message to the tabs here; `state` is the number and the version of its row."""
        with self._lock:
            if state is not None:
                number, version = state
                if version < self._told.get((type, number), version):
                    return
                self._told[type, number] = version
            self._publish(type, project, content)

    def start_anew(self) -> None:
        """Tell all tabs to reload everything, as messages were lost."""
        with self._lock:
            self.epoch = secrets.token_hex(8)
            self._recent.clear()
            self._recent_bytes = 0
            for listener in tuple(self._listeners):
                hello = {"epoch": self.epoch, "reset": True, "tab": listener.tab}
                self._hand(listener, self._message("hello", listener.project, hello))

    def tell(self, listener: Listener, type: str, **content: Any) -> None:
        """Send a message to one tab only, without storing it."""
        with self._lock:
            self._hand(listener, self._message(type, listener.project, content))

    def join(
        self,
        project: str | None,
        since: int | None,
        epoch: str | None,
        who: str = "",
        sees: Callable[[str | None], bool] = lambda _: True,
    ) -> Listener:
        """A new listener: a hello first (`reset`: it must reload everything), then the messages after `since`.

        On its first connection it is told that its project changed, as it may have loaded it before subscribing.
        """
        listener = Listener(asyncio.get_running_loop(), project, who, sees=sees)
        with self._lock:
            missed, complete = self._missed(since, epoch)
            hello = {"epoch": self.epoch, "reset": not complete, "tab": listener.tab}
            for message in (self._message("hello", project, hello), *missed):
                if message.type == "hello" or listener.wants(message):
                    listener.take(message, self.epoch)
            self._listeners.add(listener)
            if since is None or not epoch:
                self._tell_to_read(listener)
        self._people_changed(project)
        return listener

    def leave(self, listener: Listener) -> None:
        """Remove a tab."""
        with self._lock:
            self._listeners.discard(listener)
        self._people_changed(listener.project)

    def move(self, listener: Listener, project: str | None, page: str, number: int | None) -> None:
        """Record that the tab shows something else, and update presence at its old and new project.

        On a project switch it is told that the new one changed, as it may have loaded it before subscribing.
        """
        with self._lock:
            before = listener.project
            listener.project, listener.page, listener.object = project, page, number
            if project != before:
                self._tell_to_read(listener)
        for told in {before, project}:
            self._people_changed(told)

    def show_out(self, project: str, why: str = "is kept to its members now") -> None:
        """Notify tabs at the project whose users may not see it any more."""
        with self._lock:
            gone = self._message("gone", project, {"why": why})
            for listener in tuple(self._listeners):
                if listener.project == project and not listener.sees(project):
                    self._hand(listener, gone)

    def watched(self, project: str) -> bool:
        """Whether any tab shows the project."""
        with self._lock:
            here = any(listener.project == project for listener in self._listeners)
            return here or any(projects.get(project) for projects in self._elsewhere.values())

    @property
    def presences(self) -> Presences:
        """Users by project, of this server's tabs."""
        with self._lock:
            return self._presences()

    def hear_presence(self, server: str, project: str, people: list[dict[str, Any]]) -> None:
        """Record another server's tabs at one project."""
        self.hear_presences(server, {**self._elsewhere.get(server, {}), project: people})

    def hear_presences(self, server: str, presences: Presences) -> None:
        """Record all presences of another server's tabs; empty if the server is gone."""
        with self._lock:
            before = self._elsewhere.pop(server, {})
            if presences:
                self._elsewhere[server] = presences
            for project in before.keys() | presences.keys():
                if before.get(project) != presences.get(project):
                    self._tell_who_is_at(project)

    def tabs_of(self, who: str) -> int:
        """Number of connected tabs of a user."""
        with self._lock:
            return sum(listener.who == who for listener in self._listeners)

    @property
    def tabs(self) -> int:
        """Number of connected tabs."""
        with self._lock:
            return len(self._listeners)

    @property
    def seq(self) -> int:
        """Number of the last message."""
        return self._seq

    def _publish(self, type: str, project: str | None, content: dict[str, Any]) -> None:
        self._seq += 1
        message = self._message(type, project, content)
        self._remember(message)
        for listener in tuple(self._listeners):
            if listener.wants(message):
                self._hand(listener, message)

    def _message(self, type: str, project: str | None, content: dict[str, Any]) -> Message:
        said = {"type": type, "seq": self._seq, "project": project, **content}
        return Message(self._seq, type, project, json.dumps(said, separators=(",", ":")))

    def _remember(self, message: Message) -> None:
        self._recent.append(message)
        self._recent_bytes += len(message.text)
        while self._recent_bytes > KEPT_BYTES:
            self._recent_bytes -= len(self._recent.popleft().text)

    def _tell_to_read(self, listener: Listener) -> None:
        message = self._message("project", listener.project, {})
        if listener.project is not None and listener.wants(message):
            self._hand(listener, message)

    def _people_changed(self, project: str | None) -> None:
        """Schedule a presence update at the project, coalescing simultaneous changes."""
        if project is not None and project not in self._presence_due:
            self._presence_due.add(project)
            asyncio.get_running_loop().call_later(PRESENCE_S, self._tell_presence, project)

    def _tell_presence(self, project: str) -> None:
        self._presence_due.discard(project)
        with self._lock:
            self._tell_who_is_at(project)
            people = self._presences().get(project, [])
        self.carry("presence", {"project": project, "people": people})

    def _tell_who_is_at(self, project: str) -> None:
        """Send the current presence, which is a state, not an event, and is not replayed to reconnecting tabs."""
        everywhere = (self._presences(), *self._elsewhere.values())
        people = [person for presences in everywhere for person in presences.get(project, [])]
        message = self._message("presence", project, {"people": people})
        for listener in tuple(self._listeners):
            if listener.who and listener.project == project and listener.sees(project):
                self._hand(listener, message)

    def _presences(self) -> Presences:
        found: Presences = {}
        for each in self._listeners:
            if each.who and each.project is not None and each.sees(each.project):
                person = {"tab": each.tab, "who": each.who, "page": each.page, "object": each.object}
                found.setdefault(each.project, []).append(person)
        return found

    def _missed(self, since: int | None, epoch: str | None) -> tuple[list[Message], bool]:
        if since is None or not epoch:  # its first connection: it cannot have missed anything
            return [], True
        if since == self._seq and epoch == self.epoch:
            return [], True
        if epoch != self.epoch or since > self._seq:
            return [], False
        first = self._recent[0].seq if self._recent else self._seq + 1
        return [m for m in self._recent if m.seq > since], first <= since + 1

    def _hand(self, listener: Listener, message: Message) -> None:
        try:
            listener.loop.call_soon_threadsafe(listener.take, message, self.epoch)
        except RuntimeError:  # its loop is closed
            self._listeners.discard(listener)
