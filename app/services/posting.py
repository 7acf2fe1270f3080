"""Delivery of webhook messages in background threads, with retries at growing intervals for two days.

A delivery is claimed by moving its next attempt ahead in a transaction: only one of several servers sends it, and a crash
loses nothing. Receivers may get a message twice, recognisable by its number.
"""

import http.client
import logging
import threading
import time
from typing import Any
from urllib.parse import urlsplit

from sqlalchemy import Engine
from sqlmodel import Session, col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Delivery, Webhook
from app.posting import TOTAL_S, networks, post, signature
from app.settings import Settings
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

STOP_S = 2 * TOTAL_S  # maximum wait for POSTs at shutdown: connecting, and the rest
LOOK_S = 30.0  # polling interval for due retries, and deliveries stored by other servers
FIRST_PAUSE_S, LONGEST_PAUSE_S = 10.0, 6 * 3600.0  # before the second attempt, tripled each time up to the longest
TRIES = 14  # two days
KEPT_S = 30 * 24 * 3600.0
SENDERS = 4  # threads, each at another host: a receiver that answers slowly delays only its own messages


class Posting:
    """Sender of deliveries. `wake` is thread-safe and does not wait."""

    def __init__(self, engine: Engine, settings: Settings) -> None:
        self._engine, self._allowed = engine, networks(settings.webhooks_to)
        self._woken, self._stopping = [threading.Event() for _ in range(SENDERS)], threading.Event()
        self._taking, self._busy = threading.Lock(), set[str]()  # hosts that a thread is posting to
        self._threads = [
            threading.Thread(target=self._run, args=(woken,), name="posting", daemon=True) for woken in self._woken
        ]
        engine.update_execution_options(announced=self.wake)

    def start(self) -> None:
        """Start sending pending and new deliveries."""
        for thread in self._threads:
            thread.start()

    def wake(self) -> None:
        """Signal a new delivery."""
        for woken in self._woken:
            woken.set()

    def stop(self) -> None:
        """Stop after the current POSTs; pending deliveries are sent by the next server."""
        self._stopping.set()
        self.wake()
        deadline = time.monotonic() + STOP_S
        for thread in self._threads:
            if thread.is_alive():
                thread.join(max(0.0, deadline - time.monotonic()))

    def _run(self, woken: threading.Event) -> None:
        while not self._stopping.is_set():
            woken.clear()
            try:
                while not self._stopping.is_set() and (taken := self._take()) is not None:
                    number, host = taken
                    try:
                        self._send(number)
                    finally:
                        self._busy.discard(host)
            except R2C2RError as error:  # the database is unavailable, or full: try again
                _log.warning("webhooks: %s", error)
            except Exception:  # the edge of the thread: other messages are still sent after any error
                _log.exception("webhooks")
            if not self._stopping.is_set():  # else the wake-up may have been cleared
                woken.wait(LOOK_S)

    def _take(self) -> tuple[int, str] | None:
        """Claim the longest overdue delivery to a host that nothing is being sent to: its number and host."""
        with self._taking:
            with reading(self._engine) as session:
                waiting = [(number, urlsplit(url).hostname or "") for number, url in session.exec(_due(time.time()))]
            for number, host in waiting:
                if host not in self._busy and self._claim(number):
                    self._busy.add(host)
                    return number, host
        return None

    def _claim(self, number: int) -> bool:
        """Claim a delivery exclusively for a while; False where another server has sent it meanwhile."""
        with writing(self._engine) as session:
            now = time.time()
            row = session.get(Delivery, number)
            if row is None or row.due is None or row.due > now:
                return False
            session.exec(delete(Delivery).where(col(Delivery.created) < now - KEPT_S, col(Delivery.due).is_(None)))
            row.attempts += 1
            row.due = now + pause_s(row.attempts)
            session.add(row)
            return True

    def _send(self, number: int) -> None:
        with reading(self._engine) as session:
            row = session.get(Delivery, number)
            hook = session.get(Webhook, row.webhook_id) if row is not None else None
        if row is None or hook is None:
            return
        arrived, answer = self._post(row, hook)
        with writing(self._engine) as session:
            _note(session, number, arrived, answer)

    def _post(self, row: Delivery, hook: Webhook) -> tuple[bool, str]:
        """Whether it was delivered, and the answer."""
        content, timestamp = row.body.encode(), str(int(time.time()))
        headers = {
            "User-Agent": "r2c2r",
            "X-R2C2R-Event": row.event,
            "X-R2C2R-Delivery": str(row.id),
            "X-R2C2R-Timestamp": timestamp,
            "X-R2C2R-Signature": f"sha256={signature(hook.secret, timestamp, content)}",
        }
        try:
            status = post(hook.url, content, headers, self._allowed)
        except (OSError, ValueError, http.client.HTTPException, R2C2RError) as error:
            return False, " ".join(str(error).split())[:200] or type(error).__name__
        return 200 <= status < 300, str(status)


def pause_s(attempts: int) -> float:
    """Delay in seconds before the next attempt."""
    return float(min(FIRST_PAUSE_S * 3 ** (attempts - 1), LONGEST_PAUSE_S))


def _due(now: float) -> Any:
    """Numbers and addresses of the overdue deliveries, the longest overdue first."""
    waiting = select(Delivery.id, Webhook.url).join(Webhook, col(Webhook.id) == col(Delivery.webhook_id))
    return waiting.where(col(Delivery.due) <= now).order_by(col(Delivery.due), col(Delivery.id))


def _note(session: Session, number: int, arrived: bool, answer: str) -> None:
    row = session.get(Delivery, number)
    if row is None:  # its webhook was removed meanwhile
        return
    row.answer = answer
    if arrived:
        row.delivered, row.due = time.time(), None
    elif row.attempts >= TRIES or row.event == "test":  # a test is not retried, as its sender sees the answer
        row.due = None
    session.add(row)
