"""Capabilities of this app, and the folders it may read."""

from typing import Literal

from app.schemas.base import Shape


class Category(Shape):
    """One line of the category table."""

    name: str
    label: str
    joint: str  # revolute | prismatic | none
    sideways: bool  # it slides along its front


class Backend(Shape):
    """One implementation of a stage."""

    name: str
    summary: str
    licence: str
    licence_class: Literal["open", "restricted"]
    available: bool
    reason: str  # why it is unavailable, and the next step


class BundleFormat(Shape):
    """One scene format of a bundle."""

    name: str  # as requested by a download of some formats only
    file: str
    opened_by: str


class SystemInfo(Shape):
    """Capabilities of the app; limits are shown before a file is chosen."""

    version: str
    user: str
    role: Literal["annotator", "reviewer", "admin"]
    account: bool  # has an account
    sign_out: str | None  # page after signing out; None for the user who started the server, and for users named by a proxy
    max_upload_bytes: int
    free_bytes: int
    import_roots: list[str]
    categories: list[Category]
    palette: list[str]  # colours by object.colour, "#rrggbb"
    viewer: bool
    segmenters: list[Backend]  # of each stage, the first has no requirements and is the default
    generators: list[Backend]
    matchers: list[Backend]
    arms: list[Backend]
    formats: list[BundleFormat]


class FolderEntry(Shape):
    """One entry of a folder from which a recording may be imported."""

    name: str
    path: str
    folder: bool
    size: int | None


class FolderListing(Shape):
    """A folder below an allowed root."""

    path: str
    parent: str | None
    entries: list[FolderEntry]
