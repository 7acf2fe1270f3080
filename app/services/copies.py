"""Duplication of a project with recording, clicks, corrections, verdicts, masks, results and bundles.

Alternatively with its recording only, and data computed from it without user input.
"""

import json
import os
import secrets
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.description import describe
from app.db.engine import reading, writing
from app.db.tables import Job, Project
from app.errors import Conflict
from app.files import ProjectFiles, delete_folder, project_files, require_free
from app.services import adopting, crossing, imports, projects, quotas
from app.services.context import Context
from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.workspace import noun_path, write_atomically

_NEVER_WRITTEN = (
    "source",
    "bundles",
    "variants",
)  # files in these are replaced, never modified, so two projects may share them
_RECORDED = ("source", "proposals.json", "awaited-frames.json", "frames.json", "facts.json")  # and pictures of the scan
_RECORDED_WORK = ("capture", "nouns/ingest")
_OWN = ("previews", "requests", "logs", "project.json")  # recreated, or of jobs that the copy never had


def duplicate(
    context: Context,
    project_id: str,
    *,
    recording_only: bool = False,
    name: str | None = None,
    file_name: str | None = None,
    mark: Callable[[Session, Project], None] = lambda session, made: None,
) -> schemas.Project:
    """Duplicate a project, or its recording, as a draft; raises Conflict while a job writes its files.

    `file_name` renames the recording. `mark` sets further fields of the copy in the same transaction, so that a repeated
    request gets the same answer.
    """
    with reading(context.engine) as session:
        row = queries.project_row(session, project_id)
        files, size = context.files(row), row.size_bytes
        under_way = select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(queries.ACTIVE))
        if session.exec(under_way).first() is not None:
            raise Conflict("a job of this project is under way", hint="duplicate it when that has ended")
        description = describe(session, row, files)
    context.store.fetch(project_id, recording=True)
    require_free(context.settings.data_dir, size, context.settings.min_free_bytes)
    copy = project_files(context.settings.data_dir, secrets.token_hex(6))
    description.id, description.owner, description.assignee = copy.root.name, None, None
    if recording_only:
        description.objects, description.comments, description.bundles, description.true_lengths = [], [], [], []
    for item in description.objects:
        item.assignee = None
    description.project |= {"opinion_of": None, "honeypot": False}
    description.project |= {"name": name or f"{description.project['name']} (copy)", "created": time.time(), "work_path": None}
    try:
        _copy_files(files, copy, recording_only)
        if file_name is not None:
            _rename_recording(copy, description.project, file_name)
        context.store.keep(description.id)
        bundles = adopting.bundles_in(copy, description)
        with writing(context.engine) as session:
            quotas.check_project(context, session)
            made = adopting.adopt(session, context.settings.data_dir, description, bundles, context.who)
            made.owner_id, made.review_state, made.archived = imports.account_of(context, session), "draft", False
            mark(session, made)
    except BaseException:
        context.store.delete(description.id)
        delete_folder(copy.root)
        raise
    copy.half_made_mark.unlink()
    crossing.sees_changed(context)
    projects.tell(context, description.id)
    return projects.get_project(context, description.id)


def _copy_files(files: ProjectFiles, copy: ProjectFiles, recording_only: bool) -> None:
    """Copy all needed files, with the recording's paths adapted to the copy."""
    pictures = [path.name for path in files.scan_pictures]
    copy.root.mkdir(parents=True)
    copy.half_made_mark.touch()
    for path in files.root.iterdir():
        left = recording_only and path.name not in (*_RECORDED, *pictures)
        if path.name in _OWN or path == files.work or left:
            continue
        if path.is_dir():
            shutil.copytree(path, copy.root / path.name, copy_function=_link if path.name in _NEVER_WRITTEN else shutil.copy2)
        else:
            shutil.copy2(path, copy.root / path.name)
    for name in _RECORDED_WORK if recording_only else ("",):
        if (files.work / name).exists():
            shutil.copytree(files.work / name, copy.work / name)
    if copy.facts.is_file():
        facts = json.loads(copy.facts.read_text())
        source = Path(facts["source"] or "")
        if source.is_relative_to(files.root):
            facts["source"] = str(copy.root / source.relative_to(files.root))
            write_atomically(copy.facts, json.dumps(facts).encode())


def _rename_recording(copy: ProjectFiles, project: dict[str, Any], name: str) -> None:
    """Rename the copied recording, also in the nouns read from it, from which bundles take their title."""
    for path in (noun_path(copy.work, "ingest", noun) for noun in ("recording", "scene")):
        if path.is_file():
            noun, header = decode_noun(path.read_bytes())
            write_atomically(path, encode_noun(replace(noun, name=Path(name).stem), header))
    recording = copy.root / (project["source_path"] or "")
    if recording.parent == copy.source and recording.exists():
        project["source_path"] = recording.rename(copy.source / name).relative_to(copy.root).as_posix()
        if copy.facts.is_file():
            facts = json.loads(copy.facts.read_text()) | {"source": str(copy.source / name)}
            write_atomically(copy.facts, json.dumps(facts).encode())


def _link(source: str, target: str) -> None:
    """Hard link, or copy where the disk does not support it."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
