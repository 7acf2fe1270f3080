"""Signing in."""

from pydantic import Field

from app.schemas.base import Shape


class Credentials(Shape):
    """A name and its password."""

    name: str = Field(min_length=1, max_length=60)
    password: str = Field(min_length=1, max_length=1000)
