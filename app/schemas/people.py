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
    used: float | None  # last use of its sessions, to the hour; None without sessions
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
    """Change of one's own password."""

    old: str = Field(min_length=1, max_length=1000)
    new: str = Field(min_length=1, max_length=1000)


class AuditEntry(Shape):
    """One entry of the audit log of sign-ins and accounts."""

    id: int
    at: float
    action: AuditAction
    account: str  # affected account; empty for an unknown name, and for the user who started the server
    who: str  # author
    client: str  # client address, as reported by a trusted proxy if there is one
    detail: str


class AuditPage(Shape):
    """A page of the audit log, newest first, and the total number of entries."""

    entries: list[AuditEntry]
    total: int
