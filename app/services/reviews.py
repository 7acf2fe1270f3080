"""Verdicts on candidates, and manual corrections."""

import json
import time
from pathlib import Path
from typing import Any

from sqlmodel import Session, select

from app import schemas
from app.db import history, queries
from app.db.engine import reading, writing
from app.db.keys import overrides_entry
from app.db.tables import Project, SceneObject, Verdict
from app.errors import Conflict, NotFound, NotReady
from app.files import inside
from app.services import jobs, prompts
from app.services.candidates import facts_of, groups_of, override_shape
from app.services.context import Context
from app.services.prompts import tell_object
from app.services.scenes import fitted
from r2c2r_core.errors import OverrideError, PromptError
from r2c2r_core.kitchen.names import named
from r2c2r_core.schema.overrides import MOST_BATCHES


def groups(context: Context, project_id: str) -> list[schemas.CandidateGroup]:
    """Every object's candidates; objects without any are left out."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        return groups_of(context, session, project, queries.live_objects(session, project_id))


def group(context: Context, project_id: str, object_id: int) -> schemas.CandidateGroup:
    """One object's candidates."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        found = groups_of(context, session, project, [item])
    if not found:
        raise NotReady(f"{item.name} has no candidates yet", hint="run the project first")
    return found[0]


def give_verdict(context: Context, project_id: str, object_id: int, body: schemas.VerdictIn) -> schemas.Reviewed:
    """Accept, reject or clear one candidate, and rerun dependent stages."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        refuse_overtaken(context, session, project, item, body)
        facts = facts_of(context.files(project), item.result_name)
        before = history.override_data(session, item)
        known = {c["candidate_id"] for c in facts["candidates"]} if facts else set()
        if body.candidate not in known | set(before.get("rejected", [])):
            raise NotFound(f"{item.name} has no candidate {body.candidate}", hint="the candidates may have been made again")
        text = f"{body.verdict} {body.candidate} of {item.name}" + (f": {body.reason}" if body.reason else "")
        with history.change(session, item, "review", body.verdict, text, who=context.who):
            _store_verdict(session, item, body, context.who)
            history.set_override(session, item, _override_after(before, body, facts))
        changed = history.override_data(session, item) != before
        job = _rerun(context, session, project, item) if body.rerun and changed else None
    return reviewed_shape(context, project_id, object_id, job, text)


def get_override(context: Context, project_id: str, object_id: int) -> schemas.OverrideData:
    """The object's corrections."""
    with reading(context.engine) as session:
        item = queries.object_row(session, project_id, object_id)
        return override_shape(history.override_data(session, item))


def set_override(context: Context, project_id: str, object_id: int, body: schemas.OverridePatch) -> schemas.Reviewed:
    """Correct the object; given fields are set, null clears."""
    job, text = store_override(context, project_id, object_id, body)
    return reviewed_shape(context, project_id, object_id, job, text)


def store_override(context: Context, project_id: str, object_id: int, body: schemas.OverridePatch) -> tuple[int | None, str]:
    """Store the correction; returns the resulting job, and a description."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        return _store_override(context, session, project, item, body)


def _store_override(
    context: Context, session: Session, project: Project, item: SceneObject, body: schemas.OverridePatch
) -> tuple[int | None, str]:
    wanted = {key: value for key, value in body.model_dump(exclude_unset=True).items() if key not in ("rerun", "version")}
    refuse_overtaken(context, session, project, item, body)
    before = history.override_data(session, item)
    merged = {key: value for key, value in {**before, **wanted}.items() if value is not None}
    _check_override(context, project, item, merged)
    said = ", ".join(_in_words(key, value) for key, value in wanted.items())
    text = f"{item.name}: {said or 'nothing'}"
    with history.change(session, item, "review", "correct", text, who=context.who):
        history.set_override(session, item, merged)
    return _rerun(context, session, project, item) if body.rerun and merged != before else None, text


def correct_made(context: Context, project_id: str, name: str, body: schemas.OverridePatch) -> schemas.Reviewed:
    """Correct an unprompted object of the last run, which thereby becomes an ordinary object."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        known = {item.result_name: item.id for item in queries.live_objects(session, project_id)}
        if name in known:
            item = queries.object_row(session, project_id, known[name] or 0)
        else:
            category = _category_made(context, project, name)
            item = prompts.create_in(context, session, project, schemas.ObjectIn(name=name, category=category), "added")
        object_id = item.id or 0
        job, text = _store_override(context, session, project, item, body)
    return reviewed_shape(context, project_id, object_id, job, text)


def _category_made(context: Context, project: Project, name: str) -> str:
    """Category of an object of the last run; NotFound for an unknown name."""
    scene = fitted(context.files(project)) or {"objects": []}
    category: str | None = next((item["category"] for item in scene["objects"] if item["name"] == name), None)
    if category is None:
        raise NotFound(f"the scene has no {name[:60]}", hint="it may have been renamed since the last run")
    return category


def refuse_overtaken(
    context: Context,
    session: Session,
    project: Project,
    item: SceneObject,
    body: schemas.VerdictIn | schemas.OverridePatch | schemas.UndoRequest,
) -> None:
    """Raise Conflict, with the stored state, if the object was reviewed since the sender's version."""
    if body.version is None or body.version == history.version_of(session, item, "review"):
        return
    shown = groups_of(context, session, project, [item])
    last = history.last_done(session, item, "review")
    said = f": {last.who}, {last.text}" if last else ""
    raise Conflict(
        f"{item.name} was reviewed meanwhile{said}",
        hint="look at both, then keep yours or take theirs",
        current={
            "version": history.version_of(session, item, "review"),
            "override": override_shape(history.override_data(session, item)).model_dump(),
            "group": shown[0].model_dump() if shown else None,
            "yours": body.model_dump(exclude_unset=True, exclude={"rerun", "version"}),
        },
    )


def _store_verdict(session: Session, item: SceneObject, body: schemas.VerdictIn, who: str) -> None:
    for old in session.exec(select(Verdict).where(Verdict.object_id == item.id)):
        replaced = body.verdict == "accepted" and old.verdict == "accepted"  # at most one accepted candidate per object
        if old.candidate == body.candidate or replaced:
            session.delete(old)
    session.flush()
    if body.verdict != "cleared":
        said = Verdict(
            object_id=item.id or 0, candidate=body.candidate, verdict=body.verdict, reason=body.reason, who=who, at=time.time()
        )
        session.add(said)


def _override_after(before: dict[str, Any], body: schemas.VerdictIn, facts: dict[str, Any] | None) -> dict[str, Any]:
    """The corrections implied by a verdict."""
    after = dict(before)
    rejected = [name for name in before.get("rejected", []) if name != body.candidate]
    if body.verdict == "rejected":
        rejected.append(body.candidate)
    if before.get("candidate") == body.candidate and body.verdict != "accepted":
        after.pop("candidate", None)
    if body.verdict == "accepted" and (before.get("candidate") or (facts or {}).get("chosen_id")) != body.candidate:
        after["candidate"] = body.candidate
    after["rejected"] = rejected
    if not rejected:
        after.pop("rejected")
    known = {candidate["candidate_id"] for candidate in (facts or {}).get("candidates", [])}
    if body.verdict == "rejected" and known and known <= set(rejected):  # no candidate is left
        after["regenerate"] = min(before.get("regenerate", 0) + 1, MOST_BATCHES)
    return after


def _check_override(context: Context, project: Project, item: SceneObject, merged: dict[str, Any]) -> None:
    """Raise OverrideError for corrections that the core would refuse."""
    from r2c2r_core.overrides import overrides_from

    files = context.files(project)
    document = {"version": 1, "objects": {item.name: overrides_entry(merged)}}
    overrides_from(json.loads(json.dumps(document)), files.work / "overrides.json")
    if (template := merged.get("built_as")) is not None and (notice := named(template).notice) is not None:
        raise OverrideError(notice, hint="give a category of the table")
    wanted = merged.get("candidate")
    if wanted is None or (Path(wanted).is_relative_to(files.uploads) and inside(files.uploads, wanted).is_file()):
        return
    facts = facts_of(files, item.result_name)
    if facts is None or wanted not in {c["candidate_id"] for c in facts["candidates"]}:
        raise OverrideError(f"{item.name} has no candidate '{wanted}'", hint="choose one of its candidates, or upload a mesh")


def _rerun(context: Context, session: Session, project: Project, item: SceneObject) -> int | None:
    """Queue the run for a correction of an object; None without prompts."""
    try:
        return jobs.queue_run(context, session, project, schemas.RunRequest(), (item.id or 0,)).id
    except PromptError:
        return None


_WORDS = {
    "pose": "place",
    "dimensions_m": "size",
    "joint_lower": "opens from",
    "joint_upper": "opens to",
    "left_out": "left out",
    "built_as": "built as",
    "states": "openings marked",
}


def _in_words(key: str, value: Any) -> str:
    """Description of one correction for the history and the user."""
    name = _WORDS.get(key, key)
    if key == "left_out":
        return name if value else "brought back"
    if value is None:
        return f"{name} computed again"
    if key == "candidate":
        return f"{name} {Path(value).name}"  # an uploaded mesh's name, not its path
    if key == "pose":
        return f"{name} ({', '.join(f'{row[3]:.3f}' for row in value[:3])}) m"
    if key == "dimensions_m":
        return f"{name} {' × '.join(f'{100 * side:.1f}' for side in value)} cm"
    if key == "states":
        frames = sum(len(marks) for marks in value.values())
        return f"{name} in {frames} frame{'' if frames == 1 else 's'}"
    if key == "joints":
        return f"limits of {', '.join(value)}" if value else "limits computed again"
    if key.startswith("joint_"):
        return f"{name} {value:.3f}"  # radians or metres
    return f"{name} {value}"


def reviewed_shape(context: Context, project_id: str, object_id: int, job_id: int | None, text: str) -> schemas.Reviewed:
    """Follow-up of a stored review: start its job, publish to all tabs, and return the object's current state."""
    if job_id is not None:
        context.runner.queued(job_id)
    tell_object(context, project_id, object_id)
    context.hub.publish("review", project_id, object=object_id)
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        shown = groups_of(context, session, project, [queries.object_row(session, project_id, object_id)])
    return schemas.Reviewed(
        group=shown[0] if shown else None, job=jobs.get_job(context, job_id) if job_id is not None else None, text=text
    )
