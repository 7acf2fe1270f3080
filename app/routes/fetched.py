"""Middleware that fetches a project's files from the store before a request is handled."""

import asyncio
from collections import defaultdict
from collections.abc import Callable

import anyio
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from app.errors import error_body, kind_of
from app.routes.members import OF_A_PROJECT
from app.services.context import Context
from r2c2r_core.errors import R2C2RError

FETCHES = 16  # projects fetched at a time, in threads of their own: a slow store delays no other request


class Fetched:
    """The middleware, after the access check of the project."""

    def __init__(self, app: ASGIApp, context_of: Callable[[], Context]) -> None:
        self.app, self.context_of = app, context_of
        self._threads = anyio.CapacityLimiter(FETCHES)
        self._turns: defaultdict[str, asyncio.Lock] = defaultdict(asyncio.Lock)  # by project
        self._next: dict[str, asyncio.Task[None]] = {}  # by project: the fetch that has not begun yet

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on once the project's files are local."""
        found = OF_A_PROJECT.fullmatch(scope["path"]) if scope["type"] == "http" else None
        if found is not None and found[1].isalnum():
            try:
                await self._fetched(found[1])
            except R2C2RError as error:
                await JSONResponse(error_body(error), kind_of(error)[1])(scope, receive, send)
                return
        await self.app(scope, receive, send)

    async def _fetched(self, project_id: str) -> None:
        """Wait for a fetch that begins after this call; requests that arrive before it begins share it."""
        if project_id not in self._next:
            self._next[project_id] = asyncio.create_task(self._fetch(project_id))
            self._next[project_id].add_done_callback(lambda task: task.cancelled() or task.exception())  # all may have left
        await asyncio.shield(self._next[project_id])

    async def _fetch(self, project_id: str) -> None:
        async with self._turns[project_id]:
            del self._next[project_id]
            await anyio.to_thread.run_sync(self.context_of().store.fetch, project_id, limiter=self._threads)
