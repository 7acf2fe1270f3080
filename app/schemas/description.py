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
    """One object with its clicks, corrections and verdicts."""

    id: int | None  # in the database; None for a folder of a version without project.json
    name: str
    category: str
    colour: int
    deleted: bool = False
    points: list[DescribedPoint]
    front: dict[str, Any] | None = None
    crop: dict[str, Any] | None = None
    assignee: str | None = None
    locked_by: str | None = None
    run_name: str = ""  # its name in the last run, if different
    frames: dict[str, Any] = Field(default_factory=dict)
    override: dict[str, Any] = Field(default_factory=dict)
    verdicts: list[dict[str, Any]] = Field(default_factory=list)


class Description(Shape):
    """The whole file; `project`, `comments`, `true_lengths` and `bundles` are rows (db/tables.py)."""

    version: Literal[1] = 1
    id: str
    changed: float  # time of the last change of the content
    project: dict[str, Any]
    owner: str | None = None  # accounts by name, as their numbers differ between databases
    assignee: str | None = None
    members: list[str] | None = None  # None if not stored
    objects: list[DescribedObject]
    comments: list[dict[str, Any]] = Field(default_factory=list)
    true_lengths: list[dict[str, Any]] | None = None  # None in files of older versions
    bundles: list[dict[str, Any]] = Field(default_factory=list)
