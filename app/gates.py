"""Concurrency limits for heavy requests: one gate per kind of work, with its own threads.

Each user has one task running at a time, so that many requests of one user delay others by at most that task; the number of
queued tasks per user is limited, and further ones are refused with a retry time.
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
    """State of one requester: accepted tasks, and a lock for the running one."""

    taken: int = 0
    turn: anyio.CapacityLimiter = field(default_factory=lambda: anyio.CapacityLimiter(1))


class Gate:
    """One kind of heavy work. Used on the event loop."""

    def __init__(self, what: str, *, at_once: int, each: int, retry_s: int) -> None:
        """`what` appears in refusals; `each` is the limit of one requester's running and waiting tasks."""
        self._what, self._each, self._retry_s = what, each, retry_s
        self._threads = anyio.CapacityLimiter(at_once)
        self._askers: dict[str, _Asker] = {}

    async def run(
        self, who: str, work: Callable[Arguments, Result], *arguments: Arguments.args, **options: Arguments.kwargs
    ) -> Result:
        """Run `work` in a thread of this gate and return its result; raises TooMany beyond the requester's limit."""
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
        """Raise TooMany when the requester has reached the limit."""
        asker = self._askers.get(who)
        if asker is not None and asker.taken >= self._each:
            raise TooMany(
                f"{asker.taken} {self._what} are already running, at most {self._each} at a time",
                hint=f"try again in {self._retry_s} s",
                retry_s=self._retry_s,
            )


@dataclass(frozen=True, slots=True)
class Gates:
    """Gates of all kinds of heavy requests."""

    looks: Gate = field(default_factory=lambda: Gate("looks at files of yours", at_once=2, each=4, retry_s=10))
    views: Gate = field(default_factory=lambda: Gate("requests of yours to the 3D view", at_once=1, each=4, retry_s=2))
    deletions: Gate = field(default_factory=lambda: Gate("deletions of yours", at_once=1, each=8, retry_s=5))
    # a hash briefly takes 64 MiB; one address may be shared by all users behind a proxy
    passwords: Gate = field(default_factory=lambda: Gate("sign-ins from your address", at_once=2, each=30, retry_s=3))
