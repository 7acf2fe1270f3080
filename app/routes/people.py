"""Signing in and out, and who may."""

from fastapi import APIRouter, Request, Response

from app import schemas
from app.deps import AdminCtx, Ctx, OpenCtx
from app.security import COOKIE
from app.services import members

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


@router.post("/account/password", operation_id="changePassword", status_code=204)
def change_password(context: Ctx, request: Request, response: Response, body: schemas.PasswordChange) -> None:
    """Your own password; your other browsers are signed out."""
    client = request.client.host if request.client else ""
    give_cookie(request, response, context.people.change_password(context.person, body.old, body.new, client))


@router.get("/accounts", operation_id="listAccounts")
def list_accounts(context: AdminCtx) -> list[schemas.AccountInfo]:
    """Everybody who may sign in."""
    return members.everyone(context)


@router.post("/accounts", operation_id="addAccount", status_code=201)
def add_account(context: AdminCtx, body: schemas.AccountIn) -> schemas.AccountInfo:
    """Let somebody in; 409 when the name is taken."""
    return members.add(context, body)


@router.patch("/accounts/{name}", operation_id="changeAccount")
def change_account(context: AdminCtx, name: str, body: schemas.AccountPatch) -> schemas.AccountInfo:
    """Another role or password, from now on; 409 for the last admin's role."""
    return members.change(context, name, body)


@router.delete("/accounts/{name}", operation_id="removeAccount", status_code=204)
def remove_account(context: AdminCtx, name: str) -> None:
    """Sign the person out everywhere and delete the account; 409 for the last admin."""
    members.remove(context, name)


def give_cookie(request: Request, response: Response, session_id: str) -> None:
    """The session, where no script reads it and no other site sends it."""
    secure = request.url.scheme == "https"
    response.set_cookie(COOKIE, session_id, httponly=True, samesite="lax", secure=secure, max_age=KEPT_S, path="/")
