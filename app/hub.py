"""What happened, told to every open tab: numbered messages in memory, so that a tab that was away can catch up.

A message is encoded once, in ASCII: whatever is in it, no tab's connection can fail of it. What is kept is bounded by bytes.
Where several servers share a database each has a hub with numbers of its own: what is published at one is carried to the
others (app.db.channel), and they `hear` it.
"""

import asyncio
import json
import secrets
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

KEPT_BYTES = 16 * 1024 * 1024  # of messages, for tabs that were away; a mask is some kilobytes
WAITING_BYTES = 8 * 1024 * 1024  # of messages waiting for one tab
PRESENCE_S = 0.2  # who is here is told at most this often: 300 tabs that come at once are a few messages each

Presences = dict[str, list[dict[str, Any]]]  # by project: its tabs' people


@dataclass(frozen=True, slots=True)
class Message:
    """One message as it goes over the wire; `text` is ASCII, so that its length is its bytes."""

    seq: int
    type: str
    project: str | None
    text: str


@dataclass(eq=False, slots=True)
class Listener:
    """One tab. `project` is the one it looks at; messages of other projects reach it only when they are about jobs."""

    loop: asyncio.AbstractEventLoop
    project: str | None = None
    who: str = ""  # the person; nobody's listener is not shown to others
    page: str = ""
    object: int | None = None  # the one it works on
    sees: Callable[[str | None], bool] = lambda _: True  # whether its person may see a project
    tab: str = field(default_factory=lambda: secrets.token_hex(4))
    queue: "asyncio.Queue[str]" = field(default_factory=asyncio.Queue)
    _waiting: int = 0  # bytes

    def take(self, message: Message, epoch: str) -> None:
        """Queue the message; a tab that does not keep up is told to fetch everything anew instead."""
        text = message.text
        if self._waiting + len(text) > WAITING_BYTES:
            while not self.queue.empty():
                self.queue.get_nowait()
            self._waiting = 0
            text = json.dumps({"type": "hello", "epoch": epoch, "seq": message.seq, "reset": True, "tab": self.tab})
        self._waiting += len(text)
        self.queue.put_nowait(text)

    async def next(self) -> str:
        """The message that waits longest."""
        text = await self.queue.get()
        self._waiting -= len(text)
        return text

    def wants(self, message: Message) -> bool:
        """Whether this tab shows what the message is about."""
        shown = message.type in ("job", "projects") or message.project == self.project
        return shown and self.sees(message.project)


@dataclass(slots=True)
class Hub:
    """Safe to publish to from any thread; tabs join, move and leave on their event loop.

    `carry` takes what other servers are to hear: of which kind, and what.
    """

    carry: Callable[[str, dict[str, Any]], None] = lambda kind, said: None
    epoch: str = field(default_factory=lambda: secrets.token_hex(8))
    _seq: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _listeners: set[Listener] = field(default_factory=set)
    _recent: "deque[Message]" = field(default_factory=lambda: deque())
    _recent_bytes: int = 0
    _told: dict[tuple[str, int], int] = field(default_factory=dict)  # versions, by what they are of
    _presence_due: set[str] = field(default_factory=set)  # projects whose people will be told who is here
    _elsewhere: dict[str, Presences] = field(default_factory=dict)  # by server

    def publish(self, type: str, project: str | None, **content: Any) -> None:
        """Number the message, remember it, hand it to every tab that wants it, here and at other servers."""
        self.hear(type, project, content)
        self.carry("message", {"type": type, "project": project, "content": content})

    def publish_state(self, type: str, project: str, number: int, version: int, **content: Any) -> None:
        """The same of how a row is by now; nothing once a newer version of it was told: who stored first may come second."""
        self.hear(type, project, content, (number, version))
        self.carry("message", {"type": type, "project": project, "content": content, "state": (number, version)})

    def hear(self, type: str, project: str | None, content: dict[str, Any], state: Sequence[int] | None = None) -> None:
        """Tell the tabs here; `state` is the number and the version of the row it is about."""
        with self._lock:
            if state is not None:
                number, version = state
                if version < self._told.get((type, number), version):
                    return
                self._told[type, number] = version
            self._publish(type, project, content)

    def start_anew(self) -> None:
        """Messages were lost: every tab is told to fetch everything anew."""
        with self._lock:
            self.epoch = secrets.token_hex(8)
            self._recent.clear()
            self._recent_bytes = 0
            for listener in tuple(self._listeners):
                hello = {"epoch": self.epoch, "reset": True, "tab": listener.tab}
                self._hand(listener, self._message("hello", listener.project, hello))

    def tell(self, listener: Listener, type: str, **content: Any) -> None:
        """Say something to one tab alone; it is not remembered."""
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
        """A new listener: hello first (`reset`: it must fetch everything anew), then what it missed after `since`.

        One that joins for the first time is told that its project changed: it may have read it before it was heard here.
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
        """Forget a tab."""
        with self._lock:
            self._listeners.discard(listener)
        self._people_changed(listener.project)

    def move(self, listener: Listener, project: str | None, page: str, number: int | None) -> None:
        """The tab looks at something else; everybody at the projects it comes from and goes to is told.

        At another project it is told that this one changed: it may have read it before it was heard here.
        """
        with self._lock:
            before = listener.project
            listener.project, listener.page, listener.object = project, page, number
            if project != before:
                self._tell_to_read(listener)
        for told in {before, project}:
            self._people_changed(told)

    def show_out(self, project: str, why: str = "is kept to its members now") -> None:
        """Tell the tabs at the project whose person does not see it any more: what they show is not theirs to see."""
        with self._lock:
            gone = self._message("gone", project, {"why": why})
            for listener in tuple(self._listeners):
                if listener.project == project and not listener.sees(project):
                    self._hand(listener, gone)

    def watched(self, project: str) -> bool:
        """Whether any tab looks at the project."""
        with self._lock:
            here = any(listener.project == project for listener in self._listeners)
            return here or any(projects.get(project) for projects in self._elsewhere.values())

    @property
    def presences(self) -> Presences:
        """Who is at which project, of the tabs of this server."""
        with self._lock:
            return self._presences()

    def hear_presence(self, server: str, project: str, people: list[dict[str, Any]]) -> None:
        """Another server's tabs at one project."""
        self.hear_presences(server, {**self._elsewhere.get(server, {}), project: people})

    def hear_presences(self, server: str, presences: Presences) -> None:
        """All that another server's tabs are at; nothing, where it is gone."""
        with self._lock:
            before = self._elsewhere.pop(server, {})
            if presences:
                self._elsewhere[server] = presences
            for project in before.keys() | presences.keys():
                if before.get(project) != presences.get(project):
                    self._tell_who_is_at(project)

    def tabs_of(self, who: str) -> int:
        """How many tabs of a person are connected."""
        with self._lock:
            return sum(listener.who == who for listener in self._listeners)

    @property
    def tabs(self) -> int:
        """How many tabs are connected."""
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
        """Tell everybody at the project who is there, once for all changes of a moment."""
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
        """Presence is a state, not an event: it is told as it is now, and never told again to a tab that was away."""
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
        if since is None or not epoch:  # its first visit: there is nothing it could have missed
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
        except RuntimeError:  # its loop is gone
            self._listeners.discard(listener)
