"""Database updates after a finished or failed job."""

import hashlib
import json
import math
import os
import shutil
import time
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import event, func
from sqlmodel import Session, select

from app.db import history
from app.db.queries import READS_RECORDING, live_objects, newest_bundle
from app.db.tables import Bundle, Job, Point, Project, SceneObject
from app.files import ProjectFiles, delete_folder
from app.jobs.plans import INPUTS, NAMES
from app.jobs.rows import Finisher
from r2c2r_core.errors import ExportFailed
from r2c2r_core.schema.prompts import PromptsFile, PromptsFileObject
from r2c2r_core.segment.prompts import checked_prompts
from r2c2r_core.workspace import write_atomically


class KeptBundle(NamedTuple):
    """A workspace's bundle, stored as a version."""

    row: Bundle | None  # None: it is the newest version already


def forget_previews(session: Session, job: Job, project: Project, files: ProjectFiles) -> None:
    """Delete the previews of an older reading."""
    shutil.rmtree(files.previews, ignore_errors=True)


def import_done(session: Session, job: Job, project: Project, files: ProjectFiles, _: None = None) -> None:
    """Take over the imported recording."""
    adopt_capture(project, files)
    session.add(project)


def sample_done(session: Session, job: Job, project: Project, files: ProjectFiles, _: None = None) -> None:
    """Take over the sample's recording and clicks."""
    adopt_capture(project, files)
    session.add(project)
    if not live_objects(session, project.id):
        adopt_prompts(session, project, checked_prompts(json.loads((files.source / "prompts.json").read_text())), job.who)


def run_done(session: Session, job: Job, project: Project, files: ProjectFiles, kept: KeptBundle) -> None:
    """Store the bundle as a version, unless it equals the newest one."""
    adopt_bundle(session, project, job.payload.get("inputs", ""), kept)
    names = files.request(job.id or 0).with_name(NAMES)
    named: dict[str, str] = (
        json.loads(names.read_text()) if names.is_file() else {}
    )  # missing beside requests of older versions
    for item in live_objects(session, project.id):
        item.run_name = named.get(str(item.id), item.run_name)
        session.add(item)


def vary_done(session: Session, job: Job, project: Project, files: ProjectFiles, _: None = None) -> None:
    """Nothing to do: the variants have their own self-describing folder."""


def job_ended(session: Session, job: Job, project: Project, files: ProjectFiles) -> None:
    """Mark the project as failed, with the reason, after an unsuccessful import.

    The files of an unreadable upload are deleted after the commit, as a retry would fail the same way.
    """
    project.updated = time.time()
    if job.kind in READS_RECORDING:
        project.status = "failed"
        cancelled = {"kind": "cancelled", "message": "the import was cancelled", "hint": "retry it, or delete the project"}
        project.error = job.error or cancelled
        refused = not project.capture and (job.error or {}).get("kind") == "capture"
        if refused and files.here(project.source_path or "").is_relative_to(files.source):
            project.source_path = None
            event.listen(session, "after_commit", lambda _: _delete_what_was_read(files))
    session.add(project)


def _delete_what_was_read(files: ProjectFiles) -> None:
    """Delete the recording, its unpacked files and previews, but not the log."""
    for folder in (files.source, files.work, files.previews, files.masks, files.requests):
        delete_folder(folder)
    for path in (files.frames, files.facts, *files.scan_pictures):
        path.unlink(missing_ok=True)


def run_files(session: Session, job: Job, project: Project, files: ProjectFiles) -> KeptBundle:
    """Store the bundle as a version, and the prompts of the workspace's masks and the inputs of its objects."""
    request = files.request(job.id or 0)
    write_atomically(files.finished_prompts, request.with_name("prompts.json").read_bytes())
    if (inputs := request.with_name(INPUTS)).is_file():  # missing beside requests of older versions
        write_atomically(files.finished_inputs, inputs.read_bytes())
    return keep_bundle(session, project, files)


def keep_bundle(session: Session, project: Project, files: ProjectFiles) -> KeptBundle:
    """Copy the workspace's bundle as the next version, unless it equals the newest one.

    It reads hundreds of megabytes, so it must not run in a write transaction.
    """
    made = files.work / "bundle.zip"
    if not made.is_file():
        raise ExportFailed("the run ended without a bundle", hint="see the job's log")
    digest = _sha256(made)
    newest = newest_bundle(session, project.id)
    if newest is not None and newest.sha256 == digest:
        return KeptBundle(None)
    files.bundles.mkdir(parents=True, exist_ok=True)
    version = _free_version(files, newest.version + 1 if newest else 1, digest)
    kept = files.bundles / f"v{version}.zip"
    temporary = kept.with_suffix(".part")
    shutil.copyfile(made, temporary)
    os.replace(temporary, kept)
    row = bundle_row(project.id, kept, version)
    row.certificate = _with_speed(row.certificate, files.work)
    return KeptBundle(row)


FINISHERS: dict[str, Finisher] = {
    "import": Finisher(import_done, forget_previews),
    "sample": Finisher(sample_done, forget_previews),
    "run": Finisher(run_done, run_files),
    "vary": Finisher(vary_done),
}


def adopt_capture(project: Project, files: ProjectFiles) -> None:
    """Take over facts.json, written by the ingest process."""
    found: dict[str, Any] = json.loads(files.facts.read_text())
    project.capture, project.notices = found["facts"], found["notices"]
    project.source_path = found["source"] or project.source_path
    project.status, project.error, project.updated = "ready", None, time.time()
    project.media_version = f"{found['facts']['sha256'][:8]}{int(project.updated):x}"
    shutil.rmtree(files.previews, ignore_errors=True)


def adopt_prompts(session: Session, project: Project, file: PromptsFile, who: str) -> list[SceneObject]:
    """Add the objects of a prompts.json; an existing object of the same name gets the file's clicks and category."""
    known = {item.name: item for item in live_objects(session, project.id)}
    colours = session.exec(select(func.count()).select_from(SceneObject).where(SceneObject.project_id == project.id)).one()
    items = []
    for entry in file.objects:
        item = known.get(entry.name)
        if item is None:
            item = SceneObject(project_id=project.id, name=entry.name, category=entry.category, colour=colours, deleted=True)
            session.add(item)
            session.flush()
            colours += 1
        with history.change(session, item, "prompts", "import", f"imported {entry.name}", who=who):
            item.deleted, item.category = False, entry.category
            item.front, item.frames, item.crop = drawn_in(entry)
            session.add(item)
            for old in session.exec(select(Point).where(Point.object_id == item.id)):
                session.delete(old)
            session.flush()
            session.add_all(Point(object_id=item.id or 0, frame=p.frame, x=p.x, y=p.y, label=p.label) for p in entry.points)
        items.append(item)
    return items


def drawn_in(entry: PromptsFileObject) -> tuple[dict[str, Any] | None, dict[str, Any], dict[str, Any] | None]:
    """The drawn parts of an object in a prompts.json, as stored: front, masks by frame, crop box."""
    frames = {str(said.frame): said.mask.model_dump() if said.mask is not None else None for said in entry.frames}
    front, crop = (drawn.model_dump() if drawn is not None else None for drawn in (entry.front, entry.crop))
    return front, frames, crop


def adopt_bundle(session: Session, project: Project, inputs: str, kept: KeptBundle) -> Bundle:
    """Store the copied bundle as the next version, or these inputs with the newest one if it is equal."""
    newest = newest_bundle(session, project.id)
    if kept.row is None:
        assert newest is not None
        newest.inputs = inputs
        session.add(newest)
        return newest
    kept.row.inputs = inputs
    project.updated = time.time()
    session.add(kept.row)
    session.add(project)
    return kept.row


def bundle_row(project_id: str, kept: Path, version: int) -> Bundle:
    """The row of a stored bundle, with its certificate. It reads the whole file: call it outside of write transactions."""
    size, created = kept.stat().st_size, kept.stat().st_mtime
    row = Bundle(project_id=project_id, version=version, path=kept.name, sha256=_sha256(kept), size=size, created=created)
    row.certificate = _certificate_in(kept)
    return row


def _free_version(files: ProjectFiles, version: int, digest: str) -> int:
    """The next version number without an existing file, as a restored database may not know the newest files."""
    while (kept := files.bundles / f"v{version}.zip").exists() and _sha256(kept) != digest:
        version += 1
    return version


def _with_speed(certificate: dict[str, Any] | None, work: Path) -> dict[str, Any] | None:
    """The certificate with this machine's simulation speed, which a reproducible bundle omits."""
    from r2c2r_core.workspace import Workspace

    noun = Workspace(work).load_latest("export", "scene")
    if certificate is None or noun is None:
        return certificate
    steps = {result.loader: [list(pair) for pair in result.steps_per_s] for result in noun.loaders}
    loaders = [{**loader, "steps_per_s": steps.get(loader["loader"], [])} for loader in certificate.get("loaders", [])]
    speed = {"realtime_factor": noun.realtime_factor} if math.isfinite(noun.realtime_factor) else {}
    return {**certificate, "loaders": loaders, **speed}


def _certificate_in(bundle: Path) -> dict[str, Any] | None:
    """The certificate in the bundle's report, or None."""
    try:
        with zipfile.ZipFile(bundle) as archive:
            report: dict[str, Any] = json.loads(archive.read("report.json"))
            return report.get("certificate", report)
    except (KeyError, ValueError, OSError, zipfile.BadZipFile):
        return None


def _sha256(path: Path) -> str:
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
