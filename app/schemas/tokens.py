"""API tokens."""

from typing import Literal

from app.schemas.base import Shape
from app.schemas.text import Word

TokenScope = Literal["metrics", "read", "annotator", "reviewer", "admin"]


class ApiTokenIn(Shape):
    """A new token: its purpose and scope. `read` permits no changes, `metrics` permits only /metrics."""

    name: Word
    scope: TokenScope = "annotator"


class ApiToken(Shape):
    """A token, without its secret."""

    id: int
    name: str
    scope: TokenScope
    owner: str  # account it acts for; empty: the user who started the server
    created: float
    used: float | None  # time of last use, to the minute


class NewApiToken(ApiToken):
    """A new token with its secret, which is shown only once."""

    secret: str
