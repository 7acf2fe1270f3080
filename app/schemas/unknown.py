"""Files found in the data folder without a database row."""

from typing import Literal

from app.schemas.base import Shape

UnknownKind = Literal["project", "newer", "upload", "other"]
"""newer: a project's description from before an older database was restored; upload: its bytes, possibly incomplete."""


class UnknownFolder(Shape):
    """One file or folder that was set aside, and its content."""

    entry: str  # its name in the folder unknown/
    kind: UnknownKind
    name: str  # of the project, if it is one
    path: str
    size_bytes: int
    changed: float | None  # time of its last change, if known
    objects: int
    clicks: int
    bundles: int
    recording: bool
    why_not: str  # why it cannot be adopted; empty if it can
    left: bool  # an admin decided to leave it
