"""Export of a project as one file for another server: user input, optionally with the recording.

Recomputable results (masks, candidates, bundles), members and approvals are not exported.
"""

import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic_core import to_json
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.documents import overrides_document, prompt_entry, prompts_version
from app.db.engine import reading
from app.db.tables import Comment, Project, TrueLength
from app.errors import NotFound
from app.files import ProjectFiles, folder_bytes, safe_name
from app.services.context import Context
from app.services.lengths import points_now
from app.services.projects import frame_table
from r2c2r_core.export.manifest import tool_version

ABOUT, PROMPTS, OVERRIDES = "project.json", "prompts.json", "overrides.json"
MESHES, RECORDING = "meshes/", "recording/"
_PIECE = 1 << 20
_OF_A_FRAME = tuple(schemas.ProjectFileFrame.model_fields)
_NAMED = ("name", "tags", "segmenter", "generator", "matcher", "arm")


@dataclass(frozen=True, slots=True)
class Export:
    """Content of a project's file, before any large file is read."""

    file_name: str
    documents: dict[str, bytes]
    meshes: dict[str, Path]
    recording: Path | None  # a file or a folder; None: not available


def offer(context: Context, project_id: str) -> schemas.ProjectFileOffer:
    """Size of a project's file."""
    found = _gathered(context, project_id, recording=True)
    said = sum(len(content) for content in found.documents.values())
    return schemas.ProjectFileOffer(
        size_bytes=said + sum(mesh.stat().st_size for mesh in found.meshes.values()),
        recording_bytes=_bytes(found.recording) if found.recording else None,
    )


def gathered(context: Context, project_id: str, *, recording: bool) -> Export:
    """Collect the file's content; raises NotFound if the recording is requested but not available."""
    found = _gathered(context, project_id, recording=recording)
    if recording and found.recording is None:
        raise NotFound("the recording is not kept here", hint="export the project without it")
    return found


def _gathered(context: Context, project_id: str, *, recording: bool) -> Export:
    context.store.fetch(project_id, recording=recording)
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        files = context.files(project)
        source = files.here(project.source_path) if project.source_path else None
        kept = source if recording and source is not None and source.exists() else None
        prompts, overrides, meshes = _given(session, project, files)
        about = _about(session, project, files, kept)
    documents = {PROMPTS: to_json(prompts, indent=1), OVERRIDES: to_json(overrides, indent=1)}
    return Export(
        file_name=f"{safe_name(project.name.replace('/', '-'), 'project')}.r2c2r.zip",
        documents={ABOUT: about.model_dump_json(exclude_none=True, indent=1).encode(), **documents},
        meshes=meshes,
        recording=kept,
    )


def streamed(export: Export) -> Iterator[bytes]:
    """The zip as a stream of pieces, with only one in memory."""
    sink = _Sink()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in export.documents.items():
            out.writestr(name, content)
        for name, mesh in export.meshes.items():
            yield from _copied(out, name, mesh, sink)
        if export.recording is not None:
            yield from _recording(out, export.recording, sink)
    yield sink.taken()


def recording_name(source_name: str) -> str:
    """Name of the recording in the file; a folder becomes a zip."""
    name = safe_name(source_name)
    return name if Path(name).suffix.lower() in (".r3d", ".zip") else f"{name}.zip"


def _recording(out: zipfile.ZipFile, source: Path, sink: "_Sink") -> Iterator[bytes]:
    """The recording, stored uncompressed, as its images are compressed already; a folder as a zip in the zip."""
    name = RECORDING + recording_name(source.name)
    if source.is_file():
        yield from _copied(out, name, source, sink, zipfile.ZIP_STORED)
        return
    with out.open(zipfile.ZipInfo(name), "w", force_zip64=True) as member, zipfile.ZipFile(member, "w") as inner:
        for path in sorted(path for path in source.rglob("*") if path.is_file()):
            yield from _copied(inner, path.relative_to(source).as_posix(), path, sink, zipfile.ZIP_STORED)


def _copied(
    out: zipfile.ZipFile, name: str, path: Path, sink: "_Sink", compression: int = zipfile.ZIP_DEFLATED
) -> Iterator[bytes]:
    entry = zipfile.ZipInfo(name)
    entry.compress_type = compression
    with path.open("rb") as source, out.open(entry, "w", force_zip64=True) as member:
        while piece := source.read(_PIECE):
            member.write(piece)
            yield sink.taken()


def _given(session: Session, project: Project, files: ProjectFiles) -> tuple[dict[str, Any], dict[str, Any], dict[str, Path]]:
    """prompts.json of all objects, overrides.json, and its meshes by their names in the zip."""
    clicks = queries.clicks_by_object(session, project.id)
    objects = [prompt_entry(item, clicks.get(item.id or 0, [])) for item in queries.live_objects(session, project.id)]
    overrides, meshes = overrides_document(session, project.id), {}
    for entry in overrides["objects"].values():
        mesh = files.here(str(entry.get("candidate", "")))
        if mesh.is_relative_to(files.uploads) and mesh.is_file():
            entry["candidate"] = MESHES + mesh.relative_to(files.uploads).as_posix()
            meshes[entry["candidate"]] = mesh
    return {"version": prompts_version(objects), "objects": objects}, overrides, meshes


def _about(session: Session, project: Project, files: ProjectFiles, kept: Path | None) -> schemas.ProjectFile:
    frames = [{name: entry[name] for name in _OF_A_FRAME} for entry in frame_table(files)]
    items = queries.live_objects(session, project.id)
    places = {item.id: place for place, item in enumerate(items)}
    comments = session.exec(select(Comment).where(Comment.project_id == project.id).order_by(col(Comment.id)))
    lengths = session.exec(select(TrueLength).where(TrueLength.project_id == project.id).order_by(col(TrueLength.id)))
    return schemas.ProjectFile(
        tool_version=tool_version(),
        project=schemas.ProjectPatch.model_construct(**{name: getattr(project, name) for name in _NAMED}),
        reading=schemas.ReadingIn(register_depth=project.register_depth, scale=project.scale),
        recording=schemas.ProjectFileRecording.model_validate(  # validated at once, as there are thousands of frames
            {"file_name": kept.name if kept else project.source_name, "frames": frames, "included": kept is not None}
        ),
        checklist=[schemas.ListedObject(**entry) for entry in project.checklist],
        colours=[item.colour for item in items],
        locks=[item.locked_by for item in items],
        comments=[_comment(row, places) for row in comments],
        true_lengths=[_length(row, project, places) for row in lengths if row.object_id is None or row.object_id in places],
    )


def _comment(row: Comment, places: dict[int | None, int]) -> schemas.ProjectFileComment:
    pinned = row.model_dump(include={"frame", "x", "y", "point_world", "view", "text"})
    said = schemas.CommentIn(object=places.get(row.object_id), **pinned)
    return schemas.ProjectFileComment(who=row.who, at=row.at, resolved=row.resolved_at is not None, said=said)


def _length(row: TrueLength, project: Project, places: dict[int | None, int]) -> schemas.ProjectFileLength:
    said = schemas.TrueLengthIn(
        metres=row.metres,
        object=places.get(row.object_id),
        side=row.side or None,  # type: ignore[arg-type]  # the column has no other values
        points_world=points_now(row, project.scale),
        text=row.text,
    )
    return schemas.ProjectFileLength(who=row.who, at=row.at, said=said)


def _bytes(path: Path) -> int:
    return folder_bytes(path) if path.is_dir() else path.stat().st_size


class _Sink(io.RawIOBase):
    """Unseekable output buffer of a zip, emptied by `taken`."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def writable(self) -> bool:
        """Always True."""
        return True

    def write(self, piece: Any) -> int:
        """Buffer a piece."""
        self._pieces.append(bytes(piece))
        return len(piece)

    def taken(self) -> bytes:
        """Return and clear the buffered bytes."""
        found = b"".join(self._pieces)
        self._pieces.clear()
        return found
