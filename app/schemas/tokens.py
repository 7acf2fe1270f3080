"""API tokens."""

from typing import Literal

from app.schemas.base import Shape
from app.schemas.text import Word

TokenScope = Literal["metrics", "read", "annotator", "reviewer", "admin"]


class ApiTokenIn(Shape):
    """A new token: what it is for, and how far it reaches. `read` changes nothing, `metrics` opens /metrics alone."""

    name: Word
    scope: TokenScope = "annotator"


class ApiToken(Shape):
    """A token, without its secret."""

    id: int
    name: str
    scope: TokenScope
    owner: str  # the account it acts for; empty: whoever started the server
    created: float
    used: float | None  # when it was last used, to the minute


class NewApiToken(ApiToken):
    """A token that was just made: its secret is told this once."""

    secret: str
