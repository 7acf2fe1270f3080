"""Projects and the import of recordings."""

from fastapi import APIRouter, Request

from app import schemas
from app.deps import AdminCtx, Ctx
from app.routes.numbers import STREAMED, Count, FrameNumber, OptionalId
from app.schemas.text import FileName, Title
from app.services import cameras, copies, imports, project_export, projects, rereading, trash, uploads

router = APIRouter(prefix="/api/projects", tags=["projects"])


@router.get("", operation_id="listProjects")
def list_projects(context: Ctx) -> list[schemas.ProjectSummary]:
    """All projects, last touched first."""
    return projects.list_projects(context)


@router.post("/upload", operation_id="uploadProject", status_code=202, max_body_size=STREAMED)
async def upload_project(context: Ctx, request: Request, filename: FileName, name: Title | None = None) -> schemas.Project:
    """A new project from the request's body (the raw bytes of an .r3d or a zip); starts the import."""
    length = request.headers.get("content-length")
    size = int(length) if length and length.isdigit() else None
    return await uploads.whole(context, filename, name, size, request.stream())


@router.post("/import", operation_id="importProject", status_code=202)
def import_project(context: AdminCtx, body: schemas.ImportPath) -> schemas.Project:
    """A new project from a recording on the server's machine; starts the import."""
    return imports.from_path(context, body)


@router.post("/sample", operation_id="sampleProject", status_code=202)
def sample_project(context: Ctx, body: schemas.SampleRequest) -> schemas.Project:
    """A new project with a synthetic kitchen and its prompts."""
    return imports.from_sample(context, body)


@router.get("/{project}", operation_id="getProject")
def get_project(context: Ctx, project: str) -> schemas.Project:
    """One project."""
    return projects.get_project(context, project)


@router.patch("/{project}", operation_id="changeProject")
def change_project(context: Ctx, project: str, body: schemas.ProjectPatch) -> schemas.Project:
    """Change name, tags, archive state or segmenter (refused while its libraries or weights are missing)."""
    return projects.change(context, project, body)


@router.put("/{project}/reading", operation_id="readAgain", status_code=202)
def read_again(context: Ctx, project: str, body: schemas.ReadingIn) -> schemas.Project:
    """Read the recording again with its depth registered to the colour images, or as it was recorded."""
    return rereading.read_again(context, project, body)


@router.delete("/{project}", operation_id="deleteProject")
async def delete_project(context: AdminCtx, project: str) -> schemas.Trashed:
    """Put the project into the trash, where all of it is kept."""
    return await context.gates.deletions.run(context.who, trash.put, context, project)


@router.post("/{project}/duplicate", operation_id="duplicateProject", status_code=201)
async def duplicate_project(context: Ctx, project: str) -> schemas.Project:
    """Copy the project as a draft that you own."""
    return await context.gates.looks.run(context.who, copies.duplicate, context, project)


@router.get("/{project}/file", operation_id="offerProjectFile")
async def offer_project_file(context: Ctx, project: str) -> schemas.ProjectFileOffer:
    """Size of the project as one file (/media/{project}/project.zip), and of its recording."""
    return await context.gates.looks.run(context.who, project_export.offer, context, project)


@router.put("/{project}/recording", operation_id="giveRecording", status_code=202)
async def give_recording(context: Ctx, project: str, body: schemas.RecordingIn) -> schemas.Project:
    """The recording of a project that has none, from an upload that is complete; starts the import."""
    return await context.gates.looks.run(context.who, uploads.give, context, project, body)


@router.get("/{project}/frames", operation_id="listFrames")
def list_frames(context: Ctx, project: str) -> list[schemas.FrameInfo]:
    """The recording's frames, in order."""
    return projects.frames(context, project)


@router.get("/{project}/frames/{frame}/camera", operation_id="getCamera")
def get_camera(context: Ctx, project: str, frame: FrameNumber) -> schemas.FrameCamera:
    """A frame's camera, to draw 3D overlays on its photo."""
    return cameras.camera(context, project, frame)


@router.get("/{project}/history", operation_id="getHistory")
def get_history(
    context: Ctx, project: str, object: OptionalId = None, before: OptionalId = None, limit: Count = 200
) -> list[schemas.HistoryEntry]:
    """Changes of the project with their authors, newest first."""
    return projects.history(context, project, object, before, limit)
