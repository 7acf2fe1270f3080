"""FastAPI dependencies: the running app, with the role that a route needs in the type."""

from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Annotated

from fastapi import Depends, Request

from app.security import Role
from app.services import sending
from app.services.context import Context


def context_for(role: Role) -> Callable[[Request], Awaitable[Context]]:
    """Dependency on the running app for users with at least that role; Forbidden for others."""

    async def get_context(request: Request) -> Context:
        context: Context = replace(request.app.state.context, person=request.state.person)
        context.require(role)
        sending.promise(request.scope["route"].status_code or 200)
        return context

    return get_context


async def running_app(request: Request) -> Context:
    """The running app, without sign-in."""
    context: Context = request.app.state.context
    return context


OpenCtx = Annotated[Context, Depends(running_app)]
Ctx = Annotated[Context, Depends(context_for("annotator"))]
ReviewerCtx = Annotated[Context, Depends(context_for("reviewer"))]
AdminCtx = Annotated[Context, Depends(context_for("admin"))]
