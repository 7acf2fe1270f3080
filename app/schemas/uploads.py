"""Uploads of recordings."""

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import FileName, Title


class UploadIn(Shape):
    """The file that will come, as its sender knows it."""

    file_name: FileName
    size: int = Field(ge=1, lt=2**53, strict=True)
    name: Title | None = None
    modified: float | None = Field(default=None, allow_inf_nan=False)


class Upload(Shape):
    """A recording on its way in; what comes next starts at `offset`."""

    id: str
    file_name: str
    size: int
    modified: float | None
    offset: int
    created: float
