"""Masks of the current clicks: live ones during annotation, else those of the last run."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from sqlmodel import col, select

from app import schemas
from app.db import queries
from app.db.documents import prompt_entry
from app.db.engine import reading
from app.db.keys import masks_key
from app.db.queries import Drawn, DrawnIn
from app.db.tables import Project, SceneObject
from app.errors import NotReady
from app.file_cache import FileCache
from app.files import ProjectFiles, project_files
from app.jobs import mask_store
from app.jobs.disputes import others_line
from app.jobs.front_wire import front_line
from app.jobs.mask_store import Entry, Masks, StoredMasks, mask_file, mask_path
from app.jobs.mask_wire import mask_bits
from app.jobs.motion_wire import motion_lines
from app.services.context import Context
from r2c2r_core.errors import PromptError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.workspace import Workspace, noun_path

_INDEX_BYTES = 64 << 20  # of mask indices: 3000 objects of 500 frames
_STORED: FileCache[StoredMasks | None] = FileCache(_INDEX_BYTES)
_FINISHED: FileCache[dict[str, str]] = FileCache(1 << 20)


FrameMask = dict[str, Any]  # schemas.FrameMask, sent as stored, since hundreds are shown at once


class Places(NamedTuple):
    """Locations of a project's masks."""

    files: ProjectFiles
    masks: str  # the folder of live ones, as text

    @classmethod
    def of(cls, files: ProjectFiles) -> "Places":
        """Mask locations in a project's files."""
        return cls(files, str(files.masks))


class Found(NamedTuple):
    """Masks of an object's current clicks, with state and source."""

    state: schemas.SegmentState
    masks: Masks
    source: str  # live | run


def status(context: Context, project_id: str) -> schemas.LiveStatus:
    """Status of the live segmenter."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
    return context.live.status(project_id)


def open_live(context: Context, project_id: str) -> schemas.LiveStatus:
    """Start preparing the live segmenter, and compute missing masks, e.g. of imported clicks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id)
        clicks = queries.clicks_by_object(session, project_id)
    if project.status != "ready":
        raise NotReady("the recording has not been read yet", hint="wait for the import")
    places = Places.of(context.files(project))
    tell_objects(context, project, starts=True)
    missing = [item for item in items if item.masks_key and _is_missing(found_of(context, project, item, places))]
    for item in reversed(missing):  # the last request is computed first
        _start(context, project, item, clicks.get(item.id or 0, []), tells=item is missing[0])
        context.live.on_object(project_id, item.id or 0)
    return context.live.status(project_id)


def prepare(context: Context, project_id: str) -> None:
    """Prepare a newly read recording, to avoid waiting in Annotate; one project at a time."""
    if not context.live.preparing:
        open_live(context, project_id)


def segment(context: Context, project_id: str, object_id: int) -> None:
    """Compute the object's masks now, even if they exist for these clicks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        clicks = queries.clicks_of(session, object_id)
    if not item.masks_key:
        raise PromptError(f"{item.name} has no click on it", hint="click on the object first, or draw its front")
    _start(context, project, item, clicks, tells=True)


def cancel(context: Context, project_id: str, object_id: int) -> None:
    """Stop computing the object's masks."""
    with reading(context.engine) as session:
        queries.object_row(session, project_id, object_id)
    context.live.cancel(project_id, object_id)


def segment_again(context: Context, project_id: str, object_id: int, key: str) -> bool:
    """Recompute the object's masks for these clicks; False, without effect, if its clicks have changed."""
    with reading(context.engine) as session:
        item = queries.object_row(session, project_id, object_id)
    if item.masks_key != key:
        return False
    segment(context, project_id, object_id)
    return True


def tell_objects(context: Context, project: Project, *, starts: bool = False) -> None:
    """Send the current clicks to the live segmenter, as a click on one object may split another's front, or reunite it.

    The segmenter is started if `starts` is set, or if masks depend on deleted clicks.
    """
    with context.live.telling:
        objects = _objects(context, project)
        if project.status == "ready" and (starts or _miss_clicks(objects)):
            context.live.open(project.id, context.files(project), project.segmenter)
        context.live.know(project.id, objects)


def follow(context: Context, project_id: str, object_id: int, *, tells: bool = True) -> None:
    """Compute the masks of changed clicks, unless they exist (e.g. after an undo) or there are no clicks.

    Without `tells`, the project's objects are not sent, as a further call that follows at once sends them.
    """
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id, deleted=True)
        clicks = queries.clicks_of(session, object_id)
    found = found_of(context, project, item)
    wanted, done = bool(item.masks_key) and not item.deleted, found is not None and found.state == "done"
    if wanted and not done and project.status == "ready":
        _start(context, project, item, clicks, tells=tells)
        return
    if not wanted:
        context.live.cancel(project_id, object_id)
    elif found is not None and done and found.source == "live":  # a run's masks are shown anyway
        context.live.cancel(project_id, object_id)
        _show(context, project_id, object_id, found.masks)
    if tells:
        tell_objects(context, project, starts=wanted)


def resume(context: Context) -> None:
    """Resume masks that were being computed when the server stopped."""
    with reading(context.engine) as session:
        drawn = select(Project.id, Project.work_path, SceneObject.id, SceneObject.masks_key).join(SceneObject)
        drawn = drawn.where(Project.status == "ready", col(SceneObject.deleted).is_(False), SceneObject.masks_key != "")
        wanted = session.exec(drawn).all()
    for project_id, work, number, key in wanted:
        files = project_files(context.settings.data_dir, project_id, work)
        stored = mask_store.read(mask_path(files.masks, number or 0, key))
        if stored is not None and stored.end is None:
            segment(context, project_id, number or 0)


class MasksState(NamedTuple):
    """State of the object's masks: progress, frames, errors, doubts, certainty and suggested category of its front."""

    state: schemas.SegmentState
    frames: int = 0
    notices: Sequence[str] = ()
    doubts: Sequence[str] = ()
    certainty: float | None = None
    suggested: str = ""


def state_of(context: Context, project: Project, item: SceneObject, places: Places | None = None) -> MasksState:
    """State of the object's masks."""
    found = found_of(context, project, item, places)
    if found is None:
        return MasksState("none")
    error = found.masks.error
    notices = [f"{error['message']}; {error['hint']}".rstrip("; ")] if error else []
    front = found.masks.front or {}
    certainty, suggested = front.get("certainty"), front.get("suggested", "")  # files of older versions have none
    return MasksState(found.state, len(found.masks), notices, found.masks.doubts, certainty, suggested)


def state_after_follow(context: Context, project: Project, item: SceneObject) -> MasksState:
    """`state_of` as it will be after `follow`."""
    found = found_of(context, project, item)
    done = found is not None and found.state == "done"
    if item.masks_key and not item.deleted and not done and project.status == "ready":
        return MasksState("waiting")
    return state_of(context, project, item)


def lanes(context: Context, project_id: str) -> list[schemas.Lane]:
    """Frames with masks of each object."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id)
    places = Places.of(context.files(project))
    return [_lane(item, found_of(context, project, item, places)) for item in items]


def on_frame(context: Context, project_id: str, frame: int) -> list[FrameMask]:
    """All objects' masks on one frame."""
    return on_frames(context, project_id, {frame})[frame]


def on_frames(context: Context, project_id: str, frames: set[int]) -> dict[int, list[FrameMask]]:
    """All objects' masks, by frame."""
    with reading(context.engine) as session:
        project = queries.drawn_in(session, project_id)
        items = queries.drawn(session, project_id)
    shown: dict[int, list[FrameMask]] = {frame: [] for frame in frames}
    places = Places.of(context.files(project))
    for item in items:
        found = found_of(context, project, item, places)
        for frame in frames if found else ():
            if found and (entry := found.masks.entry(frame)) is not None:
                shown[frame].append(_frame_mask(item.id, found, entry))
    return shown


def found_of(
    context: Context, project: Project | DrawnIn, item: SceneObject | Drawn, places: Places | None = None
) -> Found | None:
    """Masks of the object's current clicks, or None. `places` avoids repeated path lookups."""
    number, key, places = item.id or 0, item.masks_key, places or Places.of(context.files(project))
    if not key:
        return None
    live = context.live.task(project.id, number, key)
    if live is not None:
        return Found(*live, "live")
    stored = _stored(mask_file(places.masks, number, key))
    if stored is not None and stored.end == "done":
        return Found("done", stored, "live")
    run = _run_masks(places.files, item, project.segmenter, context.settings.preview_width)
    if run is not None:
        return Found("done", run, "run")
    if stored is None:
        return None
    return Found("failed" if stored.end == "failed" else "partial", stored, "live")


def front_of(context: Context, project: Project, item: SceneObject, places: Places) -> dict[str, Any] | None:
    """The object's flat front from its masks, else from the last run with the same clicks."""
    found = found_of(context, project, item, places)
    if found is None or found.masks.front is not None or found.source == "run":
        return found.masks.front if found is not None else None
    run = _run_masks(places.files, item, project.segmenter, context.settings.preview_width)
    return run.front if run is not None else None


def _is_missing(found: Found | None) -> bool:
    """Whether masks were never requested, are of an older version, or incomplete after a crash."""
    if found is None or found.masks.end == mask_store.OUTDATED:
        return True
    return found.state == "partial" and found.masks.end is None


def _frame_mask(number: int, found: Found, entry: Entry) -> FrameMask:
    shown = {"object": number, "frame": entry["frame"], "confidence": entry["confidence"]}
    return shown | {"source": found.source, "mask": entry["mask"]}


def _start(context: Context, project: Project, item: SceneObject, clicks: list[queries.Click], *, tells: bool) -> None:
    prompt, files = prompt_entry(item, clicks), context.files(project)
    with context.live.telling:
        objects = _objects(context, project) if tells else None
        context.live.segment(project.id, files, project.segmenter, item.id or 0, item.masks_key, prompt, objects)


def _show(context: Context, project_id: str, object_id: int, masks: Masks) -> None:
    """Publish existing masks to all tabs."""
    counts = {"done": len(masks), "total": len(masks)}
    context.hub.publish("segment", project_id, object=object_id, state="done", error=None, restart=True, **counts)
    for frame in masks.seen()[:, 0].astype(int).tolist():
        if (entry := masks.entry(frame)) is not None:
            shown = {"frame": entry["frame"], "confidence": entry["confidence"], "mask": entry["mask"]}
            context.hub.publish("mask", project_id, object=object_id, **counts, **shown)


def _objects(context: Context, project: Project) -> list[dict[str, Any]]:
    """The project's objects in the format of app.jobs.disputes: prompts, and other clicks used for finished masks."""
    with reading(context.engine) as session:
        items = [item for item in queries.live_objects(session, project.id) if item.masks_key]
        clicks = queries.clicks_by_object(session, project.id)
    places = Places.of(context.files(project))
    return [_object_line(context, project, item, clicks.get(item.id or 0, []), places) for item in items]


def _object_line(
    context: Context, project: Project, item: SceneObject, clicks: list[queries.Click], places: Places
) -> dict[str, Any]:
    found = found_of(context, project, item, places)
    prompt = prompt_entry(item, clicks)
    prompt.pop("frames", None)  # large, and irrelevant for other objects
    others = found.masks.others if found is not None and found.state == "done" else None
    return {"object": item.id, "key": item.masks_key, "prompt": prompt, "others": others}


def _miss_clicks(objects: list[dict[str, Any]]) -> bool:
    """Whether masks depend on other objects' clicks that no longer exist."""
    there = {(point["frame"], point["x"], point["y"]) for line in objects for point in line["prompt"]["points"]}
    return any(tuple(click) not in there for line in objects for click in line["others"] or ())


def _lane(item: SceneObject, found: Found | None) -> schemas.Lane:
    if found is None:
        return schemas.Lane(object=item.id or 0, state="none", source="none", complete=False, frames=[], confidences=[])
    seen = found.masks.seen()
    return schemas.Lane(
        object=item.id or 0,
        state=found.state,
        source=found.source,  # type: ignore[arg-type]  # "live" or "run"
        complete=found.state == "done",
        frames=seen[:, 0].astype(int).tolist(),
        confidences=(
            np.floor(seen[:, 1] * 100 + 1e-9) / 100
        ).tolist(),  # a lane shows no more digits; rounded down, so that doubtful frames stay doubtful
    )


def _run_masks(files: ProjectFiles, item: SceneObject | Drawn, segmenter: str, width: int) -> StoredMasks | None:
    """The last run's masks if it used these clicks and this segmenter, converted for the browser once."""
    if _finished_key(files, segmenter, item.result_name) != item.masks_key:
        return None
    noun = noun_path(files.work, "segment", item.result_name)
    if not noun.is_file():
        return None
    kept = files.previews / "masks" / f"{item.result_name}-{noun.stat().st_mtime_ns:x}.jsonl"
    found = _stored(kept)
    if found is None or found.end != "done":
        track: MaskTrack | None = Workspace(files.work).load_latest("segment", item.result_name)
        if track is None:
            return None
        for older in kept.parent.glob(f"{item.result_name}-*.jsonl"):
            older.unlink(missing_ok=True)
        front = front_line(track.front, track.category, _world_from_capture(files)) if track.front is not None else None
        others, motions = _run_others(files, item.result_name), motion_lines(track.motions)
        mask_store.write(kept, _entries(track, width), track.backend, front, others, motions)
        found = _stored(kept)
    return found if found is not None and found.backend == segmenter else None


def _run_others(files: ProjectFiles, name: str) -> mask_store.Others:
    """Other objects' clicks used by the last run for the object."""
    from r2c2r_core.pipeline import DISPUTED  # imports all stages: not at server start

    disputed: dict[str, tuple[PromptPoint, ...]] = Workspace(files.work).load_latest("segment", DISPUTED) or {}
    return others_line(disputed.get(name, ()))


def _world_from_capture(files: ProjectFiles) -> Rigid3:
    capture: Capture | None = Workspace(files.work).load_latest("ingest", "scene")
    return capture.world_from_capture if capture is not None else Rigid3()


def _entries(track: MaskTrack, width: int) -> list[Entry]:
    """A run's masks in the format of live ones."""
    return [
        {
            "frame": frame,
            "confidence": track.confidence[frame],
            "area": packed.area_px / max(packed.width * packed.height, 1),
            "mask": mask_bits(packed, width),
        }
        for frame, packed in track.masks.items()
    ]


def _finished_key(files: ProjectFiles, segmenter: str, name: str) -> str | None:
    """Key of the last run's masks of the object, assuming that segmenter."""
    path = files.finished_prompts
    keys = _FINISHED.get(path, lambda: _keys_in(path, segmenter), lambda keys, _: 100 * len(keys), about=segmenter)
    return keys.get(name) if keys is not None else None


def _keys_in(path: Path, segmenter: str) -> dict[str, str]:
    objects: list[dict[str, Any]] = json.loads(path.read_text())["objects"]
    clicks = {entry["name"]: [_click(point) for point in entry["points"]] for entry in objects}
    return {entry["name"]: masks_key(segmenter, entry["category"], clicks[entry["name"]], entry) for entry in objects}


def _click(point: dict[str, Any]) -> tuple[int, float, float, int]:
    return int(point["frame"]), float(point["x"]), float(point["y"]), int(point["label"])


def _stored(path: Path | str) -> StoredMasks | None:
    return _STORED.get(path, lambda: mask_store.read(path), lambda found, _: found.bytes if found else 0)
