"""Which tuned numbers matter: each is moved by a quarter either way, alone, and what comes out is compared with the truth.

    python benchmarks/sensitivity.py RECORDING... [--rooms segment,generate] [--minutes 30] [--objects 6] [--frames 30]

A RECORDING is a folder with scan.r3d or capture.r3d, prompts.json, truth.json, and true masks (`r2c2r sample` writes one). A
first computation of one object of each category writes down which numbers each step and each furniture run reads. A number is
then moved on one object of each kind (front, appliance, thing) whose steps read it, and only these steps are computed again;
what follows is, where a mask's IoU with the usual one is below 0.995 or a size differs by half a millimetre. What nothing
reads is listed as such. Runs go on where an earlier one stopped (benchmarks/sensitivity.json) while the code and the recordings
are the same; several processes may share the work, by rooms or by recordings. --plot only draws docs/sensitivity.svg and
docs/sensitivity.md again.

loss: mean error of the sizes in percent + 100 (1 - mean mask IoU) + 100 (1 - share of right joints), of the objects moved; an
object that is lost counts as an error of 100 % without mask and joint.
"""

import argparse
import fcntl
import json
import math
import pickle
import sys
import tempfile
import time
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from recordings import TrueMask, clicked, record_of, recording_in, true_masks

from r2c2r_core.align.stage import AlignConfig, place_mesh
from r2c2r_core.errors import R2C2RError
from r2c2r_core.evaluate.extents import extent_errors
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, Overrides
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.planes import PlaneRegion, find_planes
from r2c2r_core.segment.runs.run import Run, make_run
from r2c2r_core.segment.scene import prepare_scene
from r2c2r_core.segment.stage import SegmentConfig, track_object
from r2c2r_core.sources import source_key
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.tuning import modules_with_numbers, params_of, path_of, tuning
from r2c2r_core.warp.stage import WarpConfig, fit_meshes

HERE = Path(__file__).resolve().parent
FIGURES, PLOT, TABLE = (
    HERE / "sensitivity.json",
    HERE.parent / "docs" / "sensitivity.svg",
    HERE.parent / "docs" / "sensitivity.md",
)
ROOMS = ("segment", "generate", "align", "kitchen", "geometry", "synthesize", "warp")
MOVES = {"-25": 0.75, "+25": 1.25}
SHOWN = 40
SAME_M, SAME_IOU = 0.0005, 0.995  # what follows is not computed again for less

BETTER = {
    "segment.appliances.faces.gap_m": "where frames look past a side, rather than the first hole in its depth",
    "segment.appliances.faces.patch_m": "the length over which this recording's depth errs alike",
    "segment.appliances.box.front_m": "the recording's depth noise",
    "segment.things.visual_hull.inside": "hull and cylinder both made, and the one kept that silhouettes agree with more",
    "segment.things.visual_hull.pose_share": "the same: a hull that fails by a hair becomes a cylinder",
    "segment.things.pixel_cut.smooth": "contrast across the borders that are sure in the same recording",
    "segment.planes.cell_m": "the spacing of the fused surface",
    "generate.lathe.bitten": "the likelihood of a profile under depth and masks, neck and body apart",
    "generate.consistency.judges": "every frame that sees the object, weighted by what it adds",
}
"""By number: the estimator that would stand in its place."""

Field = tuple[str, str, int | None]  # module, number, entry of a pair
Reads = set[tuple[str, str]]  # module, number


class Watch(Mapping[type, Any]):
    """Stands for the usual numbers, and writes down which are read."""

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
    """A session that stores nothing, and notes which numbers made each furniture run, so that a move keeps the others."""

    reads: dict[str, Reads] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set)
    noting: bool = True

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """The furniture run on a plane, and this far around it."""
        key = f"run{self.planes.index(region)}-{round(margin_m * 1000)}"
        self.asked.add(key)
        if key not in self._runs:
            watch = Watch()
            with tuning(watch) if self.noting else nullcontext():
                self._runs[key] = make_run(region, self.scene, self.config.cell_m, self.config.mosaic_frames, margin_m)
            self.reads[key] = watch.read
        return self._runs[key]

    def reading(self) -> Reads:
        """What the runs were made by that were asked for since the last time."""
        keys, self.asked = self.asked, set()
        return set().union(*(self.reads[key] for key in keys))

    def without(self, moved: Reads) -> "Session":
        """A session for moved numbers: the runs that they did not make are there."""
        runs = {key: run for key, run in self._runs.items() if not self.reads[key] & moved}
        return Session(self.scene, self.planes, self.config, self.folder, runs, noting=False)


@dataclass(slots=True, eq=False)
class Case:
    """A recording with its truth, and what the usual numbers make of it, step by step."""

    name: str
    capture: Capture
    prompts: dict[str, ObjectPrompt]
    truth: dict[str, ObjectRecord]
    true_masks: TrueMask
    folder: Path  # where nothing is left
    made: dict[str, Any] = field(default_factory=dict)
    read: dict[str, Reads] = field(default_factory=dict)

    @property
    def steps(self) -> list[str]:
        """In their order."""
        each = [f"{stage}/{name}" for stage in ("segment", "generate", "align") for name in self.prompts]
        return ["open", *each, "synthesize", "warp"]

    def needs(self, step: str) -> list[str]:
        """The steps that it is made from."""
        stage, _, name = step.partition("/")
        if stage == "segment":
            return ["open"]
        if stage == "generate":
            return [f"segment/{name}"]
        if stage == "align":
            return [f"segment/{name}", f"generate/{name}"]
        if stage == "synthesize":
            return [f"{s}/{n}" for n in self.prompts for s in ("segment", "generate", "align")]
        return ["synthesize", *self.needs("synthesize")] if stage == "warp" else []

    def compute(self, step: str, made: Mapping[str, Any]) -> Any:
        """The step's result; an R2C2RError or an error of the numbers is one, too."""
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
        if stage == "segment":
            return track_object(made["open"], self.prompts[name])
        if stage == "generate":
            return generate_candidates(self.capture, track, "completion", GenerateConfig(count=1))
        if stage == "align":
            return place_mesh(self.capture, track, found.candidates[0], "sift", AlignConfig())
        names = [n for n in self.prompts if not isinstance(made[f"align/{n}"], str)]
        tracks, placements = ([made[f"{s}/{n}"] for n in names] for s in ("segment", "align"))
        assets = [made[f"generate/{n}"].candidates[0] for n in names]
        if stage == "synthesize":
            return build_scene(self.capture, tracks, placements, assets, Overrides(objects={}), SynthesizeConfig())
        return fit_meshes(made["synthesize"], tracks, placements, assets, WarpConfig())

    def settle(self) -> None:
        """Compute every step with the usual numbers, and what it reads."""
        for step in self.steps:
            watch, started = Watch(), time.monotonic()
            with tuning(watch):
                self.made[step] = self.compute(step, self.made)
            self.read[step] = watch.read | (self.made["open"].reading() if step.startswith("segment/") else set())
            print(f"{step}: {time.monotonic() - started:.1f} s", file=sys.stderr, flush=True)

    def chosen(self, moved: Reads) -> frozenset[str]:
        """One object of each kind whose own steps read these numbers; every one where the whole scene does."""
        kinds: dict[str, str] = {}
        for name, prompt in self.prompts.items():
            if any(self.read[f"{stage}/{name}"] & moved for stage in ("segment", "generate", "align")):
                kinds.setdefault(category_of(prompt.category).kind, name)
        return frozenset(kinds.values()) or frozenset(self.prompts)

    def moved(self, of: type[Any], numbers: Any) -> dict[str, Any]:
        """The figures with other numbers of one module, what they were of the same objects, and the steps that gave another."""
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
                again = self.read[step] & changed or (stage == "segment" and self.read["open"] & changed)
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
        sizes, joints, masks = [], [], []
        for name in sorted(objects):
            item, track = built.get(name), made[f"segment/{name}"]
            record = None if item is None else record_of(item)
            sizes.append(100.0 if record is None else min(_value(extent_errors(self.truth[name], record), "extents"), 100.0))
            joints.append(0.0 if record is None else _right_joints(self.truth[name], record))
            masks.append(0.0 if isinstance(track, str) else self._iou(name, track))
        figures = {
            "extents_percent": float(np.mean(sizes)),
            "mask_iou": float(np.mean(masks)),
            "joints": float(np.mean(joints)),
        }
        figures["loss"] = figures["extents_percent"] + 100 * (2 - figures["mask_iou"] - figures["joints"])
        return {key: round(value, 4) for key, value in figures.items()}

    def _iou(self, name: str, track: MaskTrack) -> float:
        overlaps = []
        for frame in self.capture.frames[::3]:
            true = self.true_masks(name, frame.index)
            if true is None or np.count_nonzero(true) < MIN_TRUTH_PX:
                continue
            found = track.masks.get(frame.index)
            overlaps.append(0.0 if found is None else mask_iou(true, unpack_mask(found)))
        return float(np.mean(overlaps)) if overlaps else 1.0


def _bytes(made: Any) -> bytes:
    return pickle.dumps(made)


def _value(metrics: Sequence[Any], name: str) -> float:
    return next(float(m.value) for m in metrics if m.name == name and m.value is not None)


def _right_joints(truth: ObjectRecord, found: ObjectRecord) -> float:
    """The share of joints of the right type, and of doors hinged on the right side."""
    values = [m.value for m in joint_errors(truth, found) if m.name in ("joint_type", "hinge_side") and m.value is not None]
    return float(np.mean(values)) if values else 1.0


def _differs(usual: Any, found: Any) -> bool:
    """Whether what follows could change: another mask, size or pose."""
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


def open_case(folder: Path, work: Path, frames: int, objects: int) -> Case:
    """A recording, read and settled."""
    capture = read_capture(recording_in(folder), work / folder.name / "frames", IngestConfig(most_frames=frames))
    categories: dict[str, ObjectPrompt] = {}
    for prompt in clicked(folder, [frame.index for frame in capture.frames]).objects:
        categories.setdefault(prompt.category, prompt)
    kinds = sorted(categories.values(), key=lambda prompt: (_rank(prompt, categories.values()), prompt.name))
    prompts = {prompt.name: prompt for prompt in kinds[:objects]}
    truth = {item.name: item for item in read_truth(folder / "truth.json", capture.world_from_capture)}
    case = Case(folder.name, capture, prompts, truth, true_masks(folder), work / folder.name / "cache")
    case.settle()
    return case


def _rank(prompt: ObjectPrompt, prompts: Iterable[ObjectPrompt]) -> int:
    """Its place among the prompts of its kind: the first of every kind come first."""
    kind = category_of(prompt.category).kind
    return [other.name for other in prompts if category_of(other.category).kind == kind].index(prompt.name)


def candidates_of(case: Case, rooms: Sequence[str]) -> list[Field]:
    """Every number that some step reads, entry by entry where it is a pair, room by room (or module by module)."""
    read = {entry for entries in case.read.values() for entry in entries}
    found: list[Field] = []
    for room in rooms:
        for path, name in sorted(entry for entry in read if f"{entry[0]}.".startswith(f"{room}.")):
            default = next(f.default for f in fields(params_of(path)) if f.name == name)
            pair = isinstance(default, tuple) and len(default) == 2
            found += [(path, name, k) for k in (0, 1)] if pair else [(path, name, None)]
    return found


def moved_value(entry: Field, factor: float) -> Any:
    """The number a quarter away, within its bounds; a cosine by its angle, a count by at least one."""
    path, name, k = entry
    described = next(f for f in fields(params_of(path)) if f.name == name)
    unit, rules = described.metadata["json_schema_extra"]["unit"], described.metadata

    def one(value: Any) -> Any:
        if unit == "cosine":
            return math.cos(min(math.acos(value) / factor, math.pi / 2))
        if isinstance(value, int):
            step = round(value * factor) - value
            return max(value + (step or (1 if factor > 1 else -1)), 0 if value >= 0 else value * 2)
        return value * factor

    default = described.default
    if isinstance(default, tuple):
        return tuple(one(v) if k in (None, i) else v for i, v in enumerate(default))
    value = one(default)
    if value >= rules.get("lt", math.inf) or value <= rules.get("gt", -math.inf):
        value = (default + rules["lt" if factor > 1 else "gt"]) / 2
    return type(default)(min(max(value, rules.get("ge", value)), rules.get("le", value)))


def trial(case: Case, entry: Field) -> dict[str, Any]:
    """The figures with one number moved either way."""
    path, name, _ = entry
    of = params_of(path)
    found: dict[str, Any] = {}
    for label, factor in MOVES.items():
        value = moved_value(entry, factor)
        if value != getattr(of(), name):
            found[label] = {"value": value, **case.moved(of, replace(of(), **{name: value}))}
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Move what is left to move, as long as there is time; write the figures after each, the plot and the table at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--objects", type=int, default=6)
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--workdir", type=Path)
    parser.add_argument("--json", type=Path, default=FIGURES)
    parser.add_argument("--plot", action="store_true")
    options = parser.parse_args(arguments)
    if not options.plot:
        with tempfile.TemporaryDirectory(prefix="r2c2r-sensitivity-") as scratch:
            _measure(options, options.workdir or Path(scratch))
    document = json.loads(options.json.read_text())
    PLOT.write_text(tornado(document), encoding="utf-8")
    TABLE.write_text(table(document), encoding="utf-8")
    return 0


def _measure(options: argparse.Namespace, work: Path) -> None:
    end = time.monotonic() + 60 * options.minutes
    for number, folder in enumerate(options.recordings):
        share = (end - time.monotonic()) / (len(options.recordings) - number)
        _measure_case(open_case(folder, work, options.frames, options.objects), options, time.monotonic() + share)


def _measure_case(case: Case, options: argparse.Namespace, end: float) -> None:
    every = {(path, f.name) for room in ROOMS for path in modules_with_numbers(room) for f in fields(params_of(path))}
    read = {entry for reads in case.read.values() for entry in reads}
    key = [source_key(*ROOMS, "ingest", "model"), options.frames, case.name, sorted(case.prompts)]
    said = {
        "usual": case.figures(case.made, frozenset(case.prompts)),
        "untouched": sorted(f"{path}.{name}" for path, name in every - read),
        "read": len(candidates_of(case, ROOMS)),
    }
    done = _add(options.json, key, said, {})
    still = same_everywhere(json.loads(options.json.read_text()))
    print(f"{case.name}: {said['usual']}; {said['read']} numbers read", flush=True)
    entries = {_name(entry): entry for entry in candidates_of(case, options.rooms.split(","))}
    for name, entry in sorted(entries.items(), key=lambda item: item[0] not in still):  # what did nothing elsewhere first
        if time.monotonic() > end:
            break
        if name in done:
            continue
        started = time.monotonic()
        try:
            found = trial(case, entry)
        except Exception:  # a number that ends in a programming error is a finding of its own
            found = {"error": traceback.format_exc().splitlines()[-1]}
        _add(options.json, key, said, {name: found})
        print(f"{time.monotonic() - started:.0f} s {name} {json.dumps(found)}", file=sys.stderr, flush=True)


def _text(runs: Sequence[Mapping[str, Any]]) -> str:
    """JSON with a line for each number."""
    written = []
    for run in runs:
        numbers = ",\n".join(f"{json.dumps(name)}: {json.dumps(moves)}" for name, moves in run["numbers"].items())
        head = json.dumps({key: value for key, value in run.items() if key != "numbers"})
        written.append(f'{head[:-1]}, "numbers": {{\n{numbers}\n}}}}')
    return '{"runs": [\n' + ",\n".join(written) + "\n]}\n"


def _name(entry: Field) -> str:
    return f"{entry[0]}.{entry[1]}" + ("" if entry[2] is None else f"[{entry[2]}]")


def _add(path: Path, key: list[Any], said: Mapping[str, Any], numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers moved so far, with these; another process may be at work on the same file."""
    with Path(__file__).open() as alone:
        fcntl.flock(alone, fcntl.LOCK_EX)
        runs = json.loads(path.read_text())["runs"] if path.exists() else []
        run = next((run for run in runs if run["key"] == key), {"key": key, "numbers": {}})
        run |= {**said, "numbers": run["numbers"] | numbers}
        rest = [other for other in runs if other["key"][2:] != key[2:]]  # of older code: anew
        path.write_text(_text([*rest, run]), encoding="utf-8")
    return dict(run["numbers"])


def effects(document: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """Number, change of the loss down and up, the mean over the runs that moved it; the largest first."""
    found: dict[str, list[list[float]]] = {}
    for run in document["runs"]:
        for name, moves in run["numbers"].items():
            if "error" not in moves:
                found.setdefault(name, []).append(
                    [moves[at]["loss"] - moves[at]["before"] if at in moves else 0.0 for at in MOVES]
                )
    means = {name: np.mean(changes, axis=0).round(4).tolist() for name, changes in found.items()}
    rows = [(name, down, up) for name, (down, up) in means.items()]
    return sorted(rows, key=lambda row: (-max(abs(row[1]), abs(row[2])), row[0]))


def same_everywhere(document: Mapping[str, Any]) -> set[str]:
    """Numbers whose moves changed not a byte of any step of any run that moved them."""
    moved = [(name, moves) for run in document["runs"] for name, moves in run["numbers"].items()]
    other = {name for name, moves in moved if "error" in moves or any(move["changed"] for move in moves.values())}
    return {name for name, _ in moved} - other


def tornado(document: Mapping[str, Any]) -> str:
    """The largest effects as bars to either side of the usual loss, SVG."""
    rows = [row for row in effects(document)[:SHOWN] if max(map(abs, row[1:])) > 0]
    most = max((abs(v) for row in rows for v in row[1:]), default=1.0) or 1.0
    height, middle, reach = 18, 560, 220
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="820" height="{height * (len(rows) + 3)}" '
        'font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="white"/>',
        '<text x="10" y="14">change of the loss when a number moves by -25 % (blue) and +25 % (orange)</text>',
    ]
    for position, (name, down, up) in enumerate(rows):
        y = height * (position + 1.6)
        lines.append(f'<text x="{middle - reach - 10}" y="{y + 10:.0f}" text-anchor="end">{name}</text>')
        for value, colour, offset in ((down, "#2166d6", 0), (up, "#ef7820", 6)):
            width = abs(value) / most * reach
            x = middle if value >= 0 else middle - width
            lines.append(f'<rect x="{x:.1f}" y="{y + offset:.0f}" width="{max(width, 0.5):.1f}" height="6" fill="{colour}"/>')
    foot = height * (len(rows) + 2.2)
    lines.append(f'<line x1="{middle}" y1="24" x2="{middle}" y2="{foot - 8:.0f}" stroke="black" stroke-width="0.5"/>')
    for share in (-1.0, 0.0, 1.0):
        lines.append(
            f'<text x="{middle + share * reach:.0f}" y="{foot + 6:.0f}" text-anchor="middle">{share * most:+.2f}</text>'
        )
    return "\n".join([*lines, "</svg>", ""])


def table(document: Mapping[str, Any]) -> str:
    """The page of the documentation."""
    rows, same = [row for row in effects(document) if _stands(row[0])], set(filter(_stands, same_everywhere(document)))
    still = sorted(name for name, down, up in rows if max(abs(down), abs(up)) == 0.0 and name not in same)
    untouched = sorted(filter(_stands, set.intersection(*(set(run["untouched"]) for run in document["runs"]))))
    broken = sorted({name for run in document["runs"] for name, moves in run["numbers"].items() if "error" in moves})
    return "\n".join(
        [
            "# Which numbers matter",
            "",
            "`benchmarks/sensitivity.py` moves each tuned number by a quarter either way, alone, on one object of each kind",
            "whose steps read it, and compares what comes out with the truth of the recordings below. The loss adds the mean",
            "error of the sizes in percent, 100 (1 - mask IoU) and 100 (1 - share of right joints). Below 0 is better than as",
            "it is.",
            "",
            *(_run_line(run) for run in document["runs"]),
            "",
            "![Change of the loss by number](sensitivity.svg)",
            "",
            "| number | -25 % | +25 % | what would estimate it |",
            "|---|---:|---:|---|",
            *(
                f"| `{name}` | {down:+.3f} | {up:+.3f} | {BETTER.get(name.partition('[')[0], '')} |"
                for name, down, up in rows[:SHOWN]
                if max(abs(down), abs(up)) > 0.0
            ),
            "",
            f"## Moved, and not a byte of any step was another ({len(same)})",
            "",
            _listed(sorted(same)),
            "",
            f"## Moved without effect on sizes, masks and joints ({len(still)})",
            "",
            "How much room boards and fronts leave shows in contacts, and how fine a mesh or a texture is in pictures, which",
            "are not scored here.",
            "",
            _listed(still),
            "",
            *([f"## Ended in an error ({len(broken)})", "", _listed(broken), ""] if broken else []),
            f"## Not read by the steps that were repeated ({len(untouched)})",
            "",
            "Other kitchens, other recordings and other backends read them.",
            "",
            _listed(untouched),
            "",
        ]
    )


def _stands(name: str) -> bool:
    """Whether the code still has the number; a run tells what it moved, also of what is gone since."""
    path, _, number = name.partition("[")[0].rpartition(".")
    return path in modules_with_numbers(path.partition(".")[0]) and number in {f.name for f in fields(params_of(path))}


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "none"


def _run_line(run: Mapping[str, Any]) -> str:
    (source, frames, recording, objects), usual = run["key"], run["usual"]
    return (
        f"- `{recording}` ({', '.join(objects)}), {frames} frames, code {source[:8]}: {len(run['numbers'])} of the "
        f"{run['read']} numbers that are read were moved. With the usual ones the loss is {usual['loss']:.2f}: sizes "
        f"{usual['extents_percent']:.2f} %, mask IoU {usual['mask_iou']:.3f}, joints {usual['joints']:.3f}."
    )


if __name__ == "__main__":
    sys.exit(main())
