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
    """One way to do a stage's work."""

    name: str
    summary: str
    licence: str
    licence_class: Literal["open", "restricted"]
    available: bool
    reason: str  # why not, and the next step


class BundleFormat(Shape):
    """One file of a bundle that carries the scene."""

    name: str  # as a download of some formats only asks for it
    file: str
    opened_by: str


class SystemInfo(Shape):
    """Capabilities of the app; limits are shown before a file is chosen."""

    version: str
    user: str
    role: Literal["annotator", "reviewer", "admin"]
    account: bool  # has an account
    sign_out: str | None  # the page that follows on signing out; None: who started the server, and where a proxy says who asks
    max_upload_bytes: int
    free_bytes: int
    import_roots: list[str]
    categories: list[Category]
    palette: list[str]  # colours by object.colour, "#rrggbb"
    viewer: bool
    segmenters: list[Backend]  # of each seam the first needs nothing and is the default
    generators: list[Backend]
    matchers: list[Backend]
    arms: list[Backend]
    formats: list[BundleFormat]


class FolderEntry(Shape):
    """One line of a folder that a recording may be taken from."""

    name: str
    path: str
    folder: bool
    size: int | None


class FolderListing(Shape):
    """A folder below an allowed root."""

    path: str
    parent: str | None
    entries: list[FolderEntry]
