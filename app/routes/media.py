"""Images, meshes and bundles. Immutable content is cached for ever; its address changes with the content."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from fastapi import Path as PathParam
from fastapi.responses import FileResponse, RedirectResponse, Response, StreamingResponse

from app import schemas
from app.deps import Ctx
from app.routes.files import send
from app.routes.numbers import FrameNumber, RowId
from app.services import bundle_inside, bundles, differences, elevations, media, overlays, project_export, variants

router = APIRouter(prefix="/media/{project}", tags=["media"], default_response_class=Response)

Formats = Annotated[tuple[str, ...], Query(max_length=10)]
PictureName = Annotated[str, PathParam(pattern=r"^[A-Za-z0-9_]+\.(jpg|svg)$", max_length=200)]
Width = Annotated[int | None, Query(ge=16, le=4096)]


@router.get("/frames/{frame}.jpg", operation_id="frameImage")
def frame_image(context: Ctx, request: Request, project: str, frame: FrameNumber, w: Width = None, v: str = "") -> Response:
    """A frame, at its stored size or `w` pixels wide (rounded up to a cached size)."""
    return send(request, media.frame(context, project, frame, w), "image/jpeg", immutable=bool(v))


@router.get("/depth/{frame}.png", operation_id="depthImage")
def depth_image(context: Ctx, request: Request, project: str, frame: FrameNumber, v: str = "") -> Response:
    """A frame's depth in colours, near to far; pixels without a measurement are faint."""
    return send(request, media.depth(context, project, frame), "image/png", immutable=bool(v))


@router.get("/thumbnail.jpg", operation_id="thumbnail")
def thumbnail(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The project's picture."""
    return send(request, media.thumbnail(context, project), "image/jpeg", immutable=bool(v))


@router.get("/arriving.jpg", operation_id="arrivingPicture")
def arriving_picture(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The newest frame of a sample kitchen while it is rendered."""
    return send(request, media.arriving(context, project), "image/jpeg", immutable=bool(v))


@router.get("/scan/{side}.png", operation_id="scanPicture")
def scan_picture(context: Ctx, request: Request, project: str, side: Literal["plan", "view"], v: str = "") -> Response:
    """The fused scan with the camera's path, from above or from where it was filmed; transparent around it."""
    return send(request, media.scan(context, project, side), "image/png", immutable=bool(v))


@router.get("/elevations/{elevation}.png", operation_id="elevationPicture")
def elevation_picture(context: Ctx, request: Request, project: str, elevation: RowId, v: str = "") -> Response:
    """The picture of an elevation, one pixel per cell."""
    return send(request, elevations.picture(context, project, elevation), "image/png", immutable=bool(v))


@router.get("/candidates/{object}/{candidate}.glb", operation_id="candidateMesh")
def candidate_mesh(context: Ctx, request: Request, project: str, object: RowId, candidate: str, v: str = "") -> Response:
    """A candidate as GLB, upright where its placement is known."""
    return send(request, media.candidate_glb(context, project, object, candidate), "model/gltf-binary", immutable=bool(v))


@router.get("/candidates/{object}/{candidate}.png", operation_id="candidatePicture")
def candidate_picture(context: Ctx, request: Request, project: str, object: RowId, candidate: str, v: str = "") -> Response:
    """A candidate rendered; all of them from the same side."""
    return send(request, media.candidate_png(context, project, object, candidate), "image/png", immutable=bool(v))


@router.get("/candidates/{object}/{candidate}/turns.png", operation_id="candidateTurns")
def candidate_turns(
    context: Ctx, request: Request, project: str, object: RowId, candidate: str, against: str = "", v: str = ""
) -> Response:
    """A candidate from 24 sides, from left to right; surfaces that differ from the candidate `against` in another colour."""
    return send(request, differences.strip(context, project, object, candidate, against), "image/png", immutable=bool(v))


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
    """The newest bundle's report, with scripts disabled; its pictures load from this origin."""
    answer = send(request, bundles.member(context, project, "report.html"), "text/html", immutable=False)
    answer.headers["content-security-policy"] = (
        "sandbox allow-same-origin; default-src 'none'; style-src 'unsafe-inline'; img-src data: 'self'; frame-ancestors 'self'"
    )
    return answer


@router.get("/README.txt", operation_id="sceneReadme")
def scene_readme(context: Ctx, request: Request, project: str) -> Response:
    """Loading instructions of the newest bundle, linked from its report."""
    return send(request, bundles.member(context, project, "README.txt"), "text/plain; charset=utf-8", immutable=False)


@router.get("/review.html", operation_id="sceneReview")
def scene_review(context: Ctx, request: Request, project: str, v: str = "") -> Response:
    """The newest bundle's 3D page: its script runs in an opaque origin without network access."""
    answer = send(request, bundles.member(context, project, "review.html"), "text/html", immutable=bool(v))
    answer.headers["content-security-policy"] = (
        "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
        "img-src data:; frame-ancestors 'self'"
    )
    return answer


@router.get("/project.zip", operation_id="downloadProject")
async def download_project(context: Ctx, project: str, recording: bool = False) -> Response:
    """The project as one file, to be imported by another server; on request with its recording."""
    export = await context.gates.looks.run(context.who, project_export.gathered, context, project, recording=recording)
    headers = {"content-disposition": f'attachment; filename="{export.file_name}"', "cache-control": "no-store"}
    return StreamingResponse(project_export.streamed(export), media_type="application/zip", headers=headers)


@router.get("/bundles/{version}.zip", operation_id="downloadBundle")
def download_bundle(context: Ctx, project: str, version: RowId, formats: Formats = ()) -> Response:
    """A bundle, or some formats of it; range requests let a download resume."""
    bundle = bundles.part(context, project, version, frozenset(formats)) if formats else bundles.file(context, project, version)
    return _download(context, project, bundle)


@router.get("/bundles/{version}/objects/{object_name}.zip", operation_id="downloadObject")
def download_object(context: Ctx, project: str, version: RowId, object_name: str) -> Response:
    """One object of a bundle alone, with its meshes and textures."""
    return _download(context, project, bundle_inside.object_alone(context, project, version, object_name))


@router.get("/bundles/{version}/pictures/{folder}/{picture}", operation_id="bundlePicture")
def bundle_picture(
    context: Ctx, request: Request, project: str, version: RowId, folder: Literal["gripper", "arm"], picture: PictureName
) -> Response:
    """A picture of a robot's trial at a joint, or of an arm's positions."""
    kind = "image/svg+xml" if picture.endswith(".svg") else "image/jpeg"
    answer = send(request, bundles.picture(context, project, version, f"{folder}/{picture}"), kind, immutable=True)
    answer.headers["content-security-policy"] = "sandbox; default-src 'none'; style-src 'unsafe-inline'"
    return answer


@router.get("/variants/{variants_name}.zip", operation_id="downloadVariants")
def download_variants(context: Ctx, project: str, variants_name: schemas.VariantsName) -> Response:
    """Variants of a bundle that were made together."""
    return _download(context, project, variants.archive(context, project, variants_name))


@router.get("/variants/{variants_name}.jpg", operation_id="variantsWall")
def variants_wall(context: Ctx, request: Request, project: str, variants_name: schemas.VariantsName, v: str = "") -> Response:
    """The first variants in their initial state, side by side."""
    return send(request, variants.wall(context, project, variants_name), "image/jpeg", immutable=bool(v))


@router.get("/{folder}/{picture}", operation_id="reportPicture")
def report_picture(
    context: Ctx, request: Request, project: str, folder: Literal["pictures", "gripper", "arm"], picture: PictureName
) -> Response:
    """A picture of the newest bundle's report."""
    kind = "image/svg+xml" if picture.endswith(".svg") else "image/jpeg"
    answer = send(request, bundles.member(context, project, f"{folder}/{picture}"), kind, immutable=False)
    answer.headers["content-security-policy"] = "sandbox; default-src 'none'; style-src 'unsafe-inline'"
    return answer


def _download(context: Ctx, project: str, bundle: bundles.BundleFile) -> Response:
    if link := context.store.link(project, bundle.path, bundle.file_name):
        return RedirectResponse(link, 302, {"cache-control": "no-store", "x-sha256": bundle.sha256})
    return FileResponse(
        bundle.path,
        media_type="application/zip",
        filename=bundle.file_name,
        headers={"cache-control": "private, no-cache", "x-sha256": bundle.sha256, "etag": f'"{bundle.sha256}"'},
    )
