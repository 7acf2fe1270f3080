"""Signing in and out."""

from fastapi import APIRouter, Request, Response

from app import schemas
from app.deps import Ctx, OpenCtx
from app.security import COOKIE

router = APIRouter(prefix="/api", tags=["people"])

KEPT_S = 30 * 24 * 3600


@router.post("/login", operation_id="signIn", status_code=204)
def sign_in(context: OpenCtx, request: Request, response: Response, body: schemas.Credentials) -> None:
    """A session for an account, as a cookie; 429 after too many wrong passwords."""
    client = request.client.host if request.client else ""
    give_cookie(request, response, context.people.sign_in(body.name, body.password, client))


@router.post("/logout", operation_id="signOut", status_code=204)
def sign_out(context: Ctx, request: Request, response: Response) -> None:
    """End this session."""
    context.people.sign_out(request.state.session)
    response.delete_cookie(COOKIE, path="/")


def give_cookie(request: Request, response: Response, session_id: str) -> None:
    """The session, where no script reads it and no other site sends it."""
    secure = request.url.scheme == "https"
    response.set_cookie(COOKIE, session_id, httponly=True, samesite="lax", secure=secure, max_age=KEPT_S, path="/")
