"""Filmed motion of leaves with manual marks, shown before a run."""

from collections.abc import Mapping
from typing import Any

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.files import ProjectFiles
from app.jobs.motion_wire import marked_line, motion_lines
from app.services import masks, views
from app.services.context import Context
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.scene import Joint, SceneObject
from r2c2r_core.synthesize.filmed import is_of
from r2c2r_core.synthesize.marked import Marks, marks_of, part_of, remarked

States = Mapping[str, Marks]
"""States of an object marked by users, by joint or its part."""


def openings(context: Context, project_id: str) -> list[schemas.Opening]:
    """Motion of the objects' leaves from completed masks and manual marks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id)
        corrected = queries.overrides_by_object(session, project_id)
    files = context.files(project)
    places = masks.Places.of(files)
    shown = []
    for item in items:
        found = masks.found_of(context, project, item, places)
        lines = found.masks.motions if found is not None and found.state == "done" else []
        said = states_said(corrected.get(item.id or 0, {}))
        told = [{key: line[key] for key in line if key in schemas.Opening.model_fields} for line in lines]  # less of old masks
        shown += [schemas.Opening(object=item.id or 0, **line) for line in _with_marks(files, item.result_name, told, said)]
    return shown


def states_said(override: Mapping[str, Any]) -> States:
    """Manually marked states of an object, from its stored corrections."""
    return {joint: {mark["frame"]: mark["state"] for mark in marks} for joint, marks in (override.get("states") or {}).items()}


def built(files: ProjectFiles, stage: str, name: str, said: States) -> SceneObject | None:
    """An object of a stage's newest scene, with joints updated by manual marks; None for an unknown name."""
    scene = views.latest(files, stage, "scene")
    item: SceneObject | None = next((one for one in scene.objects if one.name == name), None) if scene is not None else None
    if item is None:
        return None
    track = views.latest(files, "segment", name) if item.joints else None
    motions: tuple[JointMotion, ...] = track.motions if track is not None else ()
    return remarked(item, said, motions)


def opening_of(object_id: int, item: SceneObject, joint: Joint) -> schemas.Opening | None:
    """Filmed or marked motion of a joint; None without any."""
    if joint.motion is None:
        return None
    (line,) = motion_lines([joint.motion])
    return schemas.Opening(object=object_id, **{**line, "part": part_of(joint, item.name)})


def _with_marks(files: ProjectFiles, name: str, lines: list[dict[str, Any]], said: States) -> list[dict[str, Any]]:
    """The motions updated by the marks, with additional ones for marks without a motion."""
    item = built(files, "warp", name, said) if said else None
    if item is None:
        return lines
    by_part = {part_of(joint, name): marks_of(joint, name, said) for joint in item.joints}
    shown = []
    for line in lines:
        marks = {frame: value for part, mine in by_part.items() if is_of(line["part"], part) for frame, value in mine.items()}
        shown.append(marked_line(line, marks) if marks else line)
    alone = [part for part, marks in by_part.items() if marks and not any(is_of(line["part"], part) for line in lines)]
    return shown + motion_lines(j.motion for j in item.joints if j.motion is not None and part_of(j, name) in alone)
