"""Rate limit of password attempts: the first ones are immediate, later ones delayed, and no account is locked."""

import math
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from app.errors import TooMany


class Pace(NamedTuple):
    """A leaky bucket (generic cell rate algorithm): a burst of free attempts, then one per interval."""

    free: int
    every_s: float


PACES = {
    "pair": Pace(5, 4.0),  # one account from one address
    "client": Pace(30, 0.5),  # one address, possibly shared by all users behind a proxy
    "name": Pace(20, 2.0),  # one account, from anywhere
}
MOST_WAIT_S = 15.0  # maximum delay of an attempt, after which the correct password is accepted regardless of earlier ones
Key = tuple[str, str, str]


class Attempts:
    """Recent attempts, in memory. An attempt is counted before it is checked, so that concurrent ones gain nothing."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._due: dict[Key, float] = {}  # when the bucket is empty again
        self._lock = threading.Lock()

    def take(self, name: str, client: str) -> float:
        """Count an attempt and return its delay in seconds, at most MOST_WAIT_S.

        Raises TooMany, without counting it, if more attempts on this account from this address are already waiting.
        """
        now = self._clock()
        with self._lock:
            self._due = {key: due for key, due in self._due.items() if due > now}
            keys = _keys(name, client)
            waits = [self._wait(key, now) for key in keys]
            if waits[0] > MOST_WAIT_S:
                retry_s = math.ceil(waits[0] - MOST_WAIT_S)
                raise TooMany("too many wrong passwords", hint=f"try again in {retry_s} s", retry_s=retry_s)
            for key in keys:
                pace = PACES[key[0]]
                fullest = now + pace.free * pace.every_s + MOST_WAIT_S
                self._due[key] = min(max(self._due.get(key, now), now) + pace.every_s, fullest)
            return min(max(waits), MOST_WAIT_S)

    def succeeded(self, name: str, client: str) -> None:
        """Reset after a correct password, so that its user may mistype it again."""
        with self._lock:
            pair, *others = _keys(name, client)
            self._due.pop(pair, None)
            for key in others:
                if key in self._due:
                    self._due[key] -= PACES[key[0]].every_s

    def _wait(self, key: Key, now: float) -> float:
        """Seconds until another attempt fits the key's rate."""
        pace = PACES[key[0]]
        return max(self._due.get(key, now) - now - (pace.free - 1) * pace.every_s, 0.0)


def _keys(name: str, client: str) -> tuple[Key, Key, Key]:
    name = name.casefold()
    return ("pair", name, client), ("client", "", client), ("name", name, "")
