"""Recordings on their way in."""

from pydantic import Field

from app.schemas.base import Shape


class UploadIn(Shape):
    """The file that will come, as its sender knows it."""

    file_name: str = Field(min_length=1, max_length=300)
    size: int = Field(ge=1, lt=2**53, strict=True)
    name: str | None = Field(default=None, max_length=120)
    modified: float | None = Field(default=None, allow_inf_nan=False)


class Upload(Shape):
    """A recording on its way in; what comes next starts at `offset`."""

    id: str
    file_name: str
    size: int
    modified: float | None
    offset: int
    created: float
