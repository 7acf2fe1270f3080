"""Sign-in and sign-out at the identity provider, by browser redirects."""

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.requests import cookie_parser

from app.deps import OpenCtx
from app.errors import NotFound, kind_of
from app.routes.people import address_of, give_cookie
from app.security import cookie_name
from app.services import oidc, pages
from app.services.context import Context
from r2c2r_core.errors import R2C2RError

router = APIRouter(include_in_schema=False)

PAGE = "/login/provider"
BEGUN_S = 600  # time limit of a sign-in at the provider
LONGEST_NEXT = 1000  # characters: browsers limit cookies to some four thousand


@router.get(PAGE)
async def begin(context: OpenCtx, request: Request, next: str = "/") -> Response:
    """Redirect to the provider; a cookie keeps the values that its answer is checked against."""
    try:
        page, begun = await _provider(context).begin(f"{_origin(request)}{PAGE}/back", _ours(next))
    except R2C2RError as error:
        return _refused(context, error)
    answer = RedirectResponse(page, status_code=303)
    secure, name = request.url.scheme == "https", _name(request)
    answer.set_cookie(name, begun.cookie(), path=PAGE, max_age=BEGUN_S, httponly=True, samesite="lax", secure=secure)
    return answer


@router.get(f"{PAGE}/back")
async def end(context: OpenCtx, request: Request) -> Response:
    """Return from the provider: a session for the person it names, then the page requested first."""
    provider, begun = _provider(context), oidc.begun(cookie_parser(request.headers.get("cookie", "")).get(_name(request), ""))
    try:
        named = await provider.end(f"{_origin(request)}{PAGE}/back", request.query_params, begun)
        client = address_of(request)
        session = await run_in_threadpool(context.people.enter_by_provider, named, provider.issuer, client)
    except R2C2RError as error:
        await run_in_threadpool(context.people.note_refusal, address_of(request), error.message)
        answer: Response = _refused(context, error)
    else:
        answer = RedirectResponse(f"{_origin(request)}{begun.wanted if begun else '/'}", status_code=303)
        give_cookie(request, answer, session)
    answer.delete_cookie(_name(request), path=PAGE)
    return answer


@router.get(f"{PAGE}/out")
async def leave(context: OpenCtx, request: Request) -> Response:
    """End the provider's own session too: otherwise the next visit signs in again without asking."""
    back = f"{_origin(request)}/login"
    try:
        return RedirectResponse(await _provider(context).leave(back), status_code=303)
    except R2C2RError as error:
        return _refused(context, error)


def _provider(context: Context) -> oidc.Provider:
    if context.provider is None:
        raise NotFound("this server knows no identity provider", hint="sign in by name and password")
    return context.provider


def _refused(context: Context, error: R2C2RError) -> Response:
    """The sign-in page, with the reason."""
    return HTMLResponse(pages.sign_in(context, f"{error.message}: {error.hint}"), kind_of(error)[1])


def _ours(wanted: str) -> str:
    """The path if valid, else "/"; it is appended to our own origin, so that it cannot contain a host."""
    return wanted if wanted.startswith("/") and len(wanted) <= LONGEST_NEXT else "/"


def _origin(request: Request) -> str:
    """Scheme and host as seen by the browser."""
    return str(request.base_url).rstrip("/")


def _name(request: Request) -> str:
    return f"{cookie_name(request.scope)}_begun"
