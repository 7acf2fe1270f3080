"""Objects, clicks, undo, and the resulting masks."""

from fastapi import APIRouter
from fastapi.responses import Response

from app import schemas
from app.deps import Ctx
from app.routes.encoded import as_json
from app.routes.numbers import FrameNumber, RowId
from app.services import clouds, masks, openings, prompt_files, prompts, undoing

router = APIRouter(prefix="/api/projects/{project}", tags=["prompts"])


@router.get("/objects", operation_id="listObjects", response_model=list[schemas.SceneObject])
def list_objects(context: Ctx, project: str, deleted: bool = False) -> Response:
    """The project's objects in the order they were made; deleted ones too when asked."""
    return as_json(prompts.list_objects(context, project, deleted))


@router.post("/objects", operation_id="createObject", status_code=201)
def create_object(context: Ctx, project: str, body: schemas.ObjectIn, infer: bool = True) -> schemas.SceneObject:
    """A new object, with its first clicks if there are any; `infer` starts its masks."""
    return prompts.create(context, project, body, infer)


@router.patch("/objects/{object}", operation_id="editObject")
def edit_object(context: Ctx, project: str, object: RowId, body: schemas.ObjectPatch) -> schemas.SceneObject:
    """Rename, recategorise, recolour; 409 with what is stored now when `version` is old."""
    return prompts.edit(context, project, object, body)


@router.delete("/objects/{object}", operation_id="deleteObject")
def delete_object(context: Ctx, project: str, object: RowId) -> schemas.SceneObject:
    """Delete the object; undo brings it back."""
    return prompts.delete(context, project, object)


@router.post("/objects/{object}/points", operation_id="addPoint", status_code=201)
def add_point(context: Ctx, project: str, object: RowId, body: schemas.PointIn, infer: bool = True) -> schemas.SceneObject:
    """One click; without `infer` the masks wait for the next one (or for segment)."""
    return prompts.add_point(context, project, object, body, infer)


@router.post("/objects/{object}/clicks", operation_id="addPoints", status_code=201)
def add_points(context: Ctx, project: str, object: RowId, body: schemas.PointsIn, infer: bool = True) -> schemas.SceneObject:
    """Clicks that belong together, such as those of a box: one change with one undo."""
    return prompts.add_points(context, project, object, body, infer)


@router.get("/objects/{object}/cloud", operation_id="getObjectPoints")
def get_object_points(context: Ctx, project: str, object: RowId) -> schemas.ObjectPoints:
    """The object's points in 3D, from its masks and the depth under them; none while there are no masks."""
    return clouds.object_points(context, project, object)


@router.patch("/objects/{object}/points/{point}", operation_id="movePoint")
def move_point(
    context: Ctx, project: str, object: RowId, point: RowId, body: schemas.PointPatch, infer: bool = True
) -> schemas.SceneObject:
    """Move a click or flip its label."""
    return prompts.move_point(context, project, object, point, body, infer)


@router.delete("/objects/{object}/points/{point}", operation_id="deletePoint")
def delete_point(context: Ctx, project: str, object: RowId, point: RowId, infer: bool = True) -> schemas.SceneObject:
    """Delete a click."""
    return prompts.delete_point(context, project, object, point, infer)


@router.put("/objects/{object}/frames/{frame}", operation_id="setFrame")
def set_frame(context: Ctx, project: str, object: RowId, frame: FrameNumber, body: schemas.FrameIn) -> schemas.SceneObject:
    """Correct the object in that frame: set a fixed mask, or mark it as not visible."""
    return prompts.say_of_frame(context, project, object, frame, body)


@router.delete("/objects/{object}/frames/{frame}", operation_id="leaveFrame")
def leave_frame(context: Ctx, project: str, object: RowId, frame: FrameNumber) -> schemas.SceneObject:
    """Remove the correction in that frame, which restores the computed mask."""
    return prompts.say_of_frame(context, project, object, frame, None)


@router.post("/undo", operation_id="undo")
def undo(context: Ctx, project: str, body: schemas.UndoRequest) -> schemas.Undone:
    """Undo the last change of one object, or of the project; 409 when there is none, or `version` is old."""
    return undoing.undo(context, project, body)


@router.post("/redo", operation_id="redo")
def redo(context: Ctx, project: str, body: schemas.UndoRequest) -> schemas.Undone:
    """Redo the last undone change; 409 when there is nothing, or `version` is old."""
    return undoing.redo(context, project, body)


@router.get("/prompts.json", operation_id="exportPrompts", response_model_exclude_unset=True)  # version 1 knows no front
def export_prompts(context: Ctx, project: str) -> schemas.PromptsFile:
    """The clicks and drawn fronts as the command line reads them."""
    return prompt_files.export(context, project)


@router.post("/prompts.json", operation_id="importPrompts")
def import_prompts(context: Ctx, project: str, body: schemas.PromptsFile) -> list[schemas.SceneObject]:
    """Add the objects of a prompts file; an object whose name is taken gets that file's points instead of its own."""
    return prompt_files.adopt(context, project, body)


@router.get("/live", operation_id="getLive")
def get_live(context: Ctx, project: str) -> schemas.LiveStatus:
    """Status of the live segmenter."""
    return masks.status(context, project)


@router.post("/live/open", operation_id="openLive")
def open_live(context: Ctx, project: str) -> schemas.LiveStatus:
    """Start preparing the live segmenter; it also starts by itself with the first click."""
    return masks.open_live(context, project)


@router.post("/objects/{object}/segment", operation_id="segmentObject", status_code=202)
def segment_object(context: Ctx, project: str, object: RowId) -> schemas.SceneObject:
    """Compute the object's masks now."""
    return prompts.segment(context, project, object)


@router.post("/objects/{object}/segment/cancel", operation_id="cancelSegment")
def cancel_segment(context: Ctx, project: str, object: RowId) -> schemas.SceneObject:
    """Stop computing the object's masks; those already there stay."""
    return prompts.cancel_segment(context, project, object)


@router.get("/lanes", operation_id="getLanes")
def get_lanes(context: Ctx, project: str) -> list[schemas.Lane]:
    """Frames with a mask of each object."""
    return masks.lanes(context, project)


@router.get("/openings", operation_id="getOpenings")
def get_openings(context: Ctx, project: str) -> list[schemas.Opening]:
    """Filmed motion of fronts: joint states by frame."""
    return openings.openings(context, project)


@router.get("/masks/{frame}", operation_id="getMasks", response_model=list[schemas.FrameMask])
def get_masks(context: Ctx, project: str, frame: FrameNumber) -> Response:
    """All objects' masks on one frame."""
    return as_json(masks.on_frame(context, project, frame))
