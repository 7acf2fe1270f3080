"""Messages of a tab on its live connection."""

from typing import Annotated, Literal

from pydantic import Field

from app.schemas.base import Shape

ProjectId = Annotated[str, Field(max_length=40, pattern=r"^[A-Za-z0-9_-]+$")]


class Watch(Shape):
    """Position of a tab: determines its messages, and its presence shown to others at the project."""

    type: Literal["watch"]
    project: ProjectId | None = None
    page: Literal["", "projects", "people", "overview", "annotate", "run", "review", "download"] = ""  # static/js/router.js
    object: Annotated[int, Field(ge=0, lt=2**63)] | None = None
