"""What a job runs: one process per stage, and how long each is likely to take beside the others."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlmodel import Session

from app.db.documents import overrides_document, prompts_document
from app.db.queries import STAGES, live_objects
from app.db.tables import Job, Project
from app.files import ProjectFiles
from app.process import python_module
from app.settings import Settings
from r2c2r_core.workspace import write_atomically


@dataclass(frozen=True, slots=True)
class Step:
    """One process of a job."""

    stage: str
    command: tuple[str, ...]
    weight: float  # share of the job's time; only ratios mean something


@dataclass(frozen=True, slots=True, kw_only=True)
class Commands:
    """The programs a job may start; tests put their own in their place."""

    worker: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.worker"))
    probe: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.alone", "app.jobs.probe"))
    ingest: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.alone", "app.jobs.ingest"))
    sample: tuple[str, ...] = field(default_factory=lambda: python_module("app.jobs.sample"))
    live: tuple[str, ...] = field(default_factory=lambda: python_module("app.jobs.live_segment"))


def commands_of(settings: Settings) -> Commands:
    """The programs of the app, as it was told to run them."""
    return Commands(worker=(*python_module("r2c2r_core.worker"), "--workers", str(settings.workers_a_job)))


NAMES = "names.json"  # beside a request: what each object, by its number, is called in the run

Planner = Callable[[Job, Project, ProjectFiles, Commands], list[Step]]

_WEIGHTS = {"segment": 30.0, "generate": 30.0, "align": 25.0, "synthesize": 3.0, "warp": 4.0, "export": 8.0}


def steps_of(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    """The processes of a job, in order."""
    return _PLANNERS[job.kind](job, project, files, commands)


def request_of(session: Session, job: Job, project: Project, files: ProjectFiles) -> dict[str, Any]:
    """What the job is given: the clicks and corrections of the moment it first began, whatever is clicked later.

    They lie in a place of the job's own, where its processes read them (r2c2r_core.worker.read_request); request.json is
    written last, so a job that is taken up again finds all of them or none.
    """
    path, payload = files.request(job.id or 0), job.payload
    if path.is_file():
        found: dict[str, Any] = json.loads(path.read_text())
        return found
    tools = {key: payload[key] for key in ("segmenter", "generator", "matcher") if payload.get(key)}
    request: dict[str, Any] = {"source": project.source_path, "prompts": "prompts.json", "overrides": "overrides.json"}
    if project.register_depth:
        request["config"] = {"ingest": {"register_depth": True}}
    request |= {"tools": tools, "seed": payload.get("seed", 0), "inputs": project.inputs}
    write_json(path.with_name("prompts.json"), prompts_document(session, project.id))
    write_json(path.with_name("overrides.json"), overrides_document(session, project.id))
    write_json(path.with_name(NAMES), {item.id or 0: item.name for item in live_objects(session, project.id)})
    write_json(path, request)
    return request


def write_json(path: Path, document: Any) -> None:
    """Write a JSON file at once or not at all."""
    write_atomically(path, json.dumps(document, indent=1).encode())


def _import(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    return [_ingest(job, files, commands)]


def _sample(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    wish = job.payload
    options = ("--seed", str(wish["seed"]), "--frames", str(wish["frames"]), "--size", f"{wish['width']}x{wish['height']}")
    return [Step("sample", (*commands.sample, str(files.source), *options), 60.0), _ingest(job, files, commands)]


def _run(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    given = ("--request", str(files.request(job.id or 0)))
    return [
        Step(stage, (*commands.worker, str(files.work), "--until", stage, *given), _WEIGHTS[stage]) for stage in STAGES["run"]
    ]


def _ingest(job: Job, files: ProjectFiles, commands: Commands) -> Step:
    given = ("--request", str(files.request(job.id or 0)))
    return Step("ingest", (*commands.ingest, str(files.work), str(files.root), *given), 40.0)


_PLANNERS: dict[str, Planner] = {"import": _import, "sample": _sample, "run": _run}
