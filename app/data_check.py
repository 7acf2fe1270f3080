"""`r2c2r check-data`: consistency of the database and the files in both directions, and file permissions."""

import hashlib
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from sqlmodel import Session, select

from app.db.description import changed, read_description
from app.db.engine import opened, opened_to_read, reading
from app.db.migrations import revisions
from app.db.sqlite import connected, copy_database
from app.db.tables import Bundle, Override, Project, Upload
from app.db.usable import require_usable
from app.files import ProjectFiles, half_received, project_files
from app.settings import Settings
from r2c2r_core.disk import open_to_others, resolved
from r2c2r_core.errors import InputError
from r2c2r_core.progress import SILENT, Progress


@dataclass(frozen=True, slots=True)
class DataFinding:
    """One inconsistency of the data folder."""

    what: str  # damaged | missing | unknown | outdated | open
    where: str
    detail: str

    def to_json(self) -> dict[str, str]:
        """The finding as a JSON object."""
        return asdict(self)


def check_data(data_dir: Path, *, progress: Progress = SILENT) -> list[DataFinding]:
    """All findings; nothing is changed, and the server may run meanwhile.

    Raises InputError where there is no data folder or no database in it, DatabaseUnusable for one that cannot be read.
    """
    settings = Settings(data_dir=resolved(data_dir))
    if settings.postgres:  # a file beside it would predate the move of the rows
        raise InputError("the database is a Postgres; check-data reads SQLite files only", hint="r2c2r db check")
    if not settings.data_dir.is_dir():
        raise InputError(f"{data_dir}: no such folder", hint="name the data folder")
    revision = require_usable(settings.database, to_write=False)
    if revision is None:
        raise InputError(f"{settings.database}: no database yet", hint="r2c2r serve makes one; is this the right folder?")
    progress.at(0.0, "reading the database")
    found = [*_modes(settings), *_revision(settings.database, revision), *_damage(settings.database)]
    with (
        _newest_tables(settings.database, revision) as database,
        opened_to_read(database) as engine,
        reading(engine) as session,
    ):
        found += [*_missing(session, settings, progress.part(0.1, 1.0)), *_unknown(session, settings)]
    return found


@contextmanager
def _newest_tables(database: Path, revision: str) -> Iterator[Path]:
    """The database itself, or for an older revision a migrated copy."""
    if revision == revisions()[-1]:
        yield database
        return
    with tempfile.TemporaryDirectory(prefix="r2c2r-check-data-") as folder:
        copy = Path(folder) / database.name
        copy_database(database, copy)
        with opened(copy):
            pass
        yield copy


def _revision(database: Path, revision: str) -> Iterator[DataFinding]:
    newest = revisions()[-1]
    if revision != newest:
        said = (
            f"revision {revision}, compared in a copy of {newest}; r2c2r serve brings it there and keeps a copy of it as it is"
        )
        yield DataFinding("outdated", str(database), said)


def _modes(settings: Settings) -> Iterator[DataFinding]:
    for path in (settings.data_dir, *settings.data_dir.glob(f"{settings.database.name}*")):
        if mode := open_to_others(path):
            yield DataFinding("open", str(path), f"others may use it ({mode}): chmod go= {path}")


def _damage(database: Path) -> Iterator[DataFinding]:
    with connected(database) as connection:
        for (said,) in connection.execute("PRAGMA integrity_check(20)"):
            if said != "ok":
                yield DataFinding("damaged", str(database), said)
        for table, row, parent, _ in connection.execute("PRAGMA foreign_key_check"):
            yield DataFinding("damaged", str(database), f"row {row} of {table} refers to a missing row of {parent}")


def _missing(session: Session, settings: Settings, progress: Progress) -> Iterator[DataFinding]:
    """Findings on files named in rows that are missing or differ."""
    for project in progress.each(session.exec(select(Project)).all(), "files of project"):
        files = project_files(settings.data_dir, project.id, project.work_path)
        named = [("recording", Path(project.source_path))] if project.source_path else []
        if project.status == "ready":
            named += [("frame table", files.frames), ("facts", files.facts), ("workspace", files.work)]
        for override in session.exec(select(Override).where(Override.project_id == project.id)):
            mesh = str(override.data.get("candidate") or "")
            named += [("uploaded mesh", Path(mesh))] if mesh.startswith("/") else []
        for what, path in named:
            if not path.exists():
                yield DataFinding("missing", str(path), f"{what} of {project.name}")
        yield from _bundles(session, project, files)
        yield from _description(session, project, files)


def _bundles(session: Session, project: Project, files: ProjectFiles) -> Iterator[DataFinding]:
    rows = session.exec(select(Bundle).where(Bundle.project_id == project.id)).all()
    for row in rows:
        kept = files.bundles / row.path
        if not kept.is_file():
            yield DataFinding("missing", str(kept), f"bundle {row.version} of {project.name}")
        elif _sha256(kept) != row.sha256:
            yield DataFinding(
                "damaged", str(kept), f"bundle {row.version} of {project.name}: its bytes differ from the certified ones"
            )
    known = {row.path for row in rows}
    for kept in files.bundles.glob("v*.zip"):
        if kept.name not in known:
            yield DataFinding("unknown", str(kept), f"a bundle of {project.name} that is not in the database")


def _description(session: Session, project: Project, files: ProjectFiles) -> Iterator[DataFinding]:
    if not files.root.is_dir():
        yield DataFinding("missing", str(files.root), f"the folder of {project.name}")
        return
    try:
        then = read_description(files.description).changed
    except (FileNotFoundError, InputError):
        yield DataFinding("missing", str(files.description), f"what {project.name} is; `r2c2r serve` writes it")
        return
    if then != changed(session, project):
        yield DataFinding(
            "outdated", str(files.description), f"it does not match what the database stores about {project.name}"
        )


def _unknown(session: Session, settings: Settings) -> Iterator[DataFinding]:
    """Findings on files that no row names."""
    projects, uploads = set(session.exec(select(Project.id))), set(session.exec(select(Upload.id)))
    for folder in (settings.data_dir / "projects").glob("*"):
        half_made = project_files(settings.data_dir, folder.name).half_made
        if folder.name not in projects and not (half_made and folder.name in uploads):
            yield DataFinding("unknown", str(folder), "a project's folder that is not in the database")
    for path in settings.uploads.glob("*"):
        if path.stem not in uploads and not half_received(path):
            yield DataFinding("unknown", str(path), "bytes of an upload that is not in the database")
    for path in settings.unknown.glob("*"):
        yield DataFinding("unknown", str(path), "set aside; an admin can adopt it on the page Projects")


def _sha256(path: Path) -> str:
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
