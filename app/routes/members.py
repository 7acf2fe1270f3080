"""Members of a project, and the access check of all requests about a project."""

import re
from collections.abc import Callable
from typing import Annotated

import anyio
from fastapi import APIRouter
from fastapi.responses import JSONResponse
from pydantic import Field, TypeAdapter, ValidationError
from starlette.types import ASGIApp, Receive, Scope, Send

from app import schemas
from app.deps import Ctx
from app.errors import body
from app.services import project_members
from app.services.context import Context

router = APIRouter(prefix="/api/projects/{project}/members", tags=["projects"])

_ROW_ID = TypeAdapter(Annotated[int, Field(ge=0, lt=2**63)])
OF_A_PROJECT = re.compile(r"/(?:api/projects|media)/([^/]+)(?:/.*)?", re.DOTALL)
_OF_A_JOB = re.compile(r"/api/jobs/([^/]+)(?:/.*)?", re.DOTALL)
_OF_A_VIEW = re.compile(r"/viewer/([^/]+)(?:/.*)?", re.DOTALL)


@router.get("", operation_id="getMembers")
def get_members(context: Ctx, project: str) -> schemas.ProjectMembers:
    """Visibility of the project."""
    return project_members.members(context, project)


@router.put("", operation_id="setMembers")
def set_members(context: Ctx, project: str, body: schemas.MembersIn) -> schemas.ProjectMembers:
    """Make the project visible to all users, or only to its owner and these; 403 unless you are its owner or an admin."""
    return project_members.set_members(context, project, body)


class MembersOnly:
    """The middleware, after the guard: invisible projects are reported as not found."""

    def __init__(self, app: ASGIApp, context_of: Callable[[], Context]) -> None:
        self.app, self.context_of = app, context_of

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on requests about visible projects."""
        if scope["type"] not in ("http", "websocket") or await self._sees(scope):
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            await JSONResponse(body("not-found", "there is nothing here", "it may have been deleted"), 404)(
                scope, receive, send
            )
        else:
            await receive()
            await send({"type": "websocket.close", "code": 4404, "reason": "there is nothing here"})

    async def _sees(self, scope: Scope) -> bool:
        person, path = scope["state"]["person"], scope["path"]
        if person is None:  # signing in, or using the printed key: the guard refuses all other anonymous requests
            return True
        context = self.context_of()
        if found := OF_A_PROJECT.fullmatch(path):
            return context.access.sees(person, found[1])
        if found := _OF_A_VIEW.fullmatch(path):
            return context.access.sees(person, context.viewer.project_of(found[1]))
        if found := _OF_A_JOB.fullmatch(path):
            return await anyio.to_thread.run_sync(context.access.sees_job, person, _number(found[1]))
        return True


def _number(text: str) -> int:
    """The number as parsed by the route; -1, which is no job, where the route will refuse it."""
    try:
        return _ROW_ID.validate_python(text)
    except ValidationError:
        return -1
