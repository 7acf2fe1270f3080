"""What a route is given."""

from typing import Annotated

from fastapi import Depends, Request

from app.services.context import Context


def get_context(request: Request) -> Context:
    """The running app's engine, queue and viewer."""
    context: Context = request.app.state.context
    return context


Ctx = Annotated[Context, Depends(get_context)]
