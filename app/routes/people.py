"""Sign-in, sign-out and accounts."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app import schemas
from app.deps import AdminCtx, Ctx, OpenCtx
from app.routes.numbers import OptionalId
from app.security import cookie_name
from app.services import members

router = APIRouter(prefix="/api", tags=["people"])

KEPT_S = 30 * 24 * 3600
PageSize = Annotated[int, Query(ge=1, le=200)]


@router.post("/login", operation_id="signIn", status_code=204)
async def sign_in(context: OpenCtx, request: Request, response: Response, body: schemas.Credentials) -> None:
    """A session for an account, as a cookie. Failed attempts delay the next ones; 429 when many wait."""
    give_cookie(request, response, await context.people.sign_in(body.name, body.password, address_of(request)))


@router.post("/logout", operation_id="signOut", status_code=204)
def sign_out(context: Ctx, request: Request, response: Response) -> None:
    """End this session."""
    context.people.sign_out(request.state.session, context.who, address_of(request))
    response.delete_cookie(cookie_name(request.scope), path="/")


@router.post("/account/password", operation_id="changePassword", status_code=204)
async def change_password(context: Ctx, request: Request, response: Response, body: schemas.PasswordChange) -> None:
    """Your own password; your other browsers are signed out."""
    session = await context.people.change_password(context.person, body.old, body.new, address_of(request))
    give_cookie(request, response, session)


@router.get("/accounts", operation_id="listAccounts")
def list_accounts(context: AdminCtx) -> list[schemas.AccountInfo]:
    """Everybody who may sign in."""
    return members.everyone(context)


@router.get("/audit", operation_id="listAudit")
def list_audit(context: AdminCtx, before: OptionalId = None, limit: PageSize = 50) -> schemas.AuditPage:
    """Sign-ins, refusals and changes of accounts, newest first; `before` is the last id of the page before."""
    return members.record(context, before, limit)


@router.post("/accounts", operation_id="addAccount", status_code=201)
async def add_account(context: AdminCtx, body: schemas.AccountIn) -> schemas.AccountInfo:
    """Make an account; 409 when the name is taken, 422 with the reason for a password that is easily guessed."""
    return await context.gates.passwords.run(context.who, members.add, context, body)


@router.patch("/accounts/{name}", operation_id="changeAccount")
async def change_account(context: AdminCtx, name: str, body: schemas.AccountPatch) -> schemas.AccountInfo:
    """Change role or password; 409 for the last admin's role."""
    return await context.gates.passwords.run(context.who, members.change, context, name, body)


@router.delete("/accounts/{name}", operation_id="removeAccount", status_code=204)
def remove_account(context: AdminCtx, name: str) -> None:
    """Sign the person out everywhere and delete the account; 409 for the last admin."""
    members.remove(context, name)


def give_cookie(request: Request, response: Response, session_id: str) -> None:
    """Set the session cookie, which no script can read and no other site can send."""
    secure = request.url.scheme == "https"
    name = cookie_name(request.scope)
    response.set_cookie(name, session_id, httponly=True, samesite="lax", secure=secure, max_age=KEPT_S, path="/")


def address_of(request: Request) -> str:
    """Client address of a request: the peer's, or the one reported by a trusted proxy."""
    return request.client.host if request.client else ""
