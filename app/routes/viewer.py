"""The 3D view: its content, and its proxy through this origin."""

from fastapi import APIRouter, Request, WebSocket
from fastapi.responses import Response

from app import schemas
from app.deps import Ctx
from app.services import viewers
from app.services.context import Context

router = APIRouter(tags=["viewer"])


@router.post("/api/projects/{project}/viewer", operation_id="openViewer")
async def open_viewer(context: Ctx, request: Request, project: str) -> schemas.ViewerSession:
    """Address of the 3D view; when it is down, a picture and a mesh to show instead."""
    return await context.gates.views.run(context.who, viewers.open_view, context, project, request.state.session)


@router.post("/api/projects/{project}/viewer/show", operation_id="showInViewer")
async def show_in_viewer(context: Ctx, request: Request, project: str, body: schemas.ViewerShow) -> schemas.ViewerShown:
    """Change what the 3D view shows."""
    return await context.gates.views.run(context.who, viewers.show, context, project, request.state.session, body)


@router.post("/api/projects/{project}/viewer/joints", operation_id="setJoints")
async def set_joints(context: Ctx, request: Request, project: str, body: schemas.JointValues) -> schemas.ViewerShown:
    """Move joints of the scene in the 3D view."""
    return await context.gates.views.run(context.who, viewers.set_joints, context, project, request.state.session, body.values)


@router.post("/api/projects/{project}/viewer/place", operation_id="placeInViewer")
async def place_in_viewer(context: Ctx, request: Request, project: str, body: schemas.ViewerPlace) -> schemas.ViewerPlaced:
    """Set the pose of the object being moved in the 3D view; without a pose, return where it was dragged to."""
    return await context.gates.views.run(context.who, viewers.place, context, project, request.state.session, body)


@router.get("/api/projects/{project}/viewer/picked", operation_id="getPicked")
async def get_picked(context: Ctx, request: Request, project: str) -> schemas.ViewerPicked:
    """The object or point of the last click in the 3D view."""
    return await context.gates.views.run(context.who, viewers.picked, context, project, request.state.session)


@router.get("/api/projects/{project}/viewer/camera", operation_id="getViewerCamera")
async def get_viewer_camera(context: Ctx, request: Request, project: str) -> schemas.ViewerCamera:
    """Position and target of the 3D view's camera."""
    return await context.gates.views.run(context.who, viewers.camera, context, project, request.state.session)


@router.get("/viewer/{token}/{path:path}", include_in_schema=False)
async def viewer_page(context: Ctx, request: Request, token: str, path: str) -> Response:
    """The 3D view's page."""
    return await viewers.page(context, token, path, request.state.session)


@router.websocket("/viewer/{token}")
@router.websocket("/viewer/{token}/")
async def viewer_socket(socket: WebSocket, token: str) -> None:
    """The 3D view's connection."""
    context: Context = socket.app.state.context
    await viewers.socket(context, token, socket)
