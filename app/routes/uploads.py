"""Resumable uploads of recordings, modelled on tus 1.0: begin, PATCH at an offset, HEAD for the offset, finish."""

from typing import Annotated

from fastapi import APIRouter, Header, Request, Response

from app import schemas
from app.deps import Ctx
from app.routes.numbers import STREAMED
from app.services import uploads

router = APIRouter(prefix="/api/uploads", tags=["uploads"])

Offset = Annotated[int, Header(alias="Upload-Offset", ge=0, lt=2**53)]


@router.get("", operation_id="listUploads")
def list_uploads(context: Ctx) -> list[schemas.Upload]:
    """Your unfinished uploads, which may be resumed."""
    return uploads.unfinished(context)


@router.post("", operation_id="beginUpload", status_code=201)
def begin_upload(context: Ctx, body: schemas.UploadIn, response: Response) -> schemas.Upload:
    """Announce a recording; its bytes follow."""
    upload = uploads.begin(context, body)
    response.headers["location"] = f"/api/uploads/{upload.id}"
    return upload


@router.head("/{upload}", operation_id="uploadOffset")
def upload_offset(context: Ctx, upload: str) -> Response:
    """Bytes received (Upload-Offset) and expected (Upload-Length)."""
    found = uploads.state(context, upload)
    return Response(headers={"upload-offset": str(found.offset), "upload-length": str(found.size)})


@router.patch("/{upload}", operation_id="continueUpload", status_code=204, max_body_size=STREAMED)
async def continue_upload(context: Ctx, request: Request, upload: str, offset: Offset) -> Response:
    """Append bytes at Upload-Offset; 409 with the right offset in `current` when it is wrong."""
    reached = await uploads.append(context, upload, offset, request.stream())
    return Response(status_code=204, headers={"upload-offset": str(reached)})


@router.post("/{upload}/finish", operation_id="finishUpload", status_code=202)
async def finish_upload(context: Ctx, upload: str) -> schemas.Project:
    """Make a project of a complete upload and start the import. Idempotent; 429 while others of yours are being checked."""
    return await context.gates.looks.run(context.who, uploads.finish, context, upload)


@router.delete("/{upload}", operation_id="cancelUpload", status_code=204)
def cancel_upload(context: Ctx, upload: str) -> None:
    """Cancel the upload; its bytes are deleted."""
    uploads.forget(context, upload)
