"""Webhooks."""

from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, BeforeValidator, StringConstraints

from app.schemas.base import Shape
from app.schemas.live import ProjectId
from app.schemas.text import readable

WebhookEvent = Literal["run.finished", "state.changed", "test"]


def _address(text: str) -> str:
    """The text itself; ValueError for an address that cannot be posted to."""
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.username is not None or parts.port == 0:
        raise ValueError("not an address to post to: give one such as https://lab.example/r2c2r, without name and password")
    if not text.isascii() or " " in text:
        raise ValueError("an address is ASCII without spaces; write it percent-encoded")
    return text


WebAddress = Annotated[
    str, BeforeValidator(readable), StringConstraints(min_length=1, max_length=500), AfterValidator(_address)
]


class WebhookIn(Shape):
    """A new webhook, of a project of yours, or, for admins, of every project."""

    url: WebAddress
    project: ProjectId | None = None


class Webhook(Shape):
    """A webhook with its address, project and last attempt."""

    id: int
    url: str
    project: str | None
    project_name: str
    owner: str  # empty: the user who started the server
    created: float
    answer: str  # to the last attempt; empty before the first
    delivered: float | None  # time of the last successful delivery


class NewWebhook(Webhook):
    """A new webhook, with the secret that signs its messages, which is shown only once."""

    secret: str


class Delivery(Shape):
    """One message to a webhook."""

    id: int
    event: WebhookEvent
    body: str
    created: float
    attempts: int
    due: float | None  # time of the next attempt; null once delivered or given up
    delivered: float | None
    answer: str
