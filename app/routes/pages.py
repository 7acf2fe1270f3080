"""The pages of the front end, and the exchange of the printed key for a session."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from app.deps import OpenCtx
from app.errors import Unauthorised
from app.routes.people import address_of, give_cookie
from app.services import pages

router = APIRouter(include_in_schema=False)

REVALIDATED = {"cache-control": "no-cache"}


@router.get("/")
@router.get("/inbox")
@router.get("/people")
@router.get("/templates")
@router.get("/webhooks")
@router.get("/p/{rest:path}")
def page(context: OpenCtx, request: Request, rest: str = "", token: str | None = None, frame: str = "") -> Response:
    """The single page; its address selects the content. A key in the address becomes a cookie and is removed from the address.

    The browser that used a key may open it again; other browsers see the sign-in page with instructions.
    """
    if token is not None:
        answer: Response = RedirectResponse(request.url.remove_query_params("token").path, status_code=303)
        try:
            give_cookie(request, answer, context.people.enter_with_key(token, address_of(request)))
        except Unauthorised:
            if request.state.person is None:
                return HTMLResponse(pages.sign_in(context), status_code=401, headers=REVALIDATED)
        return answer
    return HTMLResponse(pages.html(context, request.url.path, frame, request.state.person), headers=REVALIDATED)


@router.get("/login")
def login_page(context: OpenCtx) -> Response:
    """Where people sign in."""
    return HTMLResponse(pages.sign_in(context), headers=REVALIDATED)
