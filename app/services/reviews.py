"""Candidates with their evidence, what people say about them, and what they correct."""

import json
import re
import time
from collections.abc import AsyncIterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import anyio
from sqlmodel import Session, col, select

from app import schemas
from app.db import history, queries
from app.db.documents import overrides_entry
from app.db.engine import reading, writing
from app.db.tables import Project, SceneObject, Verdict
from app.errors import Conflict, NotFound, NotReady, TooLarge
from app.files import ProjectFiles, inside, require_free, safe_name
from app.jobs.plain import plain
from app.services import jobs
from app.services.context import Context
from app.services.prompts import tell_object
from r2c2r_core.errors import OverrideError, PromptError
from r2c2r_core.overrides import MOST_BATCHES
from r2c2r_core.workspace import Workspace

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
MAX_MESH_BYTES = 512 * 1024 * 1024


def groups(context: Context, project_id: str) -> list[schemas.CandidateGroup]:
    """Every object's candidates; objects without any are left out."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        found = [_group(context, session, project, item) for item in queries.live_objects(session, project_id)]
    return [group for group in found if group is not None]


def group(context: Context, project_id: str, object_id: int) -> schemas.CandidateGroup:
    """One object's candidates."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        found = _group(context, session, project, item)
    if found is None:
        raise NotReady(f"{item.name} has no candidates yet", hint="run the project first")
    return found


def give_verdict(context: Context, project_id: str, object_id: int, body: schemas.VerdictIn) -> schemas.Reviewed:
    """Accept, reject or clear one candidate; what follows from it runs again."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        _refuse_overtaken(context, session, project, item, body)
        facts = _candidate_facts(context.files(project), item.name)
        before = history.override_data(session, item)
        known = {c["candidate_id"] for c in facts["candidates"]} if facts else set()
        if body.candidate not in known | set(before.get("rejected", [])):
            raise NotFound(f"{item.name} has no candidate {body.candidate}", hint="the candidates may have been made anew")
        text = f"{body.verdict} {body.candidate} of {item.name}" + (f": {body.reason}" if body.reason else "")
        with history.change(session, item, "review", body.verdict, text, who=context.who):
            _store_verdict(session, item, body, context.who)
            history.set_override(session, item, _override_after(before, body, facts))
        changed = history.override_data(session, item) != before
        job = _rerun(context, session, project) if body.rerun and changed else None
    return _reviewed(context, project_id, object_id, job, text)


def get_override(context: Context, project_id: str, object_id: int) -> schemas.OverrideData:
    """What was corrected about the object."""
    with reading(context.engine) as session:
        item = queries.object_row(session, project_id, object_id)
        return _override_shape(history.override_data(session, item))


def set_override(context: Context, project_id: str, object_id: int, body: schemas.OverridePatch) -> schemas.Reviewed:
    """Correct the object; the fields that were sent are set, null clears."""
    wanted = {key: value for key, value in body.model_dump(exclude_unset=True).items() if key not in ("rerun", "version")}
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        _refuse_overtaken(context, session, project, item, body)
        before = history.override_data(session, item)
        merged = {key: value for key, value in {**before, **wanted}.items() if value is not None}
        _check_override(context, project, item, merged)
        said = ", ".join(f"{key} {'computed again' if value is None else value}" for key, value in wanted.items())
        text = f"{item.name}: {said or 'nothing'}"
        with history.change(session, item, "review", "correct", text, who=context.who):
            history.set_override(session, item, merged)
        job = _rerun(context, session, project) if body.rerun and merged != before else None
    return _reviewed(context, project_id, object_id, job, text)


async def upload(
    context: Context,
    project_id: str,
    object_id: int,
    filename: str,
    stream: AsyncIterator[bytes],
    rerun: bool,
    version: int | None = None,
) -> schemas.Reviewed:
    """A mesh that a person made, as the object's candidate."""
    suffix = Path(safe_name(filename)).suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise OverrideError(f"{filename!r} is not a mesh this app reads", hint=f"send one of {', '.join(MESH_SUFFIXES)}")
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
    require_free(context.settings.data_dir, 0, context.settings.min_free_bytes)
    stem = re.sub(r"[^A-Za-z0-9_]+", "_", Path(safe_name(filename)).stem)[:40] or "mesh"
    target = context.files(project).uploads / item.name / f"{stem}-{int(time.time())}{suffix}"
    await _receive(stream, target)
    patch = schemas.OverridePatch(candidate=str(target), rerun=rerun, version=version)
    return await anyio.to_thread.run_sync(set_override, context, project_id, object_id, patch)


def candidate_mesh(files: ProjectFiles, name: str, candidate: str) -> Any:
    """One candidate's noun; NotFound when the object has no such candidate."""
    found = Workspace(files.work).load_latest("generate", name)
    for asset in found.candidates if found else ():
        if asset.candidate_id == candidate:
            return asset
    raise NotFound(f"{name} has no candidate {candidate}", hint="the candidates may have been made anew")


def generate_key(files: ProjectFiles, name: str) -> str:
    """Changes whenever the object's candidates do."""
    path = files.work / "nouns" / "generate" / f"{name}.noun"
    return f"{path.stat().st_mtime_ns:x}" if path.is_file() else "0"


async def _receive(stream: AsyncIterator[bytes], target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    received = 0
    try:
        async with await anyio.open_file(target, "wb") as out:
            async for chunk in stream:
                received += len(chunk)
                if received > MAX_MESH_BYTES:
                    raise TooLarge(f"the mesh is larger than {MAX_MESH_BYTES / 1e6:.0f} MB", hint="simplify it first")
                await out.write(chunk)
        if received == 0:
            raise OverrideError("the upload is empty", hint="choose a mesh file")
    except BaseException:
        target.unlink(missing_ok=True)
        raise


def _refuse_overtaken(
    context: Context, session: Session, project: Project, item: SceneObject, body: schemas.VerdictIn | schemas.OverridePatch
) -> None:
    """Raise Conflict, with what is stored now, when somebody reviewed the object since the sender last looked."""
    if body.version is None or body.version == history.version_of(session, item, "review"):
        return
    shown = _group(context, session, project, item)
    last = history.stacks_of(session, project.id, item.id, "review").done[-1:]
    said = f": {last[0].who}, {last[0].text}" if last else ""
    raise Conflict(
        f"{item.name} was reviewed meanwhile{said}",
        hint="look at both, then keep yours or take theirs",
        current={
            "version": history.version_of(session, item, "review"),
            "override": history.override_data(session, item),
            "group": shown.model_dump() if shown else None,
            "yours": body.model_dump(exclude_unset=True, exclude={"rerun", "version"}),
        },
    )


def _store_verdict(session: Session, item: SceneObject, body: schemas.VerdictIn, who: str) -> None:
    for old in session.exec(select(Verdict).where(Verdict.object_id == item.id)):
        replaced = body.verdict == "accepted" and old.verdict == "accepted"  # one accepted candidate an object
        if old.candidate == body.candidate or replaced:
            session.delete(old)
    session.flush()
    if body.verdict != "cleared":
        said = Verdict(
            object_id=item.id or 0, candidate=body.candidate, verdict=body.verdict, reason=body.reason, who=who, at=time.time()
        )
        session.add(said)


def _override_after(before: dict[str, Any], body: schemas.VerdictIn, facts: dict[str, Any] | None) -> dict[str, Any]:
    """The corrections that a verdict means."""
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
    if body.verdict == "rejected" and known and known <= set(rejected):  # none is left to choose
        after["regenerate"] = min(before.get("regenerate", 0) + 1, MOST_BATCHES)
    return after


def _check_override(context: Context, project: Project, item: SceneObject, merged: dict[str, Any]) -> None:
    """Raise OverrideError for what the core would refuse."""
    from r2c2r_core.overrides import overrides_from

    files = context.files(project)
    if merged.get("joint_lower") is not None and merged.get("joint_upper") is None:
        raise OverrideError("a lower limit without an upper one", hint="give both")
    document = {"version": 1, "objects": {item.name: overrides_entry(merged)}}
    overrides_from(json.loads(json.dumps(document)), files.work / "overrides.json")
    wanted = merged.get("candidate")
    if wanted is None or (Path(wanted).is_relative_to(files.uploads) and inside(files.uploads, wanted).is_file()):
        return
    facts = _candidate_facts(files, item.name)
    if facts is None or wanted not in {c["candidate_id"] for c in facts["candidates"]}:
        raise OverrideError(f"{item.name} has no candidate '{wanted}'", hint="choose one of its candidates, or upload a mesh")


def _rerun(context: Context, session: Session, project: Project) -> int | None:
    try:
        return jobs.queue_run(context, session, project, schemas.RunRequest()).id
    except PromptError:
        return None


def _reviewed(context: Context, project_id: str, object_id: int, job_id: int | None, text: str) -> schemas.Reviewed:
    if job_id is not None:
        context.runner.wake()
        context.runner.tell(job_id)
    tell_object(context, project_id, object_id)
    context.hub.publish("review", project_id, object=object_id)
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        shown = _group(context, session, project, queries.object_row(session, project_id, object_id))
    return schemas.Reviewed(group=shown, job=jobs.get_job(context, job_id) if job_id is not None else None, text=text)


def _group(context: Context, session: Session, project: Project, item: SceneObject) -> schemas.CandidateGroup | None:
    files = context.files(project)
    facts = _candidate_facts(files, item.name)
    if facts is None:
        return None
    override = history.override_data(session, item)
    verdicts = {v.candidate: v for v in session.exec(select(Verdict).where(col(Verdict.object_id) == item.id))}
    accepted = next((v.candidate for v in verdicts.values() if v.verdict == "accepted"), None)
    stacks = history.stacks_of(session, project.id, item.id, "review")
    placement = _placement_facts(files, item.name)
    by_person: str | None = override.get("candidate")
    known = {c["candidate_id"] for c in facts["candidates"]}
    chosen: str = by_person if by_person is not None and by_person in known else facts["chosen_id"]
    if placement and by_person and chosen != by_person:
        chosen = placement["candidate_id"]  # an uploaded mesh: its id is known once it was placed
    address, version = f"/media/{project.id}/candidates/{item.id}", generate_key(files, item.name)
    return schemas.CandidateGroup(
        object=item.id or 0,
        name=item.name,
        category=item.category,
        chosen=chosen,
        chosen_by="person" if by_person else facts["chosen_by"],
        reason=f"chosen by {verdicts[accepted].who if accepted else 'a person'}" if by_person else facts["reason"],
        ranking=facts["ranking"],
        accepted=accepted,
        candidates=[_candidate(entry, verdicts.get(entry["candidate_id"]), address, version) for entry in facts["candidates"]],
        placement=_placement(placement) if placement else None,
        override=_override_shape(override),
        version=history.version_of(session, item, "review"),
        can_undo=bool(stacks.done),
        can_redo=bool(stacks.undone),
    )


def _candidate(entry: dict[str, Any], verdict: Verdict | None, address: str, version: str) -> schemas.Candidate:
    said: Any = verdict.verdict if verdict else None
    return schemas.Candidate(
        id=entry["candidate_id"],
        generator=entry["generator"],
        seed=entry["seed"],
        watertight=entry["watertight"],
        faces=entry["faces"],
        frames=entry["frames"],
        metrics={key: value for key, value in entry["metrics"].items() if value is not None},
        parameters={key: value for key, value in entry["parameters"].items() if value is not None},
        warnings=entry["warnings"],
        verdict=said,
        verdict_reason=verdict.reason if verdict else "",
        verdict_by=verdict.who if verdict else "",
        glb=f"{address}/{entry['candidate_id']}.glb?v={version}",
        thumbnail=f"{address}/{entry['candidate_id']}.png?v={version}",
    )


def _placement(facts: dict[str, Any]) -> schemas.Placement:
    similarity = facts["world_from_mesh"]
    names = ("matches", "inliers", "unsure", "runner_up", "runner_up_turn_deg", "method", "votes", "warnings")
    shown = {key: facts[key] for key in names}
    shown["spread"] = facts["spread"] and {key: facts["spread"][key] for key in ("turn_deg", "shift_m", "scale")}
    shown |= {key: facts[key] if facts[key] is not None else 0.0 for key in ("rms_m", "mask_iou", "condition")}
    shown |= {"candidate": facts["candidate_id"], "scale": similarity["scale"], "translation_m": similarity["translation"]}
    return schemas.Placement.model_validate(shown)


def _override_shape(data: dict[str, Any]) -> schemas.OverrideData:
    return schemas.OverrideData.model_validate(data)


def _candidate_facts(files: ProjectFiles, name: str) -> dict[str, Any] | None:
    """The candidates as JSON, without their meshes."""
    path = files.work / "nouns" / "generate" / f"{name}.noun"
    return _candidates_at(path, path.stat().st_mtime_ns, files.work, name) if path.is_file() else None


@lru_cache(maxsize=128)
def _candidates_at(path: Path, _changed: int, work: Path, name: str) -> dict[str, Any] | None:
    found = Workspace(work).load_latest("generate", name)
    if found is None:
        return None
    kept = ("candidate_id", "generator", "seed", "watertight", "frames", "metrics", "parameters", "warnings")
    candidates = [{**{key: plain(getattr(c, key)) for key in kept}, "faces": len(c.mesh.faces)} for c in found.candidates]
    about = {key: plain(getattr(found, key)) for key in ("chosen_id", "chosen_by", "reason", "ranking")}
    return {**about, "candidates": candidates}


def _placement_facts(files: ProjectFiles, name: str) -> dict[str, Any] | None:
    path = files.work / "nouns" / "align" / f"{name}.noun"
    return _placement_at(path, path.stat().st_mtime_ns, files.work, name) if path.is_file() else None


@lru_cache(maxsize=256)
def _placement_at(path: Path, _changed: int, work: Path, name: str) -> dict[str, Any] | None:
    found = Workspace(work).load_latest("align", name)
    return plain(found) if found is not None else None
