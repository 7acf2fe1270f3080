"""Signing in, and who may."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape

RoleName = Literal["annotator", "reviewer", "admin"]


class Credentials(Shape):
    """A name and its password."""

    name: str = Field(min_length=1, max_length=60)
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

    name: str = Field(min_length=1, max_length=60)
    role: RoleName
    password: str = Field(min_length=1, max_length=1000)


class AccountPatch(Shape):
    """What changes; a new password ends the account's sessions."""

    role: RoleName | None = None
    password: str | None = Field(default=None, min_length=1, max_length=1000)


class PasswordChange(Shape):
    """One's own password."""

    old: str = Field(min_length=1, max_length=1000)
    new: str = Field(min_length=1, max_length=1000)
