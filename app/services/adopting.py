"""Restoring a project's rows from its folder, after the database was lost or an older one restored.

No stored data are lost: objects are matched by name, and changes of existing ones can be undone.
"""

import json
import logging
import re
import secrets
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import Engine
from sqlmodel import Session, SQLModel, col, delete, select

from app.db import history, keys, queries
from app.db.description import placed, read_description
from app.db.engine import reading, writing
from app.db.keys import stored_entry
from app.db.queries import clicks_of
from app.db.tables import Account, Bundle, Comment, Event, Job, Point, Project, ProjectMember, SceneObject, TrueLength, Verdict
from app.files import ProjectFiles, delete_folder, project_files
from app.jobs.outcomes import adopt_capture, bundle_row, drawn_in
from app.schemas.description import DescribedObject, DescribedPoint, Description
from r2c2r_core.errors import InputError, R2C2RError
from r2c2r_core.schema.prompts import PromptsFileObject
from r2c2r_core.segment.prompts import checked_prompts

_log = logging.getLogger(__name__)
CHOSEN = {
    "name",
    "segmenter",
    "generator",
    "matcher",
    "arm",
    "register_depth",
    "scale",
    "members_only",
    "review_state",
    "tags",
    "checklist",
    "archived",
}  # options of a project chosen by users
_Said = TypeVar("_Said", Comment, TrueLength)
_ID = re.compile(r"[0-9a-f]{12}")


def adopt_all(engine: Engine, data_dir: Path, who: str) -> list[str]:
    """Adopt every project folder that is not in the database, in place; returns a line about each."""
    said = []
    with reading(engine) as session:
        known = set(session.exec(select(Project.id)))
    for folder in sorted(path for path in (data_dir / "projects").glob("*") if path.is_dir() and path.name not in known):
        try:
            description = described(folder)
            bundles = bundles_in(project_files(data_dir, description.id), description)
            with writing(engine) as session:
                project = adopt(session, data_dir, description, bundles, who)
                said.append(f"{folder.name}: adopted as {project.name}")
        except R2C2RError as error:
            said.append(f"{folder.name}: {error}")
    return said


def described(folder: Path) -> Description:
    """A folder's description; InputError if it is not a project's."""
    try:
        return read_description(folder / "project.json")
    except FileNotFoundError:
        return _of_an_older_version(ProjectFiles(folder, folder / "work"))


def adopt(session: Session, data_dir: Path, description: Description, bundles: Sequence[Bundle], who: str) -> Project:
    """Restore the described project, whose files are in place, with its `bundles_in`; an existing one is completed."""
    files = project_files(data_dir, description.id, description.project.get("work_path"))
    project = session.get(Project, description.id)
    known, now = project is not None, time.time()
    row = placed(description.project, files.root, "source_path")
    if project is None:
        project = Project(**_fields(Project, {"status": "failed", "created": now, **row, "id": description.id, "updated": now}))
        session.add(project)
    project.review_state = "draft"  # an approved project is closed to changes, so approval is restored last
    session.flush()
    items = _adopt_objects(session, project, files, description, who, deleted_too=not known)
    about = _still_known(session, project, description) | items
    _adopt_said(session, project, Comment, description.comments, about)
    _adopt_said(session, project, TrueLength, description.true_lengths or [], about)
    _adopt_bundles(session, project, bundles)
    _adopt_people(session, project, description)
    if not known:
        _read_again(session, project, files, who)
    for name in CHOSEN & row.keys():
        setattr(project, name, row[name])
    project.updated = now
    clicks = sum(len(entry.points) for entry in description.objects)
    text = f"adopted from its folder: {len(items)} objects, {clicks} clicks"
    session.add(Event(project_id=project.id, scope="project", action="adopt", text=text, who=who, at=now))
    session.add(project)
    return project


def _adopt_objects(
    session: Session, project: Project, files: ProjectFiles, description: Description, who: str, *, deleted_too: bool
) -> dict[int | None, SceneObject]:
    """The project's described objects, by old number; deleted ones first, as their names may have been reused."""
    stored = select(SceneObject).where(SceneObject.project_id == project.id, col(SceneObject.deleted).is_(False))
    by_name = {item.name.casefold(): item for item in session.exec(stored)}
    deleted = [entry for entry in description.objects if entry.deleted and deleted_too]
    items = {}
    for entry in (*deleted, *(entry for entry in description.objects if not entry.deleted)):
        known = by_name.get(entry.name.casefold())
        item = known or _new_object(session, project, entry)
        for scope, write in _WRITERS.items():
            changing = history.change(session, item, scope, "adopt", f"adopted {entry.name}", who=who)
            with changing if known else nullcontext():  # an undo must not remove a rediscovered object
                write(session, item, entry, files)
        session.flush()
        keys.note_object(session, item, project.segmenter, clicks_of(session, item.id), history.override_data(session, item))
        if entry.deleted:
            with history.change(session, item, "prompts", "delete", f"deleted {entry.name}", who=who):
                item.deleted = True
                session.add(item)
        items[entry.id] = item
    keys.note_project(session, project)
    _renumber_masks(files, items)
    return items


def _renumber_masks(files: ProjectFiles, items: dict[int | None, SceneObject]) -> None:
    """Move masks, which are stored by object number, of objects with a new number."""
    moved = {str(old): str(item.id) for old, item in items.items() if old is not None and item.id != old}
    there = [old for old in moved if (files.masks / old).is_dir()]
    for old in there:  # in two steps, as a new number may be another's old one
        (files.masks / old).rename(files.masks / f".{old}")
    for old in there:
        delete_folder(files.masks / moved[old])
        (files.masks / f".{old}").rename(files.masks / moved[old])


def _write_prompts(session: Session, item: SceneObject, entry: DescribedObject, _files: ProjectFiles) -> None:
    item.name, item.category, item.colour, item.deleted = entry.name, entry.category, entry.colour, False
    item.front, item.frames, item.crop, item.run_name = entry.front, entry.frames, entry.crop, entry.run_name
    item.assignee = entry.assignee if entry.assignee and queries.has_account(session, entry.assignee) else None
    item.locked_by = entry.locked_by
    session.add(item)
    session.exec(delete(Point).where(col(Point.object_id) == item.id))
    session.add_all(Point(object_id=item.id or 0, **point.model_dump()) for point in entry.points)


def _write_review(session: Session, item: SceneObject, entry: DescribedObject, files: ProjectFiles) -> None:
    history.set_override(session, item, placed(entry.override, files.root, "candidate"))
    session.exec(delete(Verdict).where(col(Verdict.object_id) == item.id))
    session.add_all(Verdict(**{**_fields(Verdict, verdict), "object_id": item.id}) for verdict in entry.verdicts)


_WRITERS: dict[history.Scope, Callable[[Session, SceneObject, DescribedObject, ProjectFiles], None]] = {
    "prompts": _write_prompts,
    "review": _write_review,
}


def _new_object(session: Session, project: Project, entry: DescribedObject) -> SceneObject:
    """A new object, with its old number if it is free, as masks are stored by it."""
    free = entry.id is not None and session.get(SceneObject, entry.id) is None
    item = SceneObject(project_id=project.id, name=entry.name, category=entry.category, colour=entry.colour, deleted=True)
    item.id = entry.id if free else None
    session.add(item)
    session.flush()
    return item


def _still_known(session: Session, project: Project, description: Description) -> dict[int | None, SceneObject]:
    """Stored objects with unchanged number and name, including deleted ones, which keep their comments."""
    stored = {row.id: row for row in session.exec(select(SceneObject).where(SceneObject.project_id == project.id))}
    had = ((entry.id, entry.name) for entry in description.objects)
    return {number: stored[number] for number, name in had if number in stored and stored[number].name == name}


def _adopt_said(
    session: Session,
    project: Project,
    table: type[_Said],
    told: list[dict[str, Any]],
    items: dict[int | None, SceneObject],
) -> None:
    """Add rows of comments or true lengths whose author and time are not in the database."""
    stored = {(row.who, row.at) for row in session.exec(select(table).where(table.project_id == project.id))}
    for entry in told:
        if (entry.get("who"), entry.get("at")) not in stored:
            item = items.get(entry.get("object_id"))
            session.add(table(**{**_fields(table, entry), "project_id": project.id, "object_id": item.id if item else None}))


def bundles_in(files: ProjectFiles, description: Description) -> list[Bundle]:
    """Rows of the bundle files of a described project. It reads the files: call it outside of write transactions."""
    told = {entry.get("path"): entry for entry in description.bundles}
    rows = []
    for kept in sorted(files.bundles.glob("v*.zip")):
        number = kept.stem[1:]
        if number.isdecimal():
            row = bundle_row(description.id, kept, int(number))
            row.sqlmodel_update({key: told[kept.name][key] for key in ("created", "inputs") if key in told.get(kept.name, {})})
            rows.append(row)
    return rows


def _adopt_bundles(session: Session, project: Project, bundles: Sequence[Bundle]) -> None:
    """Add the rows of bundles that the project does not have."""
    stored = set(session.exec(select(Bundle.version).where(Bundle.project_id == project.id)))
    session.add_all(row for row in bundles if row.version not in stored)


def _adopt_people(session: Session, project: Project, description: Description) -> None:
    """Restore owner and members that have accounts here."""
    if description.members is None:
        return
    told = {*description.members, *filter(None, [description.owner, description.assignee])}
    found = {account.name: account.id for account in session.exec(select(Account).where(col(Account.name).in_(told)))}
    if project.owner_id is None and description.owner in found:
        project.owner_id = found[description.owner]
    if project.assignee_id is None and description.assignee in found:
        project.assignee_id = found[description.assignee]
    session.exec(delete(ProjectMember).where(col(ProjectMember.project_id) == project.id))
    session.add_all(
        ProjectMember(project_id=project.id, account_id=found[name] or 0) for name in description.members if name in found
    )


def _read_again(session: Session, project: Project, files: ProjectFiles, who: str) -> None:
    """Restore the recording's facts, else queue a job that reads it, else store the reason."""
    if files.facts.is_file() and files.frames.is_file():
        adopt_capture(project, files)
    elif project.source_path and Path(project.source_path).exists():
        project.status, project.error = "importing", None
        session.add(Job(project_id=project.id, kind="import", state="queued", who=who, created=time.time(), message="waiting"))
    else:
        project.status = "failed"
        project.error = {"kind": "capture", "message": "its recording is not there", "hint": "import it anew"}


def _of_an_older_version(files: ProjectFiles) -> Description:
    """Description of a folder without a project.json, from the recording's facts and the last run's prompts."""
    found, sources = _json(files.facts), sorted(files.source.glob("*"))
    if not found and not sources:
        raise InputError(f"{files.root}: neither project.json nor a recording in it", hint="copy what you need out of it")
    source = str(found.get("source") or (sources[0] if sources else ""))
    overrides = _json(files.work / "overrides.json").get("objects", {})
    prompts = _json(files.work / "prompts.json") or _json(files.finished_prompts)
    named = _ID.match(files.root.name)
    return Description(
        id=named.group() if named else secrets.token_hex(6),
        changed=files.root.stat().st_mtime,
        project={"name": Path(source).stem or "Recovered", "source_name": Path(source).name, "source_path": source},
        objects=[
            _of_prompts(entry, colour, overrides.get(entry.name, {}))
            for colour, entry in enumerate(checked_prompts(prompts).objects if prompts else ())
        ],
    )


def _of_prompts(entry: PromptsFileObject, colour: int, override: dict[str, Any]) -> DescribedObject:
    front, frames, crop = drawn_in(entry)
    return DescribedObject(
        id=None,
        name=entry.name,
        category=entry.category,
        colour=colour,
        points=[DescribedPoint(frame=p.frame, x=p.x, y=p.y, label=p.label) for p in entry.points],
        front=front,
        frames=frames,
        crop=crop,
        override=stored_entry(override),
    )


def _json(path: Path) -> dict[str, Any]:
    """A JSON object written by our own workers; empty where there is none."""
    try:
        found = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _fields(table: type[SQLModel], row: dict[str, Any]) -> dict[str, Any]:
    """The fields of a described row that this version's table has."""
    return {name: value for name, value in row.items() if name in table.model_fields}
