"""Pixels, meshes and bundles. What cannot change is cached for ever; the address changes when the content does."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from fastapi.responses import FileResponse, Response

from app import schemas
from app.deps import Ctx
from app.routes.files import send
from app.routes.numbers import FrameNumber, RowId
from app.services import bundles, elevations, media, overlays

router = APIRouter(prefix="/media/{project}", tags=["media"], default_response_class=Response)

Formats = Annotated[tuple[str, ...], Query(max_length=10)]
Width = Annotated[int | None, Query(ge=16, le=4096)]


@router.get("/frames/{frame}.jpg", operation_id="frameImage")
def frame_image(context: Ctx, request: Request, project: str, frame: FrameNumber, w: Width = None, v: str = "") -> Response:
    """A frame, at its stored size or `w` pixels wide (rounded up to a size that is kept)."""
    return send(request, media.frame(context, project, frame, w), "image/jpeg", immutable=bool(v))


@router.get("/depth/{frame}.png", operation_id="depthImage")
def depth_image(context: Ctx, request: Request, project: str, frame: FrameNumber, v: str = "") -> Response:
    """A frame's depth in colours, near to far; what was not measured is faint."""
    return send(request, media.depth(context, project, frame), "image/png", immutable=bool(v))


@router.get("/thumbnail.jpg", operation_id="thumbnail")
def thumbnail(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The project's picture."""
    return send(request, media.thumbnail(context, project), "image/jpeg", immutable=bool(v))


@router.get("/scan/{side}.png", operation_id="scanPicture")
def scan_picture(context: Ctx, request: Request, project: str, side: Literal["plan", "view"], v: str = "") -> Response:
    """The fused scan with the camera's path, from above or from where it was filmed; transparent around it."""
    return send(request, media.scan(context, project, side), "image/png", immutable=bool(v))


@router.get("/elevations/{elevation}.png", operation_id="elevationPicture")
def elevation_picture(context: Ctx, request: Request, project: str, elevation: RowId, v: str = "") -> Response:
    """A plane of the scan from the front, a pixel a cell."""
    return send(request, elevations.picture(context, project, elevation), "image/png", immutable=bool(v))


@router.get("/candidates/{object}/{candidate}.glb", operation_id="candidateMesh")
def candidate_mesh(context: Ctx, request: Request, project: str, object: RowId, candidate: str, v: str = "") -> Response:
    """A candidate as GLB, upright where its placement is known."""
    return send(request, media.candidate_glb(context, project, object, candidate), "model/gltf-binary", immutable=bool(v))


@router.get("/candidates/{object}/{candidate}.png", operation_id="candidatePicture")
def candidate_picture(context: Ctx, request: Request, project: str, object: RowId, candidate: str, v: str = "") -> Response:
    """A candidate rendered; all of them from the same side."""
    return send(request, media.candidate_png(context, project, object, candidate), "image/png", immutable=bool(v))


@router.get("/overlay/{object}/{frame}.png", operation_id="overlayPicture")
def overlay_picture(
    context: Ctx,
    request: Request,
    project: str,
    object: RowId,
    frame: FrameNumber,
    of: schemas.OverlayOf = "fitted",
    look: schemas.OverlayLook = "ghost",
    v: str = "",
) -> Response:
    """The object's mesh as that frame's camera sees it, to lay over the photo; transparent around it."""
    return send(request, overlays.overlay(context, project, object, frame, of, look), "image/png", immutable=bool(v))


@router.get("/scene.glb", operation_id="sceneMesh")
def scene_mesh(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The newest bundle's GLB."""
    return send(request, bundles.member(context, project, "scene.glb"), "model/gltf-binary", immutable=bool(v))


@router.get("/preview.png", operation_id="scenePicture")
def scene_picture(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The newest bundle's picture."""
    return send(request, bundles.member(context, project, "preview.png"), "image/png", immutable=bool(v))


@router.get("/report.html", operation_id="sceneReport")
def scene_report(context: Ctx, request: Request, project: str) -> Response:
    """The newest bundle's report, without the right to run anything."""
    answer = send(request, bundles.member(context, project, "report.html"), "text/html", immutable=False)
    answer.headers["content-security-policy"] = (
        "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data: 'self'; frame-ancestors 'self'"
    )
    return answer


@router.get("/review.html", operation_id="sceneReview")
def scene_review(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The newest bundle's 3D page: its own script may run, in an origin of its own, and reach nothing."""
    answer = send(request, bundles.member(context, project, "review.html"), "text/html", immutable=bool(v))
    answer.headers["content-security-policy"] = (
        "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
        "img-src data:; frame-ancestors 'self'"
    )
    return answer


@router.get("/bundles/{version}.zip", operation_id="downloadBundle")
def download_bundle(context: Ctx, project: str, version: RowId, formats: Formats = ()) -> FileResponse:
    """A bundle, or some formats of it; ranges are answered, so a download can go on where it stopped."""
    bundle = bundles.part(context, project, version, frozenset(formats)) if formats else bundles.file(context, project, version)
    return FileResponse(
        bundle.path,
        media_type="application/zip",
        filename=bundle.file_name,
        headers={"cache-control": "private, no-cache", "x-sha256": bundle.sha256, "etag": f'"{bundle.sha256}"'},
    )
