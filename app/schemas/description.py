"""project.json: description of a project in its folder, sufficient to restore its rows.

It is a second copy: the database has precedence while it exists. Paths inside the folder are relative to it.
"""

from typing import Any, Literal

from pydantic import Field

from app.schemas.base import Shape


class DescribedPoint(Shape):
    """One click, in pixels of the stored RGB frame."""

    frame: int
    x: float
    y: float
    label: int


class DescribedObject(Shape):
    """One object: what people clicked, corrected and said about it."""

    id: int | None  # as the database knew it; None where the folder is of an r2c2r that wrote no project.json
    name: str
    category: str
    colour: int
    deleted: bool = False
    points: list[DescribedPoint]
    front: dict[str, Any] | None = None
    crop: dict[str, Any] | None = None
    assignee: str | None = None
    run_name: str = ""  # what the last run called it, where that is another name
    frames: dict[str, Any] = Field(default_factory=dict)
    override: dict[str, Any] = Field(default_factory=dict)
    verdicts: list[dict[str, Any]] = Field(default_factory=list)


class Description(Shape):
    """The whole file; `project`, `comments`, `true_lengths` and `bundles` are rows (db/tables.py)."""

    version: Literal[1] = 1
    id: str
    changed: float  # when anybody last changed what is in it
    project: dict[str, Any]
    owner: str | None = None  # accounts go by name: another database numbers them otherwise
    assignee: str | None = None
    members: list[str] | None = None  # None where it was not told
    objects: list[DescribedObject]
    comments: list[dict[str, Any]] = Field(default_factory=list)
    true_lengths: list[dict[str, Any]] | None = None  # None where an r2c2r wrote it that told of none
    bundles: list[dict[str, Any]] = Field(default_factory=list)
