"""How often a password was guessed wrong, and when the next guess is heard."""

import threading
import time
from collections.abc import Callable

from app.errors import TooMany

WINDOW_S = 300.0
LIMITS = {"pair": 5, "client": 30, "name": 50}  # wrong guesses in the window: one person from one place, one place, one person


class Attempts:
    """Wrong guesses of the last minutes, in memory."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._wrong: dict[tuple[str, str, str], list[float]] = {}
        self._lock = threading.Lock()

    def check(self, name: str, client: str) -> None:
        """Raise TooMany while no guess is heard."""
        now = self._clock()
        with self._lock:
            for key in [key for key, times in self._wrong.items() if times[-1] < now - WINDOW_S]:
                del self._wrong[key]
            for key in _keys(name, client):
                recent = [at for at in self._wrong.get(key, ()) if at > now - WINDOW_S]
                if len(recent) >= LIMITS[key[0]]:
                    wait = int(recent[-LIMITS[key[0]]] + WINDOW_S - now) + 1
                    raise TooMany("too many wrong passwords", hint=f"try again in {wait} s", retry_s=wait)

    def failed(self, name: str, client: str) -> None:
        """Remember a wrong guess."""
        with self._lock:
            for key in _keys(name, client):
                self._wrong[key] = [*self._wrong.get(key, ())[-LIMITS[key[0]] :], self._clock()]

    def succeeded(self, name: str, client: str) -> None:
        """Who knows the password may mistype it again."""
        with self._lock:
            self._wrong.pop(_keys(name, client)[0], None)


def _keys(name: str, client: str) -> tuple[tuple[str, str, str], ...]:
    name = name.casefold()
    return ("pair", name, client), ("client", "", client), ("name", name, "")
