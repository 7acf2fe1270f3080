"""Masks that follow from the clicks: live ones while annotating, else those of the last run."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from sqlmodel import Session, select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import Point, Project, SceneObject
from app.errors import NotReady
from app.files import ProjectFiles
from app.jobs import mask_store
from app.jobs.mask_store import MaskFile, mask_path, prompt_key
from app.jobs.mask_wire import mask_bits
from app.services.context import Context
from r2c2r_core.errors import PromptError
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.workspace import Workspace


def status(context: Context, project_id: str) -> schemas.LiveStatus:
    """Whether masks can be drawn at once."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
    return context.live.status(project_id)


def open_live(context: Context, project_id: str) -> schemas.LiveStatus:
    """Start preparing the live segmenter."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
    if project.status != "ready":
        raise NotReady("the recording has not been read yet", hint="wait for the import")
    context.live.open(project_id, context.files(project), project.segmenter)
    return context.live.status(project_id)


def segment(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Compute the object's masks now, also when there are some for these clicks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        points = queries.points_of(session, object_id)
    if not any(point.label for point in points):
        raise PromptError(f"{item.name} has no click on it", hint="click on the object first")
    _start(context, project, item, points)
    return _told(context, project_id, object_id)


def cancel(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Stop computing the object's masks."""
    with reading(context.engine) as session:
        queries.object_row(session, project_id, object_id)
    context.live.cancel(project_id, object_id)
    return _told(context, project_id, object_id)


def follow(context: Context, project_id: str, object_id: int) -> None:
    """Compute the masks of changed clicks, unless they are already there (after an undo, say) or nothing is clicked."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id, deleted=True)
        points = queries.points_of(session, object_id)
    state, _, _ = state_of(context, project, item, points)
    if item.deleted or not any(point.label for point in points):
        context.live.cancel(project_id, object_id)
    elif state == "done" and _found(context, project, item, points) is not None:
        files, key = context.files(project), _key(project, item, points)
        found = mask_store.read(mask_path(files.masks, object_id, key))
        if found is None or found.end != "done":  # the run's masks: nothing to show anew
            return
        counts = {"done": len(found.frames), "total": len(found.frames)}
        context.live.cancel(project_id, object_id)
        context.hub.publish("segment", project_id, object=object_id, state="done", error=None, restart=True, **counts)
        for entry in found.frames.values():
            shown = {"frame": entry["frame"], "confidence": entry["confidence"], "mask": entry["mask"]}
            context.hub.publish("mask", project_id, object=object_id, **counts, **shown)
    elif project.status == "ready":
        _start(context, project, item, points)


def resume(context: Context) -> None:
    """Go on with masks that were being computed when the server went away."""
    with reading(context.engine) as session:
        projects = [row for row in session.exec(select(Project)) if row.status == "ready"]
        wanted = [(row, item, points) for row in projects for item, points in _prompted(session, row.id)]
    for project, item, points in wanted:
        stored = mask_store.read(mask_path(context.files(project).masks, item.id or 0, _key(project, item, points)))
        if stored is not None and stored.end is None:
            _start(context, project, item, points)


def state_of(
    context: Context, project: Project, item: SceneObject, points: list[Point]
) -> tuple[schemas.SegmentState, int, list[str]]:
    """How far the object's masks are, on how many frames it is seen, and what went wrong."""
    if not any(point.label for point in points):
        return "none", 0, []
    found = _found(context, project, item, points)
    if found is None:
        return "none", 0, []
    state, masks, _ = found
    notices = [f"{masks.error['message']}; {masks.error['hint']}".rstrip("; ")] if masks.error else []
    return state, len(masks.frames), notices


def frames_of(context: Context, project: Project, item: SceneObject, points: list[Point]) -> list[dict[str, Any]]:
    """The object's masks, by frame, with their confidence; none while there are none."""
    found = _found(context, project, item, points)
    return list(found[1].frames.values()) if found is not None else []


def lanes(context: Context, project_id: str) -> list[schemas.Lane]:
    """Where each object is seen."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        found = [(item, _found(context, project, item, points)) for item, points in _prompted(session, project_id)]
    return [_lane(item, masks) for item, masks in found]


def on_frame(context: Context, project_id: str, frame: int) -> list[schemas.FrameMask]:
    """All objects' masks on one frame."""
    shown = []
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        for item, points in _prompted(session, project_id):
            found = _found(context, project, item, points)
            if found is None or frame not in found[1].frames:
                continue
            entry = found[1].frames[frame]
            mask = schemas.MaskBits(**entry["mask"])
            source: Any = found[2]
            shown.append(
                schemas.FrameMask(object=item.id or 0, frame=frame, confidence=entry["confidence"], source=source, mask=mask)
            )
    return shown


def _start(context: Context, project: Project, item: SceneObject, points: list[Point]) -> None:
    prompt = {"name": item.name, "category": item.category, "points": [_click(point) for point in points]}
    key = _key(project, item, points)
    context.live.segment(project.id, context.files(project), project.segmenter, item.id or 0, key, prompt)


def _told(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    from app.services.prompts import tell_object  # the two know each other: clicks bring masks, masks show objects

    return tell_object(context, project_id, object_id)


def _prompted(session: Session, project_id: str) -> list[tuple[SceneObject, list[Point]]]:
    return [(item, queries.points_of(session, item.id)) for item in queries.live_objects(session, project_id)]


def _found(
    context: Context, project: Project, item: SceneObject, points: list[Point]
) -> tuple[schemas.SegmentState, MaskFile, str] | None:
    """The masks that belong to these clicks, how far they are, and where they come from."""
    number, key, files = item.id or 0, _key(project, item, points), context.files(project)
    live = context.live.task(project.id, number, key)
    if live is not None:
        return (*live, "live")
    path = mask_path(files.masks, number, key)
    stored = _stored(path)
    if stored is not None and stored.end == "done":
        return "done", stored, "live"
    run = _run_masks(files, item, points, project.segmenter, context.settings.preview_width)
    if run is not None:
        return "done", run, "run"
    if stored is None:
        return None
    return ("failed" if stored.end == "failed" else "partial"), stored, "live"


def _lane(item: SceneObject, found: tuple[schemas.SegmentState, MaskFile, str] | None) -> schemas.Lane:
    if found is None:
        return schemas.Lane(object=item.id or 0, state="none", source="none", complete=False, frames=[])
    state, masks, source = found
    entries = sorted(masks.frames.values(), key=lambda entry: int(entry["frame"]))
    frames = [schemas.LaneEntry(frame=e["frame"], area=e["area"], confidence=e["confidence"]) for e in entries]
    where: Any = source
    return schemas.Lane(object=item.id or 0, state=state, source=where, complete=state == "done", frames=frames)


def _run_masks(files: ProjectFiles, item: SceneObject, points: list[Point], segmenter: str, width: int) -> MaskFile | None:
    """The last run's masks, when it ran with these clicks and this segmenter."""
    path = files.work / "nouns" / "segment" / f"{item.name}.noun"
    prompts = files.finished_prompts
    if not (path.is_file() and prompts.is_file()):
        return None
    for entry in _prompts_at(prompts, prompts.stat().st_mtime_ns):
        if entry["name"] == item.name and entry["category"] == item.category and entry["points"] == [_click(p) for p in points]:
            backend, found = _track_at(path, path.stat().st_mtime_ns, files.work, item.name, width)
            return found if backend == segmenter else None
    return None


@lru_cache(maxsize=64)
def _track_at(path: Path, _changed: int, work: Path, name: str, width: int) -> tuple[str, MaskFile | None]:
    track: MaskTrack | None = Workspace(work).load_latest("segment", name)
    if track is None:
        return "", None
    found = MaskFile(end="done")
    for frame, packed in track.masks.items():
        area = packed.area_px / max(packed.width * packed.height, 1)
        entry = {"frame": frame, "confidence": track.confidence[frame], "area": area, "mask": mask_bits(packed, width)}
        found.frames[frame] = entry
    return track.backend, found


@lru_cache(maxsize=16)
def _prompts_at(path: Path, _changed: int) -> list[dict[str, Any]]:
    objects: list[dict[str, Any]] = json.loads(path.read_text())["objects"]
    return objects


def _stored(path: Path) -> MaskFile | None:
    try:
        return _stored_at(path, path.stat().st_mtime_ns)
    except FileNotFoundError:
        return None


@lru_cache(maxsize=128)
def _stored_at(path: Path, _changed: int) -> MaskFile | None:
    return mask_store.read(path)


def _key(project: Project, item: SceneObject, points: list[Point]) -> str:
    return prompt_key(item.category, [(p.frame, p.x, p.y, p.label) for p in points], project.segmenter)


def _click(point: Point) -> dict[str, Any]:
    return {"frame": point.frame, "x": point.x, "y": point.y, "label": point.label}
