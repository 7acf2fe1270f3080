"""The exchange of the printed token for a cookie."""

import hmac

from fastapi.responses import Response

from app.errors import Unauthorised
from app.security import COOKIE
from app.services.context import Context


def start(context: Context, token: str, answer: Response) -> None:
    """Put a new session's cookie on the answer; raises Unauthorised for a wrong token."""
    if not hmac.compare_digest(token.encode(), context.settings.launch_token.encode()):
        raise Unauthorised("the key in this address is not valid any more", hint="open the address that r2c2r printed last")
    answer.set_cookie(COOKIE, context.keys.new_session(), httponly=True, samesite="lax", max_age=30 * 24 * 3600, path="/")
