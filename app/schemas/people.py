"""Sign-in and accounts."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import Word

RoleName = Literal["annotator", "reviewer", "admin"]
AuditAction = Literal[
    "signed in",
    "signed out",
    "refused",
    "added",
    "removed",
    "role",
    "password",
    "token made",
    "token revoked",
    "webhook made",
    "webhook removed",
    "honeypot",
]


class Credentials(Shape):
    """A name and its password."""

    name: Word
    password: str = Field(min_length=1, max_length=1000)


class AccountInfo(Shape):
    """An account as an admin sees it."""

    name: str
    role: RoleName
    created: float
    used: float | None  # when one of its sessions was last used, to the hour; None: nobody is signed in with it
    you: bool


class AccountIn(Shape):
    """A new account."""

    name: Word
    role: RoleName
    password: str = Field(min_length=1, max_length=1000)


class AccountPatch(Shape):
    """Changes of an account; a new password ends the account's sessions."""

    role: RoleName | None = None
    password: str | None = Field(default=None, min_length=1, max_length=1000)


class PasswordChange(Shape):
    """One's own password."""

    old: str = Field(min_length=1, max_length=1000)
    new: str = Field(min_length=1, max_length=1000)


class AuditEntry(Shape):
    """One line of the record of sign-ins and accounts."""

    id: int
    at: float
    action: AuditAction
    account: str  # whose; empty for a name that nobody has, and for whoever started the server
    who: str  # did it
    client: str  # the address it came from, as far as the server was told which proxy to believe
    detail: str


class AuditPage(Shape):
    """Some lines of the record, newest first, and how many there are."""

    entries: list[AuditEntry]
    total: int
