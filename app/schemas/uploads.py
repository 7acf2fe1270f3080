"""Uploads of recordings."""

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import FileName, Title


class UploadIn(Shape):
    """Announcement of a file by its sender."""

    file_name: FileName
    size: int = Field(ge=1, lt=2**53, strict=True)
    name: Title | None = None
    modified: float | None = Field(default=None, allow_inf_nan=False)


class Upload(Shape):
    """An unfinished upload of a recording; the next bytes start at `offset`."""

    id: str
    file_name: str
    size: int
    modified: float | None
    offset: int
    created: float
