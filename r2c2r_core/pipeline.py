"""READ FIRST: the pipeline from one recording and a few clicks to an articulated scene."""

import logging
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.align.stage import Placer, place_candidate
from r2c2r_core.config import ReconstructConfig
from r2c2r_core.errors import InputError, StageError
from r2c2r_core.export.stage import write_bundle
from r2c2r_core.generate.candidates import Plan, make_candidates, select_candidate
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.ingest.above import calibrations_beside
from r2c2r_core.ingest.doctor.doubts import Doubts, find_doubts
from r2c2r_core.ingest.stage import level_scan, read_recording
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.ledger import Kept, Ledger, Reached, Shared, Stage, aside
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import Overrides, Prompts
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.reconstruction import Reconstruction, StageRun
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.overrides import NO_OVERRIDES, with_drawn_hinges
from r2c2r_core.pool import Pool, usual_workers
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.segment.contradictions import find_contradictions
from r2c2r_core.segment.prompts import check_prompts, without_hinge
from r2c2r_core.segment.slab_masks import stands_on, without_things
from r2c2r_core.segment.stage import SEGMENTERS, find_disputed, open_session, track_object
from r2c2r_core.sources import source_key
from r2c2r_core.synthesize.fixtures.carcass import CARCASSES
from r2c2r_core.synthesize.stage import build_scene
from r2c2r_core.tuning import changed, tuning
from r2c2r_core.warp.stage import fit_meshes
from r2c2r_core.workspace import Workspace, content_key, file_key

OBJECT_STAGES: tuple[Stage, ...] = ("segment", "generate", "align")  # stages that run per object

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tools:
    """The backend of each seam, by name."""

    segmenter: str = SEGMENTERS.default
    generator: str = GENERATORS.default
    matcher: str = MATCHERS.default


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Everything a reconstruction depends on."""

    source: Path
    prompts: Prompts
    overrides: Overrides = NO_OVERRIDES
    config: ReconstructConfig = field(default_factory=ReconstructConfig)
    tools: Tools = field(default_factory=Tools)
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Result of a run. `reconstruction` and `certificate` are None if it stopped before the export, as requested."""

    reconstruction: Reconstruction | None
    certificate: Certificate | None
    computed: tuple[str, ...]  # "stage/object" of results computed rather than loaded
    failures: dict[str, str]  # object -> one line
    seconds: dict[str, float]  # by stage: computation time of its results
    left: tuple[str, ...] = ()  # objects missing in the last stage, for a run of some objects


def reconstruct(
    request: Request,
    work: Workspace,
    *,
    until: Stage = "export",
    only: Collection[str] | None = None,
    workers: int = 1,
    progress: Progress = SILENT,
) -> Outcome:
    """Turn one RGB-D recording into an articulated scene; the bundle is `work.bundle`.

    Objects are computed in parallel in `workers` processes (0: as many as cores and memory allow); 1 starts none.

    With `only` the run computes these objects of the stage `until`, one of OBJECT_STAGES whose earlier stages are done, while
    other processes may compute others. With an empty `only` it computes the shared inputs, and reports the remaining objects.
    A later run of all objects reuses the stored results. Raises InputError for an unknown stage or object.
    """
    reconstruction, certificate = None, None
    if only is not None:
        _require_objects(request, until, only)
    held = work.locked([f"{until}/{name}" for name in only or ()])
    with held, tuning(changed(request.config.numbers)), Pool(workers or usual_workers()) as pool, suppress(Reached):
        run = Ledger(work, progress, until, pool, only=only)
        reconstruction, certificate = _run(request, run)
        work.keep_seconds(run.seconds)
    return Outcome(
        reconstruction=reconstruction,
        certificate=certificate,
        computed=tuple(work.computed),
        failures=dict(run.failures),
        seconds=dict(run.seconds),
        left=tuple(run.left),
    )


def _require_objects(request: Request, stage: Stage, names: Collection[str]) -> None:
    if stage not in OBJECT_STAGES:
        raise InputError(f"{stage}: it is not computed per object", hint=f"choose one of {', '.join(OBJECT_STAGES)}")
    if unknown := sorted(set(names) - {prompt.name for prompt in request.prompts.objects}):
        raise InputError(f"{unknown[0]}: no such object in the prompts", hint="use names from the prompts")


def _run(request: Request, run: Ledger) -> tuple[Reconstruction, Certificate]:
    config, said, work = request.config, with_drawn_hinges(request.overrides, request.prompts), run.work
    if run.until != "ingest":
        require_tools(request)

    capture = read_room(request, run)
    if run.until != "ingest":  # a recording may be ingested before there are prompts
        check_prompts(capture.value, request.prompts)
    tracks = segment_objects(request, run, capture)
    masks = {name: track.value for name, track in tracks.items()}
    contradictions = find_contradictions(masks, request.prompts.objects, capture.value.room.walls)
    for found in contradictions:  # now, not after minutes of computing
        _log.warning("%s", found.line)
    candidates = generate_objects(request, run, capture, tracks)
    corrections = {name: said.of(name) for name in candidates}
    choices = run.decide("generate", select_candidate, candidates, corrections, config.generate.rule)
    placements = place_objects(request, run, capture, tracks, candidates, choices)

    names = list(placements)
    if not names and run.only is None:
        raise StageError("no object could be placed", hint="; ".join(run.failures.values()) or "add prompts")
    shown = [tracks[name] for name in names]
    placed = [placements[name] for name in names]
    assets = [aside(choices[name].chosen) for name in names]  # a placement depends on its candidate
    unseen = [one for one in request.prompts.objects if category_of(one.category).name == "counter" and one.name not in names]
    scene = run.one("synthesize", build_scene, capture, shown, placed, assets, said, config.synthesize, unseen)
    run.failures |= scene.value.failures
    for item in scene.value.objects:  # a worktop of which depth shows nothing is made over its run
        run.failures.pop(item.name, None)
    fitted = run.one("warp", fit_meshes, scene, shown, placed, assets, config.warp)
    stand = [name for name in names if name not in scene.value.failures]
    result = Reconstruction(
        capture=capture.value,
        prompts=request.prompts,
        overrides=said,
        tracks=tuple(kept.value for kept in tracks.values()),
        candidates=tuple(choices[name] for name in stand),
        placements=tuple(placements[name].value for name in stand),
        scene=fitted.value,
        stages=_stage_runs(request, tuple(run.seconds)),
        failures=dict(run.failures),
        contradictions=contradictions,
    )
    if not work.bundle.exists():
        work.forget("export", "scene")
    known = Kept(result, content_key(fitted.key, run.failures))
    certificate = run.one("export", write_bundle, known, aside(work.bundle), config.export, aside(run.pool))
    run.failures |= certificate.value.left_out
    return result, certificate.value


def read_room(request: Request, run: Ledger) -> Kept[Capture]:
    """The levelled recording, decoded once; corrections of the room move it without decoding it again."""
    config, source = request.config.ingest, Kept(request.source, recording_key(request.source))
    frames = run.work.store(content_key(source_key("ingest"), source.key, config))
    scan = run.one("ingest", read_recording, source, aside(frames), config, name="recording", span=(0.0, 0.95))
    capture = run.one("ingest", level_scan, scan, request.overrides.room, config, span=(0.95, 1.0))
    run.work.keep_frames(frames.name)
    return capture


def require_tools(request: Request) -> None:
    """Raise if a chosen tool is not available, before minutes of reading."""
    SEGMENTERS.require(request.tools.segmenter, request.config.segment.weights)
    CARCASSES.require(request.config.synthesize.fixtures)


def doubts_about(request: Request, work: Workspace, *, progress: Progress = SILENT) -> Doubts:
    """The doctor's doubts about the recording, before any computation; ingests the recording if necessary."""
    require_tools(request)
    with work.locked(), tuning(changed(request.config.numbers)):
        run = Ledger(work, progress, "ingest")
        capture = read_room(request, run)
        source = Kept(request.source, recording_key(request.source))
        return Doubts(*run.one("ingest", find_doubts, source, capture, name="doubts").value)


def recording_key(source: Path) -> str:
    """Key of a recording, with the calibrations beside its folder that it may borrow."""
    beside = [file_key(path) for path in calibrations_beside(source)]
    return content_key(file_key(source), beside) if beside else file_key(source)


DISPUTED = "disputed-clicks"  # with a hyphen: not a valid object name, and omitted by Workspace.names


def segment_objects(request: Request, run: Ledger, capture: Kept[Capture]) -> dict[str, Kept[MaskTrack]]:
    """Every object's masks."""
    name, config = request.tools.segmenter, request.config.segment
    config = replace(config, weights=SEGMENTERS.weights_named(name, config.weights))
    session = Shared(open_session, (capture, aside(run.work.cache), name, config))
    prompts = {prompt.name: without_hinge(prompt) for prompt in request.prompts.objects}
    disputed = run.one("segment", find_disputed, session, list(prompts.values()), name=DISPUTED, span=(0.0, 0.1)).value
    prompts = {name: replace(prompt, others=disputed.get(name, ())) for name, prompt in prompts.items()}
    tracks = run.each("segment", track_object, prompts, session, prompts, alone=SEGMENTERS.get(name).alone)
    return {name: _without_things(kept, tracks.values()) for name, kept in tracks.items()}


def _without_things(slab: Kept[MaskTrack], tracks: Collection[Kept[MaskTrack]]) -> Kept[MaskTrack]:
    """A slab's track without the things that stand on it; any other track as it is."""
    on_it = [kept for kept in tracks if kept is not slab and stands_on(kept.value, slab.value)]
    if not on_it:
        return slab
    cleared = without_things(slab.value, [kept.value for kept in on_it])
    return Kept(cleared, content_key(slab.key, [kept.key for kept in on_it]))


def generate_objects(
    request: Request, run: Ledger, capture: Kept[Capture], tracks: Mapping[str, Kept[MaskTrack]]
) -> dict[str, Kept[CandidateSet]]:
    """Candidates of every object. Where the chosen generator fails, the weight-free one replaces it, with a warning.

    The failure is not stored, so that the next run tries the chosen generator again. Uploaded meshes and further candidates
    requested by the user are added to the existing candidates, which are not generated again.
    """
    said, generator = request.overrides, request.tools.generator
    given = {name: _uploads(said, name) for name in tracks}
    plans = {
        name: Plan(generator=generator, config=request.config.generate, seed=request.seed, batch=said.of(name).regenerate)
        for name in tracks
    }

    def made_by(plans: Mapping[str, Plan]) -> dict[str, Kept[CandidateSet]]:
        placers = {name: _placer(request) if plan.places or given[name] else None for name, plan in plans.items()}
        earlier = {name: aside(_earlier(request, run, capture, tracks, name, plan)) for name, plan in plans.items()}
        alone = GENERATORS.get(generator).alone
        return run.each("generate", make_candidates, plans, capture, tracks, plans, given, placers, earlier, alone=alone)

    made = made_by(plans)
    failed = {name: run.failures[name].removeprefix(f"generate: {name}: ") for name in plans if name in run.failures}
    instead = {name: plan for name, why in failed.items() if (plan := plans[name].stand_in(why)) is not None}
    for name in instead:
        del run.failures[name]
    made |= made_by(instead) if instead else {}
    return {name: made[name] for name in tracks if name in made}


def place_objects(
    request: Request,
    run: Ledger,
    capture: Kept[Capture],
    tracks: Mapping[str, Kept[MaskTrack]],
    candidates: Mapping[str, Kept[CandidateSet]],
    choices: Mapping[str, CandidateSet],
) -> dict[str, Kept[Placement]]:
    """Placement of every chosen candidate; recomputed only for another choice."""
    chosen = {name: choice.chosen_id for name, choice in choices.items()}
    alone = MATCHERS.get(request.tools.matcher).alone
    return run.each("align", place_candidate, chosen, capture, tracks, candidates, chosen, _placer(request), alone=alone)


def restricted_licences(request: Request) -> list[str]:
    """A line for every chosen backend whose licence forbids some uses."""
    tools = request.tools
    chosen = (
        SEGMENTERS.get(tools.segmenter),
        GENERATORS.get(tools.generator),
        MATCHERS.get(tools.matcher),
        CARCASSES.get(request.config.synthesize.fixtures),
    )
    seams = ("segmenter", "generator", "matcher", "fixtures")
    return [f"{seam} {b.name}: {b.licence}" for seam, b in zip(seams, chosen, strict=True) if b.licence_class == "restricted"]


def _earlier(
    request: Request,
    run: Ledger,
    capture: Kept[Capture],
    tracks: Mapping[str, Kept[MaskTrack]],
    name: str,
    plan: Plan,
) -> tuple[Plan, CandidateSet] | None:
    """Stored candidates of an earlier run to which the plan only adds, with their plan; else None."""
    for step in plan.steps(bool(_uploads(request.overrides, name))):
        placer = _placer(request) if step.places else None
        found = run.stored("generate", make_candidates, name, capture, tracks, step, (), placer, aside(None))
        if found is not None:
            return step, found
    return None


def _placer(request: Request) -> Placer:
    return Placer(request.tools.matcher, request.config.align, request.seed)


def _uploads(overrides: Overrides, name: str) -> tuple[Kept[Path], ...]:
    candidate = overrides.of(name).candidate
    path = Path(candidate) if candidate is not None else None
    return (Kept(path, file_key(path)),) if path is not None and path.is_file() else ()


def _stage_runs(request: Request, names: tuple[str, ...]) -> tuple[StageRun, ...]:
    backends = {
        "segment": request.tools.segmenter,
        "generate": request.tools.generator,
        "align": request.tools.matcher,
    }
    return tuple(
        StageRun(name=name, backend=backends.get(name, ""), config=asdict(getattr(request.config, name))) for name in names
    )
