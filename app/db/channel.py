"""Message channel between servers that share a Postgres: a row for each message, with LISTEN/NOTIFY.

Rows are inserted under a lock, so that their numbers rise in the order of visibility: a reader that knows the last number it
read gets every later message, even after a broken connection. Rows are deleted after KEPT_S. Sending is asynchronous, so
unsent messages of a process that vanishes are lost: the others detect this and call `on_gap`.
"""

import json
import logging
import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import Engine
from sqlalchemy.exc import SQLAlchemyError

from app.hub import Hub

_log = logging.getLogger(__name__)

KEPT_S = 300.0
WAITING_BYTES = 32 * 1024 * 1024  # of unsent messages, while the database does not answer
AGAIN_S = 1.0  # interval of connection attempts, and of time checks
MISSED_BEATS = 3  # missed heartbeats after which a process, or the connection, counts as lost

_ORDERED = f"SELECT pg_advisory_xact_lock({0x72326334})"
_INSERT = "INSERT INTO messages (at, sender, body) VALUES (extract(epoch FROM clock_timestamp()), %s, %s)"
_NOTIFY = "SELECT pg_notify('r2c2r', '')"
_SWEEP = "DELETE FROM messages WHERE at < extract(epoch FROM clock_timestamp()) - %s"
_LATER = "SELECT id, at, sender, body FROM messages WHERE id > %s ORDER BY id"
_NEWEST = "SELECT id, at FROM messages ORDER BY id DESC LIMIT 1"
_IS_KNOWN = "SELECT 1 FROM messages WHERE id = %s AND at = %s"

Handler = Callable[[str, dict[str, Any]], None]


class Channel:
    """One process's end of the channel. `hears` are handlers by message kind, called with sender and content.

    `beats` send a message every `beat_s` and to each new process. `on_gone` are called when a process is gone, and whether it
    vanished, in which case its last messages may be lost. `on_gap` are called when messages are lost.
    """

    def __init__(self, engine: Engine, name: str, beat_s: float) -> None:
        self.name, self._engine, self._beat_s = name, engine, beat_s
        self.hears: dict[str, Handler] = {}
        self.beats: list[Callable[[], None]] = [lambda: self.say("beat", {})]
        self.on_gone: list[Callable[[str, bool], None]] = []
        self.on_gap: list[Callable[[], None]] = []
        self._out: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._waiting = 0  # bytes in it
        self._lock = threading.Lock()
        self._listening, self._stopping = threading.Event(), threading.Event()
        self._newest: tuple[int, float] | None = None  # number and time of the last message read
        self._heard: dict[str, float] = {}  # time of the last message of each process, including this one
        self._threads = [
            threading.Thread(target=do, name=name, daemon=True)
            for do, name in ((self._read_on, "channel-in"), (self._send_on, "channel-out"))
        ]

    def start(self) -> None:
        """Join the channel."""
        self._beat()
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Send pending messages, and leave."""
        self.say("bye", {})
        self._stopping.set()
        self._listening.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join()

    def say(self, kind: str, said: dict[str, Any]) -> None:
        """Send a message to all other processes, without waiting."""
        text = json.dumps({**said, "kind": kind}, separators=(",", ":"))
        with self._lock:
            if self._waiting + len(text) > WAITING_BYTES:
                _log.warning("the database takes no messages: what waited for it is dropped")
                self._drain()
                text = json.dumps({"kind": "gap"})
            self._waiting += len(text)
            self._out.put(text)

    def _send_on(self) -> None:
        self._listening.wait()  # the others answer to the first beat
        texts: list[str] = []
        while not (self._stopping.is_set() and self._out.empty()):
            try:
                with self._connected() as connection:
                    connection.execute("SET synchronous_commit TO off")
                    while True:
                        texts = texts or self._taken()
                        self._store(connection, texts)
                        texts = []
                        if self._stopping.is_set() and self._out.empty():
                            return
            except Exception as error:  # the edge of a thread: usually the database does not answer
                self._report("messages to other servers wait", error)
                if self._stopping.wait(AGAIN_S):
                    return

    def _store(self, connection: Any, texts: list[str]) -> None:
        with connection.transaction():
            connection.execute(_ORDERED)
            with connection.cursor() as cursor:
                cursor.executemany(_INSERT, [(self.name, text) for text in texts])
            connection.execute(_SWEEP, (KEPT_S,))
            connection.execute(_NOTIFY)

    def _taken(self) -> list[str]:
        """All pending messages, after waiting for at least one."""
        with_beat = time.monotonic() + self._beat_s
        while True:
            try:
                first = self._out.get(timeout=max(with_beat - time.monotonic(), 0.0))
            except queue.Empty:
                self._beat()
                continue
            with self._lock:
                return [first, *self._drain()]

    def _drain(self) -> list[str]:
        self._waiting = 0
        texts = []
        while not self._out.empty():
            texts.append(self._out.get_nowait())
        return texts

    def _read_on(self) -> None:
        while not self._stopping.is_set():
            try:
                with self._connected() as connection:
                    connection.execute("LISTEN r2c2r")
                    self._find_place(connection)
                    self._listening.set()
                    while not self._stopping.is_set() and self._is_heard():
                        self._take_later(connection)
                        for _ in connection.notifies(timeout=min(self._beat_s, AGAIN_S), stop_after=1):
                            pass
            except Exception as error:  # the edge of a thread: usually the database does not answer
                self._report("other servers are not heard", error)
                self._stopping.wait(AGAIN_S)

    def _find_place(self, connection: Any) -> None:
        """Find the message after which to continue reading; a deleted one, or a reused number, is a gap."""
        if self._newest is not None and connection.execute(_IS_KNOWN, self._newest).fetchone() is None:
            self._miss()
            self._newest = None
        if self._newest is None:
            self._newest = connection.execute(_NEWEST).fetchone() or (0, 0.0)
        self._heard[self.name] = time.monotonic()

    def _take_later(self, connection: Any) -> None:
        assert self._newest is not None
        for number, at, sender, body in connection.execute(_LATER, (self._newest[0],)).fetchall():
            self._newest = (number, at)
            is_new = sender not in self._heard
            self._heard[sender] = time.monotonic()
            if sender == self.name:
                continue
            try:
                self._take(sender, json.loads(body))
                if is_new:
                    self._beat()
            except Exception:  # one message must not affect the others
                _log.exception("a message of %s", sender)

    def _take(self, sender: str, said: dict[str, Any]) -> None:
        kind = said.pop("kind")
        if kind == "bye":
            self._lose(sender, vanished=False)
        elif kind == "gap":
            self._miss()
        elif kind in self.hears:
            self.hears[kind](sender, said)

    def _is_heard(self) -> bool:
        """Whether the connection is alive, by this process's own messages; equally silent processes count as gone."""
        silent = {sender for sender, at in self._heard.items() if time.monotonic() - at > MISSED_BEATS * self._beat_s}
        if self.name in silent:
            return False
        for sender in silent:
            _log.warning("%s vanished", sender)
            self._lose(sender, vanished=True)
        return True

    def _beat(self) -> None:
        for beat in self.beats:
            beat()

    def _lose(self, sender: str, *, vanished: bool) -> None:
        del self._heard[sender]
        for told in self.on_gone:
            told(sender, vanished)

    def _miss(self) -> None:
        for told in self.on_gap:
            told()

    @contextmanager
    def _connected(self) -> Iterator[Any]:
        """A separate connection outside the pool."""
        pooled = self._engine.raw_connection()
        connection: Any = pooled.dbapi_connection
        pooled.detach()
        try:
            connection.rollback()
            connection.autocommit = True
            yield connection
        finally:
            connection.close()

    def _report(self, effect: str, error: Exception) -> None:
        """Log an error of the database in one line, any other with its traceback."""
        of_database: type[Exception] = self._engine.dialect.dbapi.Error  # type: ignore[union-attr]
        expected = isinstance(error, SQLAlchemyError | of_database)
        _log.warning("%s: %s", effect, error, exc_info=None if expected else error)


def join_hubs(channel: Channel, hub: Hub) -> None:
    """Exchange published messages between this process's hub and the others'."""
    hub.carry = channel.say
    channel.hears |= {
        "message": lambda _, said: hub.hear(**said),
        "presence": lambda sender, said: hub.hear_presence(sender, said["project"], said["people"]),
        "presences": lambda sender, said: hub.hear_presences(sender, said["projects"]),
    }

    def forget(sender: str, vanished: bool) -> None:
        hub.hear_presences(sender, {})
        if vanished:
            hub.start_anew()

    channel.beats.append(lambda: channel.say("presences", {"projects": hub.presences}))
    channel.on_gone.append(forget)
    channel.on_gap.append(hub.start_anew)
