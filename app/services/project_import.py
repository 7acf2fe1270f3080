"""Import of a project's file (project_export.py), fully validated and without acting for local users.

Comments and locks keep their users' names, marked as imported; approvals and verdicts are not imported.
"""

import json
import re
import time
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from sqlmodel import Session

from app import schemas
from app.db import history
from app.db.engine import writing
from app.db.keys import stored_entry
from app.db.tables import Comment, Event, Project, SceneObject, TrueLength, Upload
from app.files import ProjectFiles, delete_folder, project_files, require_free, safe_name
from app.jobs.outcomes import adopt_prompts
from app.schemas.text import LONGEST_WORD
from app.services import imports, in_frames, probing, projects, quotas
from app.services.context import Context
from app.services.project_export import ABOUT, MESHES, OVERRIDES, PROMPTS, RECORDING, recording_name
from r2c2r_core.disk import explained_io
from r2c2r_core.documents import MOST_BYTES, parse_json
from r2c2r_core.errors import InputError, OverrideError, PromptError
from r2c2r_core.generate.meshfile import MOST_BYTES as MOST_MESH_BYTES
from r2c2r_core.generate.meshfile import SUFFIXES
from r2c2r_core.schema.document import AnyDocument, checked
from r2c2r_core.schema.overrides import OverridesFile
from r2c2r_core.schema.prompts import PromptsFile
from r2c2r_core.workspace import write_atomically

_HINT = "export the project again"
_ID = re.compile(r"[A-Za-z0-9_.:+-]+")  # of a candidate: never a path
_PIECE = 1 << 20
_ELSEWHERE = " (imported)"  # after the name of a user of another server
MISSING = {
    "kind": "recording",
    "message": "the project's file came without its recording",
    "hint": "choose the recording it was made from",
}


@dataclass(frozen=True, slots=True)
class _Given:
    """Validated and mutually consistent documents of a project's file."""

    about: schemas.ProjectFile
    prompts: PromptsFile
    overrides: dict[str, dict[str, Any]]  # stored form by object name; meshes by their names in the zip

    @property
    def meshes(self) -> dict[str, str]:
        """Mesh members, each with its object."""
        said = {name: str(entry.get("candidate", "")) for name, entry in self.overrides.items()}
        return {mesh: name for name, mesh in said.items() if mesh.startswith(MESHES)}


def is_project(archive: Path) -> bool:
    """Whether a readable zip is a project's file, as a recording contains no corrections."""
    with zipfile.ZipFile(archive) as found:
        return {ABOUT, PROMPTS, OVERRIDES} <= set(found.namelist())


def take_in(context: Context, upload: Upload, received: Path) -> schemas.Project:
    """Import a project's file; raises InputError, in one line, for an unusable one, and keeps nothing on failure.

    It waits for processes: call it behind the gate of looks. It may be repeated after an interruption.
    """
    files = project_files(context.settings.data_dir, upload.id)
    name = safe_name(upload.file_name)
    with zipfile.ZipFile(received) as archive:
        given = _read(archive, name)
        require_free(context.settings.data_dir, _unpacked(archive), context.settings.min_free_bytes)
        files.source.mkdir(parents=True, exist_ok=True)
        files.half_made_mark.touch()
        try:
            recording = _take_recording(context, archive, given, files, name)
            _take_meshes(context, archive, given, files)
            _await(files, given)
            context.store.keep(upload.id)  # before a row refers to them
            project, job = _rows(context, upload, given, files, recording)
        except BaseException:
            delete_folder(files.root)
            raise
    received.unlink(missing_ok=True)
    files.half_made_mark.unlink(missing_ok=True)
    if job is not None:
        context.runner.queued(job)
    projects.tell(context, project)
    return projects.get_project(context, project)


def _read(archive: zipfile.ZipFile, name: str) -> _Given:
    """Read the documents and check their consistency."""
    about = _document(archive, ABOUT, schemas.ProjectFile, name, InputError)
    prompts = _document(archive, PROMPTS, PromptsFile, name, PromptError)
    overrides = _document(archive, OVERRIDES, OverridesFile, name, OverrideError)
    names = {item.name for item in prompts.objects}
    if stray := sorted(overrides.objects.keys() - names):
        raise OverrideError(f"{name}: {OVERRIDES} corrects {stray[0]!r}, which {PROMPTS} does not have", hint=_HINT)
    corrected = {key: entry.model_dump(mode="json", exclude_unset=True) for key, entry in overrides.objects.items()}
    given = _Given(about, prompts, {key: stored_entry(entry) for key, entry in corrected.items()})
    _check_places(given, name)
    _check_members(archive, given, name)
    return given


def _document(
    archive: zipfile.ZipFile, member: str, model: type[AnyDocument], name: str, failure: type[InputError]
) -> AnyDocument:
    where = f"{name}: {member}"
    size = archive.getinfo(member).file_size
    if size > MOST_BYTES:
        raise failure(f"{where}: {size >> 20} MiB, at most {MOST_BYTES >> 20} MiB expected", hint=_HINT)
    content = _opened(archive, member, name, lambda source: source.read())
    document = parse_json(content, where, failure, hint=_HINT)
    return checked(model, document, where, failure, hint=_HINT)


def _check_places(given: _Given, name: str) -> None:
    """Raise InputError for references to frames or objects that the file lacks."""
    about, objects = given.about, len(given.prompts.objects)
    table = {frame.index: frame.model_dump() for frame in about.recording.frames}
    in_frames.check_file(table, given.prompts)
    if len(about.colours) != objects:
        raise InputError(f"{name}: {ABOUT}: {len(about.colours)} colours of {objects} objects", hint=_HINT)
    if len(about.locks) > objects:
        raise InputError(f"{name}: {ABOUT}: {len(about.locks)} locks of {objects} objects", hint=_HINT)
    for place in (*(one.said.object for one in about.comments), *(one.said.object for one in about.true_lengths)):
        if place is not None and place >= objects:
            raise InputError(f"{name}: {ABOUT}: it refers to object {place}, the last is {objects - 1}", hint=_HINT)
    for comment in about.comments:
        if comment.said.frame is not None:
            in_frames.check_frame(table, comment.said.frame)


def _check_members(archive: zipfile.ZipFile, given: _Given, name: str) -> None:
    """Raise InputError for a missing mesh or recording, and for a candidate that may be a path."""
    members, recording = set(archive.namelist()), given.about.recording
    if recording.included and (wanted := _recording_member(given)) not in members:
        raise InputError(f"{name}: {ABOUT} names the recording {wanted!r}, which is not in it", hint=_HINT)
    for mesh, owner in given.meshes.items():
        if mesh not in members or Path(mesh).suffix.lower() not in SUFFIXES:
            raise OverrideError(f"{name}: {OVERRIDES} gives {owner} the mesh {mesh[:80]!r}, which is not in it", hint=_HINT)
        if archive.getinfo(mesh).file_size > MOST_MESH_BYTES:
            raise OverrideError(f"{name}: {mesh} is larger than {MOST_MESH_BYTES / 1e6:.0f} MB", hint="simplify it first")
    for owner, entry in given.overrides.items():
        candidate = entry.get("candidate")
        if candidate is not None and candidate not in given.meshes and not _ID.fullmatch(candidate):
            raise OverrideError(f"{name}: {OVERRIDES} gives {owner} the candidate {candidate[:80]!r}, no id", hint=_HINT)


def _recording_member(given: _Given) -> str:
    return RECORDING + recording_name(given.about.recording.file_name)


def _unpacked(archive: zipfile.ZipFile) -> int:
    return sum(member.file_size for member in archive.infolist())


def _take_recording(context: Context, archive: zipfile.ZipFile, given: _Given, files: ProjectFiles, name: str) -> Path | None:
    """Extract the file's recording, validated like an upload; None without one."""
    if not given.about.recording.included:
        return None
    own = recording_name(given.about.recording.file_name)
    target = files.source / (
        own if own != name else f"recording-{own}"
    )  # a file with the upload's name would be taken for the upload
    _copy_out(archive, _recording_member(given), target, name)
    probing.check_recording(context, target, own)
    return target


def _take_meshes(context: Context, archive: zipfile.ZipFile, given: _Given, files: ProjectFiles) -> None:
    """Extract the corrections' meshes, each validated like an upload."""
    for member, owner in given.meshes.items():
        target = files.uploads / owner / safe_name(member)
        target.parent.mkdir(parents=True, exist_ok=True)
        _copy_out(archive, member, target, member)
        probing.look_at(context, "mesh", target, target.name)
        given.overrides[owner]["candidate"] = str(target)


def _copy_out(archive: zipfile.ZipFile, member: str, target: Path, name: str) -> None:
    """Extract a member to a file in pieces."""

    def copy(source: Any) -> None:
        with explained_io(target), target.open("wb") as out:
            while piece := source.read(_PIECE):
                out.write(piece)

    _opened(archive, member, name, copy)


def _opened(archive: zipfile.ZipFile, member: str, name: str, use: Callable[[Any], Any]) -> Any:
    """Result of `use` on the open member; InputError for a damaged one."""
    try:
        with archive.open(member) as source:
            return use(source)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{name}: {member} is damaged ({error})", hint="copy the file again") from error


def _await(files: ProjectFiles, given: _Given) -> None:
    """Store the expected frames, to verify the recording when it is read."""
    frames = [frame.model_dump() for frame in given.about.recording.frames]
    write_atomically(files.awaited_frames, json.dumps(frames).encode())


def _rows(
    context: Context, upload: Upload, given: _Given, files: ProjectFiles, recording: Path | None
) -> tuple[str, int | None]:
    """Store the project's rows in one transaction; returns its id and that of the reading job."""
    about = given.about
    with writing(context.engine) as session:
        quotas.check_project(context, session)
        project = projects.new_project(
            session,
            upload.name or about.project.name or upload.file_name,
            about.recording.file_name,
            recording,
            project_id=upload.id,
            began=upload.created,
            owner_id=imports.account_of(context, session),
        )
        absent = _choose(project, about)
        items = adopt_prompts(session, project, given.prompts, context.who)
        for item, colour, locked_by in zip_longest(items, about.colours, about.locks):
            item.colour, item.locked_by = colour, _imported(locked_by) if locked_by else None
            if (entry := given.overrides.get(item.name)) is not None:
                with history.change(session, item, "review", "import", f"corrections of {item.name}", who=context.who):
                    history.set_override(session, item, entry)
        _say(context, session, project, about, items)
        _note(context, session, project, upload, about, absent)
        session.delete(session.merge(upload))
        if recording is not None:
            return project.id, imports.queue_job(context, session, project, "import", {}).id
        project.status, project.error = "failed", MISSING
        return project.id, None


def _choose(project: Project, about: schemas.ProjectFile) -> list[str]:
    """Set the project's options; returns those that this server lacks."""
    absent = []
    for seam, registry in projects.SEAMS.items():
        wanted = getattr(about.project, seam)
        if any(backend.name == wanted for backend in registry.backends) and registry.available(wanted)[0]:
            setattr(project, seam, wanted)
        elif wanted is not None:
            absent.append(f"{seam} {wanted}")
    project.tags = sorted(set(about.project.tags or []), key=str.casefold)
    project.checklist = [entry.model_dump() for entry in about.checklist]
    project.register_depth = about.reading.register_depth or False
    project.scale = about.reading.scale or 1.0
    return absent


def _say(context: Context, session: Session, project: Project, about: schemas.ProjectFile, items: list[SceneObject]) -> None:
    """Add comments by their authors, marked as imported, and lengths, attributed to the importing user."""
    now = time.time()
    for comment in about.comments:
        place, said = comment.said.object, comment.said.model_dump(exclude={"object", "text", "point_world"})
        row = Comment(project_id=project.id, who=_imported(comment.who), at=min(comment.at, now), **said)
        row.text, row.object_id = comment.said.text, None if place is None else items[place].id
        row.point_world = list(comment.said.point_world) if comment.said.point_world else None
        if comment.resolved:
            row.resolved_by, row.resolved_at = context.who, now
        session.add(row)
    for length in about.true_lengths:
        place, measured = length.said.object, length.said.model_dump(exclude={"object", "side"})
        row_of = TrueLength(project_id=project.id, who=context.who, at=min(length.at, now), scale=project.scale, **measured)
        row_of.side, row_of.object_id = length.said.side or "", None if place is None else items[place].id
        session.add(row_of)


def _imported(who: str) -> str:
    """Name of a user of another server, who may not be the one of that name here."""
    return f"{who.removesuffix(_ELSEWHERE)[: LONGEST_WORD - len(_ELSEWHERE)]}{_ELSEWHERE}"


def _note(
    context: Context, session: Session, project: Project, upload: Upload, about: schemas.ProjectFile, absent: list[str]
) -> None:
    counts = f"objects: {len(about.colours)}, comments: {len(about.comments)}"
    said = f"imported from {safe_name(upload.file_name)} ({counts}); verdicts and approvals stayed where they were given"
    text = "; ".join([said, *(f"{one} is not on this server" for one in absent)])
    now = project.updated = time.time()
    session.add(Event(project_id=project.id, scope="project", action="import", text=text, who=context.who, at=now))
