"""Candidates of each object with evidence, choice and user verdicts."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sqlmodel import Session, col, select

from app import schemas
from app.db import history, queries
from app.db.tables import Project, SceneObject, Verdict
from app.errors import NotFound
from app.file_cache import FileCache
from app.files import ProjectFiles
from app.jobs.plain import plain
from app.services import views
from app.services.context import Context
from app.services.views import KeptFacts
from r2c2r_core.errors import GenerationFailed
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.schema.overrides import MOST_BATCHES
from r2c2r_core.workspace import noun_path


class _Said(NamedTuple):
    """User corrections and verdicts, by object."""

    overrides: dict[int, dict[str, Any]]
    verdicts: dict[int, dict[str, Verdict]]  # by candidate
    steps: dict[int | None, history.Steps]
    versions: dict[int | None, int]


def groups_of(
    context: Context, session: Session, project: Project, items: Sequence[SceneObject]
) -> list[schemas.CandidateGroup]:
    """The candidates of objects; those without any are left out."""
    of = items[0].id if len(items) == 1 else None
    verdicts: dict[int, dict[str, Verdict]] = {}
    for verdict in session.exec(select(Verdict).where(col(Verdict.object_id).in_([item.id for item in items]))):
        verdicts.setdefault(verdict.object_id, {})[verdict.candidate] = verdict
    said = _Said(
        overrides=queries.overrides_by_object(session, project.id),
        verdicts=verdicts,
        steps=history.steps(session, project.id, "review", of),
        versions=history.versions(session, project.id, "review", of),
    )
    files = context.files(project)
    kept = KeptFacts(files)
    groups = [group for item in items if (group := _group(files, kept, project, item, said)) is not None]
    kept.keep()
    return groups


def _group(
    files: ProjectFiles, kept: KeptFacts, project: Project, item: SceneObject, said: _Said
) -> schemas.CandidateGroup | None:
    facts = kept.of("generate", item.result_name, _candidate_facts)
    if facts is None:
        return None
    override, verdicts = said.overrides.get(item.id or 0, {}), said.verdicts.get(item.id or 0, {})
    if override.get("rejected"):
        facts = facts | _choice_without(files, item.result_name, tuple(override["rejected"]))
    accepted = next((v.candidate for v in verdicts.values() if v.verdict == "accepted"), None)
    steps = said.steps.get(item.id, history.Steps())
    placement = kept.of("align", item.result_name, plain)
    by_person: str | None = override.get("candidate")
    known = {c["candidate_id"] for c in facts["candidates"]}
    chosen: str = by_person if by_person is not None and by_person in known else facts["chosen_id"]
    if placement and by_person and chosen != by_person:
        chosen = placement["candidate_id"]  # an uploaded mesh: its id is known after placement
    address, version = f"/media/{project.id}/candidates/{item.id}", generate_key(files, item.result_name)
    return schemas.CandidateGroup(
        object=item.id or 0,
        name=item.name,
        run_name=item.result_name,
        category=item.category,
        assignee=item.assignee,
        chosen=chosen,
        chosen_by="person" if by_person else facts["chosen_by"],
        reason=f"chosen by {verdicts[accepted].who if accepted else 'a person'}" if by_person else facts["reason"],
        ranking=facts["ranking"],
        accepted=accepted,
        candidates=[_candidate(entry, verdicts.get(entry["candidate_id"]), address, version) for entry in facts["candidates"]],
        placement=_placement(placement) if placement else None,
        override=override_shape(override),
        changed=changed_since(files, item),
        version=said.versions.get(item.id, 0),
        can_undo=steps.undo,
        can_redo=steps.redo,
        can_regenerate=(override.get("regenerate") or 0) < MOST_BATCHES,
    )


def _choice_without(files: ProjectFiles, name: str, rejected: tuple[str, ...]) -> dict[str, Any]:
    """The next run's choice without rejected candidates, by the pipeline's rule; empty if all are rejected."""
    from r2c2r_core.config import ReconstructConfig
    from r2c2r_core.generate.candidates import select_candidate

    found = views.latest(files, "generate", name)
    try:
        return _choice(select_candidate(found, ObjectOverride(rejected=rejected), ReconstructConfig().generate.rule))
    except GenerationFailed as error:
        return {"chosen_id": "", "reason": str(error)}


def _candidate(entry: dict[str, Any], verdict: Verdict | None, address: str, version: str) -> schemas.Candidate:
    said: Any = verdict.verdict if verdict else None
    return schemas.Candidate(
        id=entry["candidate_id"],
        generator=entry["generator"],
        seed=entry["seed"],
        assumes=entry["assumes"],
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
    names = ("matches", "inliers", "unsure", "runner_up", "runner_up_turn_deg", "method", "votes", "warnings", "rms_m")
    shown = {key: facts[key] for key in names}
    shown["spread"] = facts["spread"] and {key: facts["spread"][key] for key in ("turn_deg", "shift_m", "scale")}
    shown |= {key: facts[key] if facts[key] is not None else 0.0 for key in ("mask_iou", "condition")}
    shown |= {"candidate": facts["candidate_id"], "scale": similarity["scale"], "translation_m": similarity["translation"]}
    return schemas.Placement.model_validate(shown)


def override_shape(data: dict[str, Any]) -> schemas.OverrideData:
    """The corrections for display, with an uploaded mesh's name instead of its path."""
    shown = {"candidate": Path(data["candidate"]).name} if data.get("candidate") else {}
    return schemas.OverrideData.model_validate({**data, **shown})


def changed_since(files: ProjectFiles, item: SceneObject) -> bool:
    """Whether the object was changed since the last run; False where no run recorded its inputs."""
    path = files.finished_inputs
    known = _INPUTS.get(path, lambda: json.loads(path.read_text()), lambda found, _: 100 * len(found))
    return known is not None and known.get(item.result_name, "") != item.inputs


_INPUTS: FileCache[dict[str, str]] = FileCache(4 << 20)


def facts_of(files: ProjectFiles, name: str) -> dict[str, Any] | None:
    """The candidates as JSON, without their meshes."""
    return views.facts(files, "generate", name, _candidate_facts)


def _candidate_facts(found: CandidateSet) -> dict[str, Any]:
    kept = ("candidate_id", "generator", "seed", "assumes", "watertight", "frames", "metrics", "parameters", "warnings")
    candidates = [{**{key: plain(getattr(c, key)) for key in kept}, "faces": len(c.mesh.faces)} for c in found.candidates]
    return {**_choice(found), "candidates": candidates}


def _choice(found: CandidateSet) -> dict[str, Any]:
    return {key: plain(getattr(found, key)) for key in ("chosen_id", "chosen_by", "reason", "ranking")}


def candidate_mesh(files: ProjectFiles, name: str, candidate: str) -> Any:
    """One candidate's noun; NotFound when the object has no such candidate."""
    found = views.latest(files, "generate", name)
    for asset in found.candidates if found else ():
        if asset.candidate_id == candidate:
            return asset
    raise NotFound(f"{name} has no candidate {candidate}", hint="the candidates may have been made again")


def generate_key(files: ProjectFiles, name: str) -> str:
    """Key that changes whenever the object's candidates do."""
    path = noun_path(files.work, "generate", name)
    return f"{path.stat().st_mtime_ns:x}" if path.is_file() else "0"
