"""Capabilities of the app, and folders from which recordings may be imported."""

import stat
from pathlib import Path

from app import schemas
from app.errors import Forbidden, NotFound
from app.files import free_bytes
from app.services.context import Context
from r2c2r_core import __version__
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.export.writers.table import formats
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.registry import Backend, Registry
from r2c2r_core.robot.arms import ARMS
from r2c2r_core.segment.stage import SEGMENTERS

PALETTE = [  # Okabe-Ito and tones that keep 3:1 against them; at least 0.14 apart in OKLab, for 24 distinct objects
    # ordered so that objects clicked in turn, which are neighbours, differ most under their masks
    "#e69f00", "#56b4e9", "#cc79a7", "#ff00ff", "#d55e00", "#17becf",
    "#9467bd", "#f0e442", "#c30078", "#009e73", "#0072b2", "#ffc3e1",
    "#a500ff", "#5a5aff", "#006900", "#7f7f7f", "#00ff00", "#0000ff",
    "#bcbd22", "#ff87ff", "#8c564b", "#78f0c3", "#00c300", "#6900b4",
]  # fmt: skip


def describe(context: Context) -> schemas.SystemInfo:
    """Limits, categories, palette, free space."""
    settings = context.settings
    return schemas.SystemInfo(
        version=__version__,
        user=context.who,
        role=context.person.role,
        account=context.person.account,
        sign_out=_after_signing_out(context),
        max_upload_bytes=settings.max_upload_bytes,
        free_bytes=free_bytes(settings.data_dir),
        import_roots=[str(root) for root in settings.roots] if context.person.may("admin") else [],
        categories=_categories(),
        palette=PALETTE,
        viewer=context.viewer.enabled,
        segmenters=_backends(SEGMENTERS),
        generators=_backends(GENERATORS),
        matchers=_backends(MATCHERS),
        arms=_backends(ARMS),
        formats=[schemas.BundleFormat(name=f.name, file=f.file, opened_by=f.opened_by) for f in formats()],
    )


def _after_signing_out(context: Context) -> str | None:
    if not context.person.account or context.settings.identity_header:
        return None
    return "/login/provider/out" if context.provider else "/login"


def browse(context: Context, path: str | None) -> schemas.FolderListing:
    """A folder below an allowed root; without a path, the roots."""
    if not path:
        roots = [
            schemas.FolderEntry(name=str(r), path=str(r), folder=True, size=None) for r in context.settings.roots if r.is_dir()
        ]
        return schemas.FolderListing(path="", parent=None, entries=roots)
    folder = allowed_path(context, path)
    if not folder.is_dir():
        raise NotFound(f"{folder} is not a folder")
    try:
        found = sorted(
            (p for p in folder.iterdir() if not p.name.startswith(".")), key=lambda p: (p.is_file(), p.name.casefold())
        )
    except PermissionError as error:
        raise Forbidden(f"this app has no permission to read {folder}", hint="choose another folder") from error
    entries = [entry for p in found[:2000] if (entry := _entry(p))]
    parent = folder.parent if _is_allowed(context, folder.parent) else None
    return schemas.FolderListing(path=str(folder), parent=str(parent) if parent else "", entries=entries)


def allowed_path(context: Context, path: str) -> Path:
    """The resolved path; raises Forbidden outside the allowed roots (links are followed)."""
    if "\x00" in path:
        raise Forbidden("the path holds a zero byte")
    try:
        resolved = Path(path).expanduser().resolve()
    except (OSError, RuntimeError) as error:
        raise NotFound(f"{path}: {error}") from error
    if any(part.startswith(".") for part in _below_root(context, resolved).parts):
        raise Forbidden(f"{resolved} is in a hidden folder", hint="choose a folder that is not hidden")
    if not _is_allowed(context, resolved):
        roots = ", ".join(str(root) for root in context.settings.roots)
        hint = f"allowed: {roots}; `r2c2r serve --import-from DIR` allows another one"
        raise Forbidden(f"{resolved} is outside the folders that recordings may be imported from", hint=hint)
    return resolved


def _below_root(context: Context, path: Path) -> Path:
    """The path relative to its deepest allowed root; empty outside them."""
    roots = [root.resolve() for root in context.settings.roots if path.is_relative_to(root.resolve())]
    return path.relative_to(max(roots, key=lambda root: len(root.parts))) if roots else Path()


def _is_allowed(context: Context, path: Path) -> bool:
    return any(path.is_relative_to(root.resolve()) for root in context.settings.roots)


def _entry(path: Path) -> schemas.FolderEntry | None:
    """A folder or a regular file; None for anything else, or if it has disappeared."""
    try:
        found = path.stat()
    except OSError:
        return None
    if stat.S_ISDIR(found.st_mode):
        return schemas.FolderEntry(name=path.name, path=str(path), folder=True, size=None)
    if stat.S_ISREG(found.st_mode):
        return schemas.FolderEntry(name=path.name, path=str(path), folder=False, size=found.st_size)
    return None


def _backends(registry: Registry) -> list[schemas.Backend]:
    return [_backend(registry, backend) for backend in registry.backends]


def _backend(registry: Registry, backend: Backend) -> schemas.Backend:
    ready, reason = registry.available(backend.name)
    return schemas.Backend(
        name=backend.name,
        summary=backend.summary,
        licence=backend.licence,
        licence_class=backend.licence_class,
        available=ready,
        reason="" if ready else reason,
    )


def _categories() -> list[schemas.Category]:
    """All category names; the label of a synonym includes its category."""
    from r2c2r_core.kitchen.categories import every_category

    return [
        schemas.Category(name=name, label=category.label, joint=_JOINTS[category.motion], sideways=category.opens == "sideways")
        for category in every_category()
        for name in category.names
    ]


_JOINTS = {"hinge": "revolute", "out": "prismatic", "along": "prismatic", "none": "none"}
