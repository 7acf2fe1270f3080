"""The pages of the front end, and the exchange of the printed token for a session."""

from fastapi import APIRouter, Request
from fastapi.responses import FileResponse, RedirectResponse, Response

from app.deps import Ctx
from app.services import sessions

router = APIRouter(include_in_schema=False)


@router.get("/")
@router.get("/p/{rest:path}")
def page(context: Ctx, request: Request, rest: str = "", token: str | None = None) -> Response:
    """The one page; the address says what it shows. A token in the address becomes a cookie and leaves the address."""
    if token is not None:
        answer: Response = RedirectResponse(request.url.remove_query_params("token").path, status_code=303)
        sessions.start(context, token, answer)
        return answer
    return FileResponse(context.static / "index.html", headers={"cache-control": "no-cache"})
