"""Pipeline steps of a recording's objects, run one at a time, with the tuned parameters each reads; for `sensitivity.py`."""

import pickle
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from recordings import TrueMask, clicked, record_of, recording_in, true_masks

from r2c2r_core.align.stage import Placer
from r2c2r_core.errors import R2C2RError
from r2c2r_core.evaluate.extents import extent_errors
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.motions import joint_scores
from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, Overrides
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.planes import PlaneRegion, find_planes
from r2c2r_core.segment.runs.run import Run, make_run
from r2c2r_core.segment.scene import prepare_scene
from r2c2r_core.segment.stage import SegmentConfig, track_object
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.tuning import path_of, tuning
from r2c2r_core.warp.stage import WarpConfig, fit_meshes

SAME_M, SAME_IOU = 0.0005, 0.995  # smaller changes do not trigger later steps
PROPOSED_IOU = 0.5
SHARES = ("mask_iou", "joints", "states", "proposals")

Reads = set[tuple[str, str]]  # module, parameter


class Watch(Mapping[type, Any]):
    """Mapping with the default parameters that records which are read."""

    def __init__(self) -> None:
        self.read: set[tuple[str, str]] = set()
        self._watched: dict[type, Any] = {}

    def __getitem__(self, of: type) -> Any:
        if of not in self._watched:
            self._watched[of] = _watched(of, self.read)
        return self._watched[of]

    def __iter__(self) -> Iterator[type]:
        return iter(())

    def __len__(self) -> int:
        return 0


def _watched(of: type[Any], read: set[tuple[str, str]]) -> Any:
    names, path = frozenset(f.name for f in fields(of)), path_of(of)

    class Watched(of):  # type: ignore[misc]
        __slots__ = ()

        def __getattribute__(self, name: str) -> Any:
            if name in names:
                read.add((path, name))
            return super().__getattribute__(name)

    return Watched()


@dataclass(slots=True, eq=False)
class Session(GeometricSession):
    """A session without storage that records the parameters of each furniture run, so that a move keeps unaffected runs."""

    reads: dict[str, Reads] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set)
    noting: bool = True

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """The furniture run on a plane, with a margin around it."""
        key = f"run{self.planes.index(region)}-{round(margin_m * 1000)}"
        self.asked.add(key)
        if key not in self._runs:
            watch = Watch()
            with tuning(watch) if self.noting else nullcontext():
                self._runs[key] = make_run(region, self.scene, self.config.cell_m, self.config.mosaic_frames, margin_m)
            self.reads[key] = watch.read
        return self._runs[key]

    def reading(self) -> Reads:
        """Parameters read by the runs that were requested since the last call."""
        keys, self.asked = self.asked, set()
        return set().union(*(self.reads[key] for key in keys))

    def without(self, moved: Reads) -> "Session":
        """A session for moved parameters that reuses the runs which did not read them."""
        runs = {key: run for key, run in self._runs.items() if not self.reads[key] & moved}
        return Session(self.scene, self.planes, self.config, self.folder, runs, noting=False)


@dataclass(slots=True, eq=False)
class Case:
    """A recording with its truth, and the results of every step with the default parameters."""

    name: str
    capture: Capture
    prompts: dict[str, ObjectPrompt]
    truth: dict[str, ObjectRecord]
    true_masks: TrueMask
    folder: Path  # segmentation cache; results are not stored there
    proposes: bool = False  # whether proposals are made too
    made: dict[str, Any] = field(default_factory=dict)
    read: dict[str, Reads] = field(default_factory=dict)

    @property
    def steps(self) -> list[str]:
        """All steps in order."""
        each = [f"{stage}/{name}" for stage in ("segment", "generate", "align") for name in self.prompts]
        return ["open", *(["propose"] if self.proposes else []), *each, "synthesize", "warp"]

    def needs(self, step: str) -> list[str]:
        """The steps whose results a step uses."""
        stage, _, name = step.partition("/")
        if stage in ("segment", "propose"):
            return ["open"]
        if stage == "generate":
            return [f"segment/{name}"]
        if stage == "align":
            return [f"segment/{name}", f"generate/{name}"]
        if stage == "synthesize":
            return [f"{s}/{n}" for n in self.prompts for s in ("segment", "generate", "align")]
        return ["synthesize", *self.needs("synthesize")] if stage == "warp" else []

    def compute(self, step: str, made: Mapping[str, Any]) -> Any:
        """The step's result; for an R2C2RError or a numerical error its text."""
        stage, _, name = step.partition("/")
        try:
            return self._compute(stage, name, made)
        except (R2C2RError, ValueError, ArithmeticError, LookupError, RuntimeError, cv2.error) as error:
            return f"{type(error).__name__}: {error}"

    def _compute(self, stage: str, name: str, made: Mapping[str, Any]) -> Any:
        if any(isinstance(made[need], str) for need in self.needs(f"{stage}/{name}") if stage in ("generate", "align")):
            return "lost before"
        track, found = made.get(f"segment/{name}"), made.get(f"generate/{name}")
        if stage == "open":
            centres = np.stack([frame.world_from_camera.translation for frame in self.capture.frames])
            scene, planes = prepare_scene(self.capture, self.folder), find_planes(self.capture.surface, centres)
            return Session(scene, planes, SegmentConfig(), self.folder)
        if stage == "propose":
            return list(made["open"].propose())[-1][1]
        if stage == "segment":
            return track_object(made["open"], self.prompts[name])
        if stage == "generate":
            return generate_candidates(self.capture, track, "completion", GenerateConfig(count=1))
        if stage == "align":
            return Placer()(self.capture, track, found.candidates[0])
        names = [n for n in self.prompts if not isinstance(made[f"align/{n}"], str)]
        tracks, placements = ([made[f"{s}/{n}"] for n in names] for s in ("segment", "align"))
        assets = [made[f"generate/{n}"].candidates[0] for n in names]
        if stage == "synthesize":
            return build_scene(self.capture, tracks, placements, assets, Overrides(objects={}), SynthesizeConfig())
        return fit_meshes(made["synthesize"], tracks, placements, assets, WarpConfig())

    def settle(self) -> None:
        """Compute every step with the default parameters, and record what it reads."""
        for step in self.steps:
            watch, started = Watch(), time.monotonic()
            with tuning(watch):
                self.made[step] = self.compute(step, self.made)
            runs = self.made["open"].reading() if step.startswith(("segment/", "propose")) else set()
            self.read[step] = watch.read | runs
            print(f"{step}: {time.monotonic() - started:.1f} s", file=sys.stderr, flush=True)

    def chosen(self, moved: Reads) -> frozenset[str]:
        """One object of each kind whose own steps read these parameters; all objects if only steps of the whole scene do."""
        kinds: dict[str, str] = {}
        for name, prompt in self.prompts.items():
            if any(self.read[f"{stage}/{name}"] & moved for stage in ("segment", "generate", "align")):
                kinds.setdefault(category_of(prompt.category).kind, name)
        return frozenset(kinds.values()) or frozenset(self.prompts)

    def moved(self, of: type[Any], numbers: Any) -> dict[str, Any]:
        """The figures with other parameters of one module, the usual loss of the same objects, and the steps that changed."""
        changed = {(path_of(of), f.name) for f in fields(of) if getattr(numbers, f.name) != f.default}
        objects = self.chosen(changed)
        made, new, other = dict(self.made), set(), list[str]()
        with tuning({of: numbers}):
            if self.read["open"] & changed:
                made["open"] = self.compute("open", made)
                made["open"].noting = False
            else:
                made["open"] = self.made["open"].without(changed)
            for step in self.steps[1:]:
                stage, _, name = step.partition("/")
                again = self.read[step] & changed or (stage in ("segment", "propose") and self.read["open"] & changed)
                if (name and name not in objects) or not (again or new.intersection(self.needs(step))):
                    continue
                made[step] = self.compute(step, made)
                if _bytes(made[step]) != _bytes(self.made[step]):
                    other.append(step)
                    if _differs(self.made[step], made[step]):
                        new.add(step)
        return {**self.figures(made, objects), "before": self.figures(self.made, objects)["loss"], "changed": other}

    def figures(self, made: Mapping[str, Any], objects: frozenset[str]) -> dict[str, float]:
        """Means over these objects, and the loss."""
        scene = made["warp"] if not isinstance(made["warp"], str) else made["synthesize"]
        built = {} if isinstance(scene, str) else {item.name: item for item in scene.objects}
        sizes, joints, masks, states = [], [], [], []
        for name in sorted(objects):
            item, track = built.get(name), made[f"segment/{name}"]
            record = None if item is None else record_of(item)
            sizes.append(100.0 if record is None else min(_value(extent_errors(self.truth[name], record), "extents"), 100.0))
            joints.append(0.0 if record is None else _right_joints(self.truth[name], record))
            states += [score.shown_right / max(score.shown, 1) for score in joint_scores(self.truth[name], record)]
            masks.append(0.0 if isinstance(track, str) else self._iou(name, track))
        figures = {
            "extents_percent": float(np.mean(sizes)),
            "mask_iou": float(np.mean(masks)),
            "joints": float(np.mean(joints)),
        }
        figures |= {"states": float(np.mean(states))} if states else {}
        figures |= {"proposals": self._proposed(made["propose"])} if self.proposes else {}
        figures["loss"] = figures["extents_percent"] + sum(100 * (1 - figures[key]) for key in SHARES if key in figures)
        return {key: round(value, 4) for key, value in figures.items()}

    def _proposed(self, proposals: Any) -> float:
        """F1 of the proposals, matched to visible true objects by mask IoU in the proposal's frame."""
        if isinstance(proposals, str):
            return 0.0
        found = [self._meant(proposal) for proposal in proposals]
        seen = [name for name in self.truth if any(self._shown(name, frame.index) for frame in self.capture.frames)]
        return 2 * len(set(found) - {None}) / max(len(found) + len(seen), 1)

    def _meant(self, proposal: Proposal) -> str | None:
        """The true object whose mask overlaps a proposal's own in its frame by an IoU of at least one half."""
        outline, frame = unpack_mask(proposal.outline), proposal.click.frame
        shown = {name: mask for name in self.truth if (mask := self.true_masks(name, frame)) is not None}
        return next((name for name, mask in shown.items() if mask_iou(mask, outline) >= PROPOSED_IOU), None)

    def _shown(self, name: str, frame: int) -> bool:
        mask = self.true_masks(name, frame)
        return mask is not None and np.count_nonzero(mask) >= MIN_TRUTH_PX

    def _iou(self, name: str, track: MaskTrack) -> float:
        overlaps = []
        for frame in self.capture.frames[::3]:
            true = self.true_masks(name, frame.index)
            if true is None or not self._shown(name, frame.index):
                continue
            found = track.masks.get(frame.index)
            overlaps.append(0.0 if found is None else mask_iou(true, unpack_mask(found)))
        return float(np.mean(overlaps)) if overlaps else 1.0


def _bytes(made: Any) -> bytes:
    return pickle.dumps(made)


def _value(metrics: Sequence[Any], name: str) -> float:
    return next(float(m.value) for m in metrics if m.name == name and m.value is not None)


def _right_joints(truth: ObjectRecord, found: ObjectRecord) -> float:
    """Fraction of joints of the right type, and of doors hinged on the right side."""
    values = [m.value for m in joint_errors(truth, found) if m.name in ("joint_type", "hinge_side") and m.value is not None]
    return float(np.mean(values)) if values else 1.0


def _differs(usual: Any, found: Any) -> bool:
    """Whether later steps could change: a mask, size or pose differs beyond the tolerance."""
    if isinstance(usual, str) or isinstance(found, str):
        return bool(usual != found)
    if isinstance(usual, MaskTrack):
        sizes = [_front_sizes(track) for track in (usual, found)]
        if (
            len(sizes[0]) != len(sizes[1])
            or not np.allclose(*sizes, rtol=0, atol=SAME_M)
            or set(usual.masks) != set(found.masks)
        ):
            return True
        overlaps = [mask_iou(unpack_mask(usual.masks[k]), unpack_mask(found.masks[k])) for k in usual.masks]
        return bool(np.mean(overlaps) < SAME_IOU)
    if isinstance(usual, CandidateSet):
        ends = [
            np.array([m.vertices.min(axis=0), m.vertices.max(axis=0)])
            for m in (usual.candidates[0].mesh, found.candidates[0].mesh)
        ]
        return not np.allclose(*ends, rtol=0, atol=SAME_M)
    return True


def _front_sizes(track: MaskTrack) -> list[float]:
    front = (
        [] if track.front is None else [track.front.width_m, track.front.height_m, *track.front.world_from_front.translation]
    )
    return front + ([] if track.box is None else [*track.box.dimensions_m, *track.box.world_from_object.translation])


def open_case(folder: Path, work: Path, frames: int, objects: int, proposes: bool) -> Case:
    """A recording, read and computed with the default parameters."""
    capture = read_capture(recording_in(folder), work / folder.name / "frames", IngestConfig(most_frames=frames))
    categories: dict[str, ObjectPrompt] = {}
    for prompt in clicked(folder, [frame.index for frame in capture.frames]).objects:
        categories.setdefault(prompt.category, prompt)
    kinds = sorted(categories.values(), key=lambda prompt: (_rank(prompt, categories.values()), prompt.name))
    prompts = {prompt.name: prompt for prompt in kinds[:objects]}
    truth = {item.name: item for item in read_truth(folder / "truth.json", capture.world_from_capture)}
    case = Case(folder.name, capture, prompts, truth, true_masks(folder), work / folder.name / "cache", proposes)
    case.settle()
    return case


def _rank(prompt: ObjectPrompt, prompts: Iterable[ObjectPrompt]) -> int:
    """Index among the prompts of the same kind, so that the first of every kind are sorted first."""
    kind = category_of(prompt.category).kind
    return [other.name for other in prompts if category_of(other.category).kind == kind].index(prompt.name)
