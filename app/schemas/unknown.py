"""Files found in the data folder without a database row."""

from typing import Literal

from app.schemas.base import Shape

UnknownKind = Literal["project", "newer", "upload", "other"]
"""newer: what a project's folder said before an older database was restored; upload: bytes of one, maybe not all of them."""


class UnknownFolder(Shape):
    """One file or folder that was set aside, and what is in it."""

    entry: str  # its name in the folder unknown/
    kind: UnknownKind
    name: str  # the project's, where it is one
    path: str
    size_bytes: int
    changed: float | None  # when anybody last changed it, as far as it says so
    objects: int
    clicks: int
    bundles: int
    recording: bool
    why_not: str  # why it cannot be adopted; empty where it can
    left: bool  # an admin decided to leave it
