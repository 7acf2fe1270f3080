"""Middleware for the header Idempotency-Key: a change whose answer was lost may be repeated, and is applied once."""

import asyncio
import re
from collections.abc import Callable
from weakref import WeakValueDictionary

import anyio
from fastapi.responses import JSONResponse, Response
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import error_body, kind_of
from app.security import SAFE_METHODS
from app.services import sending
from app.services.context import Context
from app.services.sending import Answer, Sending
from r2c2r_core.errors import R2C2RError

# deleting a project and uploading a recording are sequences of idempotent steps
COVERED = re.compile(r"/api/(projects/(sample|import|[^/]+/.+)|jobs/[^/]+/(cancel|retry))")


class Once:
    """The middleware, after the guard. Every change is one transaction: see app.db.once."""

    def __init__(self, app: ASGIApp, context_of: Callable[[], Context]) -> None:
        self.app, self.context_of = app, context_of
        self._under_way: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()  # while a request holds or awaits it

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Apply a marked change, or repeat its stored answer."""
        key = Headers(scope=scope).get("idempotency-key") if scope["type"] == "http" else None
        if key is None or scope["method"] in SAFE_METHODS or not COVERED.fullmatch(scope["path"]):
            await self.app(scope, receive, send)
            return
        try:
            person = scope["state"]["person"]
            sending.check_person(person, Headers(scope=scope).get("x-r2c2r-person"))
            change = sending.sending(person, key, scope["method"], scope["path"])
            lock = self._under_way.setdefault(change.digest, asyncio.Lock())
            async with lock:  # repeated while the first request is still being handled
                await self._answer(change, scope, receive, send)
        except R2C2RError as error:
            await JSONResponse(error_body(error), kind_of(error)[1])(scope, receive, send)

    async def _answer(self, change: Sending, scope: Scope, receive: Receive, send: Send) -> None:
        context = self.context_of()
        known = await anyio.to_thread.run_sync(sending.answer_of, context, change)
        if known is not None:
            headers = {"idempotency-replayed": "true"}
            again = Response(known.body, known.status, headers, "application/json" if known.body else None)
            await again(scope, receive, send)
            return
        said: list[Message] = []

        async def hold(message: Message) -> None:
            said.append(message)

        with sending.marked(change):
            await self.app(scope, receive, hold)
        status = said[0]["status"]
        if status < 300:
            answer = Answer(status, b"".join(message.get("body", b"") for message in said[1:]).decode())
            if answer != change.kept:
                await anyio.to_thread.run_sync(sending.keep, context, change, answer)
        for message in said:
            await send(message)
