"""Middleware that fetches a project's files from the store before a request is handled."""

from collections.abc import Callable

import anyio
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from app.errors import error_body, kind_of
from app.routes.members import OF_A_PROJECT
from app.services.context import Context
from r2c2r_core.errors import R2C2RError


class Fetched:
    """The middleware, after the access check of the project."""

    def __init__(self, app: ASGIApp, context_of: Callable[[], Context]) -> None:
        self.app, self.context_of = app, context_of

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on once the project's files are local."""
        found = OF_A_PROJECT.fullmatch(scope["path"]) if scope["type"] == "http" else None
        if found is not None and found[1].isalnum():
            try:
                await anyio.to_thread.run_sync(self.context_of().store.fetch, found[1])
            except R2C2RError as error:
                await JSONResponse(error_body(error), kind_of(error)[1])(scope, receive, send)
                return
        await self.app(scope, receive, send)
