"""Steps of a job: one process per stage, with relative durations."""

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sqlmodel import Session

from app.db.documents import corrected_prompts, overrides_document, prompts_document
from app.db.queries import STAGES, live_objects
from app.db.tables import Job, Project
from app.files import ProjectFiles
from app.process import python_module
from app.settings import Settings
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.registry import Backend, Registry
from r2c2r_core.robot.arms import NO_ARM
from r2c2r_core.segment.stage import SEGMENTERS
from r2c2r_core.workspace import content_key, write_atomically


@dataclass(frozen=True, slots=True)
class Step:
    """One process of a job."""

    stage: str
    command: tuple[str, ...]
    weight: float  # share of the job's time; only ratios mean something
    took_s: float | None = None  # longest duration in the project's last jobs; None: never done
    side_by_side: bool = False  # computes its objects in parallel processes
    objects: int = 0  # number of objects, for a per-object step
    object_s: float = 0.0  # estimated duration per object
    learned: bool = False  # uses a model that benefits from a GPU

    def of(self, names: Collection[str], request: Path | None = None) -> "Step":
        """The step for these objects only (r2c2r_core.worker --only), optionally with another request."""
        given = () if request is None else ("--request", str(request))  # the last one is used
        return replace(self, command=(*self.command, *given, "--only", *names))


@dataclass(frozen=True, slots=True, kw_only=True)
class Commands:
    """The programs of jobs; replaceable in tests."""

    worker: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.worker"))
    probe: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.alone", "app.jobs.probe"))
    ingest: tuple[str, ...] = field(default_factory=lambda: python_module("r2c2r_core.alone", "app.jobs.ingest"))
    sample: tuple[str, ...] = field(default_factory=lambda: python_module("app.jobs.sample"))
    vary: tuple[str, ...] = field(default_factory=lambda: python_module("app.jobs.vary"))
    live: tuple[str, ...] = field(default_factory=lambda: python_module("app.jobs.live_segment"))


def commands_of(settings: Settings) -> Commands:
    """The app's programs as configured by the settings."""
    return Commands(worker=(*python_module("r2c2r_core.worker"), "--workers", str(settings.workers_a_job)))


NAMES = "names.json"  # beside a request: names of the objects in the run, by number
INPUTS = "inputs.json"  # beside a request: key of the inputs of each object in the run, by name

Planner = Callable[[Job, Project, ProjectFiles, Commands], list[Step]]

# without a model, with two parallel processes: line fits through kitchens of 5, 14 and 40 objects (benchmarks/speed.json)
_OBJECT_S = {"segment": 0.6, "generate": 1.6, "align": 0.4, "a model": 20.0}
_WEIGHTS = {"segment": 30.0, "generate": 30.0, "align": 25.0, "synthesize": 3.0, "warp": 4.0, "export": 8.0}


def steps_of(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    """The processes of a job, in order."""
    return _PLANNERS[job.kind](job, project, files, commands)


_AS_RECORDED: dict[str, Any] = {"register_depth": False, "scale": 1.0}


def request_of(session: Session, job: Job, project: Project, files: ProjectFiles) -> dict[str, Any]:
    """The job's request: a snapshot of clicks and corrections at its first start.

    The files are in the job's own folder, where its processes read them (r2c2r_core.worker.read_request); request.json is
    written last, so that a resumed job finds either all of them or none.
    """
    path, payload = files.request(job.id or 0), job.payload
    if path.is_file():
        return placed_request(path, files)
    tools = {key: payload[key] for key in ("segmenter", "generator", "matcher") if payload.get(key)}
    source = None if project.source_path is None else str(files.here(project.source_path))
    request: dict[str, Any] = {"source": source, "prompts": "prompts.json", "overrides": "overrides.json"}
    said = {"register_depth": project.register_depth, "scale": project.scale}
    config: dict[str, Any] = {}
    if reading := {name: value for name, value in said.items() if value != _AS_RECORDED[name]}:
        config["ingest"] = reading
    if payload.get("arm", NO_ARM) != NO_ARM:
        config["export"] = {"arm": True}
    if config:
        request["config"] = config
    now = prompts_document(session, project.id)
    prompts = _prompts_of(session, job, files) or now
    inputs = project.inputs if prompts == now else content_key(project.inputs, prompts)
    request |= {"tools": tools, "seed": payload.get("seed", 0), "inputs": inputs}
    left_out = _names(now) - _names(prompts)
    overrides = overrides_document(session, project.id)
    overrides["objects"] = {name: entry for name, entry in overrides["objects"].items() if name not in left_out}
    named = {item.id or 0: item.name for item in live_objects(session, project.id) if item.name not in left_out}
    write_json(path.with_name("prompts.json"), prompts)
    write_json(path.with_name("overrides.json"), _placed_overrides(overrides, files))
    write_json(path.with_name(NAMES), named)
    write_json(path.with_name(INPUTS), _inputs_of(session, job.project_id, prompts, now))
    write_json(path, request)
    return request


def _prompts_of(session: Session, job: Job, files: ProjectFiles) -> dict[str, Any] | None:
    """Prompts for a run started by a correction; None for any other run, and without an earlier run."""
    about = job.payload.get("about")
    if not about or not files.finished_prompts.is_file():
        return None
    return corrected_prompts(session, job.project_id, json.loads(files.finished_prompts.read_text()), about)


def _inputs_of(session: Session, project_id: str, used: dict[str, Any], now: dict[str, Any]) -> dict[str, str]:
    """Key of each object's inputs, by name; empty where the run uses older prompts of it."""
    older, newer = ({entry["name"]: entry for entry in document["objects"]} for document in (used, now))
    same = {item.name: older.get(item.name) == newer.get(item.name) for item in live_objects(session, project_id)}
    return {item.name: item.inputs if same[item.name] else "" for item in live_objects(session, project_id)}


def _names(document: dict[str, Any]) -> set[str]:
    return {entry["name"] for entry in document["objects"]}


def placed_request(path: Path, files: ProjectFiles) -> dict[str, Any]:
    """An existing request, possibly from another machine, with paths mapped to this one."""
    request: dict[str, Any] = json.loads(path.read_text())
    overrides = path.with_name("overrides.json")
    written = json.loads(overrides.read_text())
    placed = _placed_overrides(json.loads(overrides.read_text()), files)
    if placed != written:
        write_json(overrides, placed)
    if request["source"] and str(files.here(request["source"])) != request["source"]:
        request["source"] = str(files.here(request["source"]))
        write_json(path, request)
    return request


def _placed_overrides(document: dict[str, Any], files: ProjectFiles) -> dict[str, Any]:
    """overrides.json with paths of uploaded meshes mapped to this machine."""
    for entry in document["objects"].values():
        if isinstance(entry.get("candidate"), str):
            entry["candidate"] = str(files.here(entry["candidate"]))
    return document


def write_json(path: Path, document: Any) -> None:
    """Write a JSON file atomically."""
    write_atomically(path, json.dumps(document, indent=1).encode())


def _import(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    return [_ingest(job, files, commands)]


def _sample(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    wish = job.payload
    name = Path(project.source_path or "").stem
    options = ("--seed", str(wish["seed"]), "--frames", str(wish["frames"]), "--size", f"{wish['width']}x{wish['height']}")
    command = (*commands.sample, str(files.source), "--name", name, *options, "--picture", str(files.arriving))
    return [Step("sample", command, 60.0), _ingest(job, files, commands)]


def _run(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    given = ("--request", str(files.request(job.id or 0)))

    names = files.request(job.id or 0).with_name(NAMES)
    count = len(json.loads(names.read_text())) if names.is_file() else 0

    def step(stage: str) -> Step:
        command = (*commands.worker, str(files.work), "--until", stage, *given)
        if stage not in _TOOLS:
            return Step(stage, command, _WEIGHTS[stage])
        backend = _backend(stage, job.payload)
        each_s = _OBJECT_S["a model" if backend.alone else stage]
        return Step(
            stage,
            command,
            _WEIGHTS[stage],
            side_by_side=True,
            objects=count,
            object_s=each_s,
            learned=backend.weights is not None,
        )

    return [step(stage) for stage in STAGES["run"]]


def _vary(job: Job, project: Project, files: ProjectFiles, commands: Commands) -> list[Step]:
    wish = job.payload
    places = (str(files.bundles / wish["bundle"]), str(files.variants / wish["name"]))
    return [Step("vary", (*commands.vary, *places, "--count", str(wish["count"]), "--seed", str(wish["seed"])), 1.0)]


def _backend(stage: str, payload: dict[str, Any]) -> Backend:
    """The backend of a job's stage."""
    seam, backends = _TOOLS[stage]
    return backends.get(payload.get(seam) or backends.default)


def _ingest(job: Job, files: ProjectFiles, commands: Commands) -> Step:
    given = ("--request", str(files.request(job.id or 0)))
    return Step("ingest", (*commands.ingest, str(files.work), str(files.root), *given), 40.0)


_TOOLS: dict[str, tuple[str, Registry[Any]]] = {
    "segment": ("segmenter", SEGMENTERS),
    "generate": ("generator", GENERATORS),
    "align": ("matcher", MATCHERS),
}
"""Stages that go object by object, each with the tool that a job chooses for it."""

_PLANNERS: dict[str, Planner] = {"import": _import, "sample": _sample, "run": _run, "vary": _vary}
