"""Heavy work waits here, not in the threads that requests share: one gate for each kind of it, in threads of its own.

Of one person one piece is done at a time, so that a crowd of one's own keeps nobody else waiting for more than that piece;
and only so many are taken on, what is beyond them is refused with the time to try again.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ParamSpec, TypeVar

import anyio

from app.errors import TooMany

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass(slots=True)
class _Asker:
    """Who asks: how much of theirs is taken on, and their turn."""

    taken: int = 0
    turn: anyio.CapacityLimiter = field(default_factory=lambda: anyio.CapacityLimiter(1))


class Gate:
    """One kind of heavy work. Used on the event loop."""

    def __init__(self, what: str, *, at_once: int, each: int, retry_s: int) -> None:
        """`what` is said where it is refused; `each` is how much of one asker is taken on, done and waiting."""
        self._what, self._each, self._retry_s = what, each, retry_s
        self._threads = anyio.CapacityLimiter(at_once)
        self._askers: dict[str, _Asker] = {}

    async def run(
        self, who: str, work: Callable[Arguments, Result], *arguments: Arguments.args, **options: Arguments.kwargs
    ) -> Result:
        """What `work` returns, from a thread of this gate; raises TooMany for what is beyond the asker's share."""
        self.check(who)
        asker = self._askers.setdefault(who, _Asker())
        asker.taken += 1
        try:
            async with asker.turn:
                return await anyio.to_thread.run_sync(lambda: work(*arguments, **options), limiter=self._threads)
        finally:
            asker.taken -= 1
            if not asker.taken:
                del self._askers[who]

    def check(self, who: str) -> None:
        """Raise TooMany when nothing more of the asker is taken on now."""
        asker = self._askers.get(who)
        if asker is not None and asker.taken >= self._each:
            raise TooMany(
                f"{asker.taken} {self._what} are under way already, at most {self._each} at a time",
                hint=f"try again in {self._retry_s} s",
                retry_s=self._retry_s,
            )


@dataclass(frozen=True, slots=True)
class Gates:
    """Every kind of heavy work that a request waits for."""

    looks: Gate = field(default_factory=lambda: Gate("looks at files of yours", at_once=2, each=4, retry_s=10))
    views: Gate = field(default_factory=lambda: Gate("requests of yours to the 3D view", at_once=1, each=4, retry_s=2))
    deletions: Gate = field(default_factory=lambda: Gate("deletions of yours", at_once=1, each=8, retry_s=5))
    # a hash takes 64 MiB for a moment; an address may be that of everybody behind a proxy
    passwords: Gate = field(default_factory=lambda: Gate("sign-ins from your address", at_once=2, each=30, retry_s=3))
