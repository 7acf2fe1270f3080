"""Finished bundles: versions, their certificate, and single files out of the newest one."""

import hashlib
import io
import json
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlmodel import select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import Bundle
from app.errors import NotFound, NotReady
from app.files import ProjectFiles
from app.jobs.plain import plain
from app.services.bundle_changes import changes
from app.services.context import Context
from app.services.media import kept_file
from app.services.scenes import manifest
from r2c2r_core.errors import InputError
from r2c2r_core.export.writers.table import formats as known_formats


@dataclass(frozen=True, slots=True)
class BundleFile:
    """A bundle on disk."""

    path: Path
    file_name: str
    sha256: str


def list_bundles(context: Context, project_id: str) -> list[schemas.Bundle]:
    """All versions, newest first."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        rows = queries.bundles(session, Bundle.project_id == project_id)
        return [queries.bundle_shape(row, passed, project.name, project.inputs) for row, passed in rows]


def file(context: Context, project_id: str, version: int) -> BundleFile:
    """One version's file."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        row = session.exec(select(Bundle).where(Bundle.project_id == project_id, Bundle.version == version)).first()
        path = context.files(project).bundles / row.path if row else None
        if row is None or path is None or not path.is_file():
            raise NotFound(f"no bundle of version {version}", hint="see the list of versions")
        return BundleFile(path, queries.bundle_file_name(project.name, row.version, row.sha256), row.sha256)


def part(context: Context, project_id: str, version: int, formats: frozenset[str]) -> BundleFile:
    """A bundle with some formats only, created once, so that a download can be resumed."""
    whole = file(context, project_id, version)
    names = {entry.name for entry in known_formats()}
    if unknown := formats - names:
        raise InputError(f"a bundle has no format {sorted(unknown)[0][:60]!r}", hint=f"its formats: {', '.join(sorted(names))}")
    if formats == names:
        return whole
    return kept_part(context, project_id, whole, version, "-".join(sorted(formats)), lambda: _with_formats(whole.path, formats))


def kept_part(
    context: Context, project_id: str, whole: BundleFile, version: int, key: str, made: Callable[[], bytes]
) -> BundleFile:
    """A part of a bundle as a separate zip, created once."""
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    target = files.previews / f"bundle-v{version}" / f"{key}.zip"
    kept_file(files, target, made)
    return BundleFile(target, whole.file_name.replace(".zip", f"-{key}.zip"), f"{whole.sha256}-{key}")


def check(context: Context, project_id: str, version: int) -> schemas.BundleCheck:
    """Check a stored bundle now: checksums and linter."""
    from r2c2r_core.export.archive import opened_bundle
    from r2c2r_core.export.lint import lint
    from r2c2r_core.export.seal import check_seal

    found = file(context, project_id, version)
    with found.path.open("rb") as handle:
        intact = hashlib.file_digest(handle, "sha256").hexdigest() == found.sha256
    with opened_bundle(found.path) as folder:
        findings = [schemas.Finding.model_validate(plain(finding)) for finding in (*check_seal(folder), *lint(folder))]
    return schemas.BundleCheck(version=version, intact=intact, findings=findings)


def compare(context: Context, project_id: str, older: int, newer: int) -> list[schemas.BundleChange]:
    """Differences between two versions."""
    return changes(*(manifest(file(context, project_id, version).path) for version in (older, newer)))


def certificate(context: Context, project_id: str) -> schemas.Certificate:
    """The newest bundle's certificate."""
    with reading(context.engine) as session:
        inputs = queries.project_row(session, project_id).inputs
        row = queries.newest_bundle(session, project_id)
    if row is None or not row.certificate:
        raise NotReady("there is no certified bundle yet", hint="run the project first")
    said: dict[str, Any] = row.certificate
    known = {name: said.get(name) for name in schemas.Certificate.model_fields if said.get(name) is not None}
    empty = {
        "passed": False,
        "findings": [],
        "loaders": [],
        "joints": [],
        "rest_penetration_m": 0.0,
        "drift_m": 0.0,
        "realtime_factor": 0.0,
    }
    return schemas.Certificate.model_validate({**empty, **known, "version": row.version, "current": row.inputs == inputs})


def member(context: Context, project_id: str, name: str) -> Path:
    """A file of the newest bundle, extracted once."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        row = queries.newest_bundle(session, project_id)
        files = context.files(project)
    if row is None:
        raise NotReady("there is no bundle yet", hint="run the project first")
    return _taken_out(files, row.version, files.bundles / row.path, name)


def picture(context: Context, project_id: str, version: int, name: str) -> Path:
    """A picture of one version, extracted once."""
    bundle = file(context, project_id, version)
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    return _taken_out(files, version, bundle.path, name)


def _taken_out(files: ProjectFiles, version: int, bundle: Path, name: str) -> Path:
    target = files.previews / f"bundle-v{version}" / name
    if not target.is_file():
        try:
            with zipfile.ZipFile(bundle) as archive:
                content = archive.read(_inside(archive, name))
        except (KeyError, FileNotFoundError) as error:
            raise NotFound(f"the bundle has no {name}") from error
        files.write(target, content)
    return target


def folder(context: Context, project_id: str) -> Path | None:
    """The newest bundle unpacked, for loaders that need files; None without one."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        row = queries.newest_bundle(session, project_id)
        files = context.files(project)
    if row is None:
        return None
    target = files.previews / f"bundle-v{row.version}" / "files"
    if not target.is_dir():
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".files.") as scratch:
            part = Path(scratch) / "files"
            with zipfile.ZipFile(files.bundles / row.path) as archive:
                archive.extractall(part)  # our own exporter's archive
            try:
                part.replace(target)
            except OSError:  # another thread unpacked it meanwhile
                if not target.is_dir():
                    raise
    urdf = next(iter(sorted(target.rglob("scene.urdf"))), None)
    return urdf.parent if urdf else None


def root_of(archive: zipfile.ZipFile) -> str:
    """Path prefix of the bundle's root in its zip."""
    return _inside(archive, "manifest.json").removesuffix("manifest.json")


def _inside(archive: zipfile.ZipFile, name: str) -> str:
    """The member called `name` below the bundle's root in the zip."""
    for member_name in sorted(archive.namelist(), key=len):
        if member_name == name or member_name.endswith(f"/{name}"):
            return member_name
    raise KeyError(name)


def _with_formats(bundle: Path, formats: frozenset[str]) -> bytes:
    """The zip without other formats' scenes, and without meshes if no chosen format uses them."""
    others = [entry for entry in known_formats() if entry.name not in formats]
    meshes = any(entry.reads_meshes for entry in known_formats() if entry.name in formats)
    made = io.BytesIO()

    def stays(path: str) -> bool:
        inner = path.removeprefix(top)
        return not any(entry.owns(inner) for entry in others) and (meshes or inner.split("/")[0] not in ("meshes", "assets"))

    with zipfile.ZipFile(bundle) as archive, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as out:
        top = root_of(archive)
        for entry in filter(lambda entry: stays(entry.filename), archive.infolist()):
            content = archive.read(entry)
            if entry.filename.rsplit("/", 1)[-1] == "manifest.json":
                content = _listing_only(content, stays)
            out.writestr(entry, content)
    return made.getvalue()


def _listing_only(manifest: bytes, stays: Callable[[str], bool]) -> bytes:
    """The manifest without checksums of omitted files."""
    document = json.loads(manifest)
    if "files" in document:
        document["files"] = {name: sha256 for name, sha256 in document["files"].items() if stays(name)}
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()
