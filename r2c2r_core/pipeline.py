"""READ FIRST: one recording and a few clicks in, an articulated scene out."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from math import isfinite
from pathlib import Path

from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.align.stage import place_mesh
from r2c2r_core.config import ReconstructConfig
from r2c2r_core.errors import PlacementFailed, StageError
from r2c2r_core.export.stage import write_bundle
from r2c2r_core.generate.consensus import Rule, choose_candidate, chosen_by_person
from r2c2r_core.generate.stage import GENERATORS, generate_candidates, marked, with_uploads
from r2c2r_core.ingest.stage import read_capture
from r2c2r_core.ledger import Kept, Ledger, Reached, Stage, keys_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectOverride, Overrides, Prompts
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.reconstruction import Reconstruction, StageRun
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.overrides import NO_OVERRIDES
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.segment.prompts import check_prompts
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import SEGMENTERS, open_session
from r2c2r_core.sources import source_key
from r2c2r_core.synthesize.stage import build_scene
from r2c2r_core.warp.stage import fit_meshes
from r2c2r_core.workspace import Workspace, file_key

_MOST_WEIGHED = 5  # candidates placed for their evidence: about 4 s each on one core


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
    """What a run gave. `reconstruction` and `certificate` are None when it was asked to stop before the export."""

    reconstruction: Reconstruction | None
    certificate: Certificate | None
    computed: tuple[str, ...]  # "stage/object" of what was computed rather than found
    failures: dict[str, str]  # object -> one line


def reconstruct(request: Request, work: Workspace, *, until: Stage = "export", progress: Progress = SILENT) -> Outcome:
    """Turn one RGB-D recording into an articulated scene; the bundle is `work.bundle`."""
    ledger = Ledger(work, progress, until)
    reconstruction, certificate = None, None
    with work.locked(), suppress(Reached):
        reconstruction, certificate = _run(request, ledger)
    return Outcome(
        reconstruction=reconstruction,
        certificate=certificate,
        computed=tuple(work.computed),
        failures=dict(ledger.failures),
    )


def _run(request: Request, ledger: Ledger) -> tuple[Reconstruction, Certificate]:
    config, tools, overrides, work, seed = request.config, request.tools, request.overrides, ledger.work, request.seed

    if ledger.until != "ingest":  # known at once, not after minutes of reading
        SEGMENTERS.require(tools.segmenter, config.segment.weights)
    capture = ledger.one(
        "ingest",
        (file_key(request.source), config.ingest, _room_overrides(overrides)),
        lambda p: read_capture(request.source, work.frames, config.ingest, overrides=overrides, progress=p),
    )
    if ledger.until != "ingest":  # a recording may be looked at before anyone clicked
        check_prompts(capture.value, request.prompts)
    weights = SEGMENTERS.weights_named(tools.segmenter, config.segment.weights)
    session = _session_on_demand(capture.value, request, work, ledger.progress)
    tracks = ledger.each(
        "segment",
        {prompt.name: Kept(prompt, capture.key) for prompt in request.prompts.objects},
        lambda name: (tools.segmenter, weights, config.segment, next(p for p in request.prompts.objects if p.name == name)),
        lambda name, prompt, p: session().track(prompt, progress=p),
    )
    candidates = make_candidates(request, ledger, capture.value, tracks)
    choices = ledger.sort_out(
        "generate", candidates, lambda name, found: select_candidate(found, overrides.of(name), config.generate.rule)
    )
    placements = ledger.each(
        "align",
        choices,
        lambda name: (tools.matcher, config.align, seed, choices[name].value.chosen_id),
        lambda name, choice, p: place_mesh(
            capture.value, tracks[name].value, choice.chosen, tools.matcher, config.align, seed=seed, progress=p
        ),
    )
    if not placements:
        raise StageError("no object could be placed", hint="; ".join(ledger.failures.values()) or "add prompts")
    placed_tracks = [tracks[name].value for name in placements]
    placed = [kept.value for kept in placements.values()]
    assets = [choices[name].value.chosen for name in placements]
    scene = ledger.one(
        "synthesize",
        (keys_of(placements), config.synthesize, overrides),
        lambda p: build_scene(capture.value, placed_tracks, placed, assets, overrides, config.synthesize, progress=p),
    )
    fitted = ledger.one(
        "warp",
        (scene.key, config.warp),
        lambda p: fit_meshes(scene.value, placed_tracks, placed, assets, config.warp, progress=p),
    )
    result = Reconstruction(
        capture=capture.value,
        prompts=request.prompts,
        overrides=overrides,
        tracks=tuple(kept.value for kept in tracks.values()),
        candidates=tuple(choices[name].value for name in placements),
        placements=tuple(placed),
        scene=fitted.value,
        stages=_stage_runs(request, ledger.seconds),
        failures=dict(ledger.failures),
    )
    if not work.bundle.exists():
        work.forget("export", "scene")
    certificate = ledger.one(
        "export",
        (fitted.key, config.export, ledger.failures),
        lambda p: write_bundle(result, work.bundle, config.export, progress=p),
    )
    return result, certificate.value


def restricted_licences(tools: Tools) -> list[str]:
    """A line for every chosen backend whose licence forbids some uses."""
    chosen = ((SEGMENTERS, tools.segmenter), (GENERATORS, tools.generator), (MATCHERS, tools.matcher))
    backends = [(registry.seam, registry.get(name)) for registry, name in chosen]
    return [f"{seam} {b.name}: {b.licence}" for seam, b in backends if b.licence_class == "restricted"]


def make_candidates(
    request: Request, ledger: Ledger, capture: Capture, tracks: dict[str, Kept[MaskTrack]]
) -> dict[str, Kept[CandidateSet]]:
    """Every object's candidates. Where the chosen generator fails on one, the weight-free one stands in, with a warning.

    The failure is not stored, so that the next run asks the chosen generator again. A mesh given by a person joins the
    candidates that are there, and so do further ones that a person asked for: nothing is generated anew for them.
    """
    config, chosen = request.config.generate, request.tools.generator

    def made_by(
        generator: str, objects: dict[str, Kept[MaskTrack]], excuse: Mapping[str, str]
    ) -> dict[str, Kept[CandidateSet]]:
        def inputs(name: str, given: tuple[Path, ...], batch: int) -> tuple[object, ...]:
            weighing = () if generator == GENERATORS.default and not given else _weighing_key(request)
            return generator, config, request.seed, batch, excuse.get(name), weighing, *map(file_key, given)

        def make(name: str, track: MaskTrack, progress: Progress) -> CandidateSet:
            given, batch = _uploads(request.overrides, name), request.overrides.of(name).regenerate
            before = ledger.stored("generate", name, tracks[name], inputs(name, (), batch)) if given else None
            if before is not None:
                return weighed(capture, track, with_uploads(before, given, config.rule), request, progress)
            found = generate_candidates(
                capture,
                track,
                generator,
                config,
                uploads=given,
                seed=request.seed,
                batch=batch,
                earlier=ledger.stored("generate", name, tracks[name], inputs(name, (), batch - 1)) if batch else None,
                progress=progress,
            )
            found = weighed(capture, track, found, request, progress)
            return marked(found, excuse[name]) if name in excuse else found

        def inputs_now(name: str) -> tuple[object, ...]:
            return inputs(name, _uploads(request.overrides, name), request.overrides.of(name).regenerate)

        return ledger.each("generate", objects, inputs_now, make)

    made = made_by(chosen, tracks, {})
    missing = {name: track for name, track in tracks.items() if name not in made}
    if not missing or chosen == GENERATORS.default:
        return made
    reasons = {name: ledger.failures.pop(name).removeprefix(f"generate: {name}: ") for name in missing}
    excuses = {name: f"{chosen} made no mesh, {GENERATORS.default} stands in: {why}" for name, why in reasons.items()}
    stood_in = made_by(GENERATORS.default, missing, excuses)
    return {name: {**made, **stood_in}[name] for name in tracks if name in made or name in stood_in}


def weighed(
    capture: Capture, track: MaskTrack, found: CandidateSet, request: Request, progress: Progress = SILENT
) -> CandidateSet:
    """The candidates of generators that do not know their place, placed and compared with masks and depth; ranked anew.

    The most likely few: one that no pose fits, or that was not tried, is known by its shape alone.
    """
    unknown = [c for c in found.candidates if "mask_iou" not in c.metrics]
    if not unknown or len(found.candidates) == 1:
        return found
    tried = sorted(unknown, key=lambda c: found.ranking.index(c.candidate_id))[:_MOST_WEIGHED]
    fits: dict[str, dict[str, float]] = {}
    for k, asset in enumerate(tried):
        part = progress.part(k / len(tried), (k + 1) / len(tried))
        with suppress(PlacementFailed):
            placed = place_mesh(
                capture, track, asset, request.tools.matcher, request.config.align, seed=request.seed, progress=part
            )
            depth = {"depth_residual_m": placed.rms_m} if isfinite(placed.rms_m) else {}
            fits[asset.candidate_id] = {"mask_iou": placed.mask_iou, **depth}
    candidates = [replace(c, metrics={**c.metrics, **fits.get(c.candidate_id, {})}) for c in found.candidates]
    return choose_candidate(candidates, rule=request.config.generate.rule)


def _weighing_key(request: Request) -> tuple[object, ...]:
    """What the evidence of placed candidates depends on beside them."""
    return source_key("align"), request.tools.matcher, request.config.align


def select_candidate(found: CandidateSet, override: ObjectOverride, rule: Rule) -> CandidateSet:
    """The candidate a person named, else the consensus among those nobody rejected; choosing makes no new candidates."""
    if override.candidate is not None:
        uploaded = [c.candidate_id for c in found.candidates if c.candidate_id.startswith("upload")]
        return chosen_by_person(found, uploaded[0] if Path(override.candidate).is_file() else override.candidate)
    return choose_candidate(found.candidates, rejected=override.rejected, rule=rule) if override.rejected else found


def _room_overrides(overrides: Overrides) -> tuple[object, ...]:
    """What a person said about the room: an input of ingest."""
    return overrides.up_capture, overrides.floor_m, overrides.manhattan_yaw_rad, overrides.walls


def _uploads(overrides: Overrides, name: str) -> tuple[Path, ...]:
    candidate = overrides.of(name).candidate
    return (Path(candidate),) if candidate is not None and Path(candidate).is_file() else ()


def _session_on_demand(capture: Capture, request: Request, work: Workspace, progress: Progress) -> Callable[[], SegmentSession]:
    @cache
    def session() -> SegmentSession:
        config = request.config.segment
        stage = progress.for_stage("segment")
        return open_session(capture, work.cache, request.tools.segmenter, config, progress=stage)

    return session


def _stage_runs(request: Request, seconds: Mapping[str, float]) -> tuple[StageRun, ...]:
    backends = {
        "segment": request.tools.segmenter,
        "generate": request.tools.generator,
        "align": request.tools.matcher,
    }
    return tuple(
        StageRun(name=name, backend=backends.get(name, ""), config=asdict(getattr(request.config, name)), seconds=taken)
        for name, taken in seconds.items()
    )
