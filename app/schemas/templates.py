"""Templates: names and categories of objects to be clicked."""

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import Title, Word
from r2c2r_core.schema.prompts import MOST_OBJECTS


class ListedObject(Shape):
    """An object to be clicked."""

    name: Word
    category: Word


class TemplateIn(Shape):
    """Content of a template; names are unique, as in a project."""

    name: Title
    objects: list[ListedObject] = Field(min_length=1, max_length=MOST_OBJECTS)


class Template(Shape):
    """A stored template."""

    id: int
    name: str
    objects: list[ListedObject]
    who: str  # author of the last change
    changed: float
    may_change: bool  # whether you may change it


class ChecklistIn(Shape):
    """The template whose objects form a project's checklist; None: no checklist."""

    template: int | None = Field(ge=0, lt=2**63)
