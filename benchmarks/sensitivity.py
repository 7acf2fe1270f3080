"""Which tuned numbers matter: each is moved by a quarter either way, alone, and what comes out is compared with the truth.

    python benchmarks/sensitivity.py RECORDING... [--rooms synthesize,align] [--minutes 30] [--objects 6] [--frames 40]

A RECORDING is a folder with scan.r3d or capture.r3d, prompts.json, truth.json, and true masks (`r2c2r sample` writes one). A
first computation of one object of each kind writes down which numbers each step reads; a number is then moved, and only the
steps that read it, and what follows from a step that gave something else, are computed again. What nothing reads is listed as
such. Runs go on where an earlier one stopped (benchmarks/sensitivity.json) while the code and the recordings are the same;
--plot only draws docs/sensitivity.svg and docs/sensitivity.md again.

loss: mean error of the sizes in percent + 100 (1 - mean mask IoU) + 100 (1 - share of right joints); an object that is lost
counts as an error of 100 % without mask and joint.
"""

import argparse
import json
import math
import pickle
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.align.stage import AlignConfig, place_mesh
from r2c2r_core.errors import R2C2RError
from r2c2r_core.evaluate.extents import extent_errors
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.records import JointRecord, ObjectRecord, read_truth
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, Overrides
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.stage import SegmentConfig, open_session, track_object
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
ROOMS = ("synthesize", "warp", "align", "kitchen", "geometry", "generate", "segment")
MOVES = {"-25": 0.75, "+25": 1.25}
LEAST_TRUE_PX = 400
SHOWN = 40

Field = tuple[str, str, int | None]  # module, number, entry of a pair


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
class Case:
    """A recording with its truth, and what the usual numbers make of it, step by step."""

    name: str
    capture: Capture
    prompts: dict[str, ObjectPrompt]
    truth: dict[str, ObjectRecord]
    true_masks: Callable[[str, int], np.ndarray | None]
    cache: Path
    made: dict[str, Any] = field(default_factory=dict)
    read: dict[str, set[tuple[str, str]]] = field(default_factory=dict)

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

    def compute(self, step: str, made: Mapping[str, Any], cache: Path) -> Any:
        """The step's result; an R2C2RError or an error of the numbers is one, too."""
        stage, _, name = step.partition("/")
        try:
            return self._compute(stage, name, made, cache)
        except (R2C2RError, ValueError, ArithmeticError, LookupError, RuntimeError, cv2.error) as error:
            return f"{type(error).__name__}: {error}"

    def _compute(self, stage: str, name: str, made: Mapping[str, Any], cache: Path) -> Any:
        if any(isinstance(made[need], str) for need in self.needs(f"{stage}/{name}") if stage in ("generate", "align")):
            return "lost before"
        track, found = made.get(f"segment/{name}"), made.get(f"generate/{name}")
        if stage == "open":
            return open_session(self.capture, cache, "geometric", SegmentConfig())
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
            watch = Watch()
            with tuning(watch):
                self.made[step] = self.compute(step, self.made, self.cache)
            self.read[step] = watch.read

    def moved(self, of: type[Any], numbers: Any) -> dict[str, float]:
        """The figures with other numbers of one module; steps that did not read it, and saw nothing new, stay as they are."""
        name, changed_names = path_of(of), {f.name for f in fields(of) if getattr(numbers, f.name) != f.default}
        reads = {step: any((name, n) in self.read[step] for n in changed_names) for step in self.steps}
        made, new = dict(self.made), set()
        with tempfile.TemporaryDirectory(prefix="r2c2r-sensitivity-") as folder, tuning({of: numbers}):
            for step in self.steps:
                if not reads[step] and not new.intersection(self.needs(step)):
                    continue
                if step.startswith("segment/") and made["open"] is self.made["open"]:
                    made["open"] = self.compute("open", made, Path(folder))  # what it keeps was made with the usual numbers
                found = self.compute(step, made, Path(folder))
                if step == "open" or _bytes(found) != _bytes(self.made[step]):
                    made[step] = found
                    new.add(step)
        return self.figures(made)

    def figures(self, made: Mapping[str, Any]) -> dict[str, float]:
        """Means over the objects, and the loss."""
        scene = made["warp"] if not isinstance(made["warp"], str) else made["synthesize"]
        built = {} if isinstance(scene, str) else {item.name: item for item in scene.objects}
        sizes, joints, masks, corners = [], [], [], []
        for name in self.prompts:
            item, track = built.get(name), made[f"segment/{name}"]
            record = None if item is None else _record(item)
            sizes.append(100.0 if record is None else min(_value(extent_errors(self.truth[name], record), "extents"), 100.0))
            joints.append(0.0 if record is None else _right_joints(self.truth[name], record))
            masks.append(0.0 if isinstance(track, str) else self._iou(name, track))
            corners += [1000 * item.warp_residual_m] if item is not None and item.warp_residual_m is not None else []
        figures = {
            "extents_percent": float(np.mean(sizes)),
            "mask_iou": float(np.mean(masks)),
            "joints": float(np.mean(joints)),
            "corners_mm": float(np.mean(corners)) if corners else math.nan,
        }
        figures["loss"] = figures["extents_percent"] + 100 * (2 - figures["mask_iou"] - figures["joints"])
        return {key: round(value, 4) for key, value in figures.items() if not math.isnan(value)}

    def _iou(self, name: str, track: MaskTrack) -> float:
        overlaps = []
        for frame in self.capture.frames[::3]:
            true = self.true_masks(name, frame.index)
            if true is None or np.count_nonzero(true) < LEAST_TRUE_PX:
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


def _record(item: SceneObject) -> ObjectRecord:
    joints = tuple(
        JointRecord(
            name=joint.name,
            type=joint.type,
            axis=item.world_from_object.turn(joint.axis_object[None])[0],
            origin=item.world_from_object.apply(joint.origin_object[None])[0],
            lower=joint.lower,
            upper=joint.upper,
            limit_source="",
        )
        for joint in item.joints
    )
    return ObjectRecord(
        name=item.name,
        category=item.category,
        dimensions_m=item.dimensions_m,
        world_from_object=item.world_from_object,
        joints=joints,
    )


def open_case(folder: Path, work: Path, frames: int, objects: int) -> Case:
    """A recording, read and settled."""
    recording = next(path for name in ("scan.r3d", "capture.r3d") if (path := folder / name).exists())
    capture = read_capture(recording, work / folder.name / "frames", IngestConfig(most_frames=frames))
    kinds: dict[str, ObjectPrompt] = {}
    for prompt in read_prompts(folder / "prompts.json").objects:
        seen = {frame.index for frame in capture.frames}
        if all(point.frame in seen for point in prompt.points):
            kinds.setdefault(prompt.category, prompt)
    prompts = {prompt.name: prompt for prompt in list(kinds.values())[:objects]}
    truth = {item.name: item for item in read_truth(folder / "truth.json", capture.world_from_capture)}
    case = Case(folder.name, capture, prompts, truth, _true_masks(folder), work / folder.name / "cache")
    case.settle()
    return case


def _true_masks(folder: Path) -> Callable[[str, int], np.ndarray | None]:
    """Of the project's own samples (a folder an object) or of images of object numbers, in the order of truth.json."""
    own, numbers = folder / "truth_masks", folder / "masks"
    order = [item["name"] for item in json.loads((folder / "truth.json").read_text())["objects"]]

    @cache
    def read(path: Path) -> np.ndarray | None:
        return cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.exists() else None

    def mask(name: str, frame: int) -> np.ndarray | None:
        image = read(own / name / f"{frame:06d}.png" if own.exists() else numbers / f"{frame:06d}.png")
        if image is None:
            return None
        return np.asarray(image > 127) if own.exists() else np.asarray(image == order.index(name) + 1)

    return mask


def candidates_of(cases: Sequence[Case], rooms: Sequence[str]) -> list[Field]:
    """Every number that some step reads, entry by entry where it is a pair, room by room."""
    read = {entry for case in cases for entries in case.read.values() for entry in entries}
    found: list[Field] = []
    for room in rooms:
        for path, name in sorted(entry for entry in read if entry[0].partition(".")[0] == room):
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


def trial(cases: Sequence[Case], entry: Field) -> dict[str, Any]:
    """The figures with one number moved either way, means over the recordings."""
    path, name, _ = entry
    of = params_of(path)
    found: dict[str, Any] = {}
    for label, factor in MOVES.items():
        value = moved_value(entry, factor)
        if value == getattr(of(), name):
            continue
        numbers = replace(of(), **{name: value})
        found[label] = {"value": value, **_means([case.moved(of, numbers) for case in cases])}
    return found


def _means(each: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {key: round(float(np.mean([f[key] for f in each if key in f])), 4) for key in each[0]}


def main(arguments: Sequence[str] | None = None) -> int:
    """Move what is left to move, as long as there is time; write the figures after each, the plot and the table at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--objects", type=int, default=6)
    parser.add_argument("--frames", type=int, default=40)
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
    end, started = time.monotonic() + 60 * options.minutes, time.monotonic()
    cases = [open_case(folder, work, options.frames, options.objects) for folder in options.recordings]
    entries = candidates_of(cases, options.rooms.split(","))
    every = {(path, f.name) for room in ROOMS for path in modules_with_numbers(room) for f in fields(params_of(path))}
    read = {entry for case in cases for reads in case.read.values() for entry in reads}
    key = [source_key(*ROOMS, "ingest", "model"), options.frames, {case.name: sorted(case.prompts) for case in cases}]
    document = json.loads(options.json.read_text()) if options.json.exists() else {"runs": []}
    run = next((run for run in document["runs"] if run["key"] == key), {"key": key, "numbers": {}})
    document["runs"] = [other for other in document["runs"] if other["key"][1:] != key[1:]] + [run]  # of older code: anew
    run["usual"] = _means([case.figures(case.made) for case in cases])
    run["untouched"] = sorted(f"{path}.{name}" for path, name in every - read)
    run["read"] = len(entries)
    print(f"{time.monotonic() - started:.0f} s: {run['usual']}; {len(entries)} numbers read", flush=True)
    for entry in entries:
        name = f"{entry[0]}.{entry[1]}" + ("" if entry[2] is None else f"[{entry[2]}]")
        if time.monotonic() > end:
            break
        if name in run["numbers"]:
            continue
        try:
            run["numbers"][name] = trial(cases, entry)
        except Exception:  # a number that ends in a programming error is a finding of its own
            run["numbers"][name] = {"error": traceback.format_exc().splitlines()[-1]}
        options.json.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(name, json.dumps(run["numbers"][name]), file=sys.stderr, flush=True)


def effects(document: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """Number, change of the loss down and up, the mean over the runs that moved it; the largest first."""
    found: dict[str, list[list[float]]] = {}
    for run in document["runs"]:
        usual = run["usual"]["loss"]
        for name, moves in run["numbers"].items():
            if "error" not in moves:
                found.setdefault(name, []).append([moves[at]["loss"] - usual if at in moves else 0.0 for at in MOVES])
    means = {name: np.mean(changes, axis=0).round(4).tolist() for name, changes in found.items()}
    rows = [(name, down, up) for name, (down, up) in means.items()]
    return sorted(rows, key=lambda row: (-max(abs(row[1]), abs(row[2])), row[0]))


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
    rows = effects(document)
    still = sorted(name for name, down, up in rows if max(abs(down), abs(up)) == 0.0)
    untouched = sorted(set.intersection(*(set(run["untouched"]) for run in document["runs"])))
    lines = [
        "# Which numbers matter",
        "",
        "`benchmarks/sensitivity.py` moves each tuned number by a quarter either way, alone, and compares what comes out with",
        "the truth of the recordings below. The loss adds the mean error of the sizes in percent,",
        "100 (1 - mask IoU) and 100 (1 - share of right joints). Below 0 is better than as it is.",
        "",
        *(_run_line(run) for run in document["runs"]),
        "",
        "![Change of the loss by number](sensitivity.svg)",
        "",
        "| number | -25 % | +25 % |",
        "|---|---:|---:|",
        *(f"| `{name}` | {down:+.3f} | {up:+.3f} |" for name, down, up in rows[:SHOWN] if name not in still),
        "",
        f"## Moved without any effect ({len(still)})",
        "",
        "On sizes, masks and joints, that is: how much room boards and fronts leave shows in contacts, and how fine a mesh",
        "or a texture is in pictures, which are not scored here.",
        "",
        ", ".join(f"`{name}`" for name in still) or "none",
        "",
        f"## Not read by the steps that were repeated ({len(untouched)})",
        "",
        "Other kitchens, other recordings and other backends read them; those of `segment.runs` and `segment.planes`",
        "were read when the furniture runs were prepared, which the steps then found kept.",
        "",
        ", ".join(f"`{name}`" for name in untouched),
        "",
    ]
    return "\n".join(lines)


def _run_line(run: Mapping[str, Any]) -> str:
    usual, objects = run["usual"], run["key"][2]
    recordings = ", ".join(f"`{name}` ({', '.join(names)})" for name, names in objects.items())
    return (
        f"- {recordings}, {run['key'][1]} frames: {len(run['numbers'])} of the {run['read']} numbers that are read were moved. "
        f"With the usual ones the loss is {usual['loss']:.2f}: sizes {usual['extents_percent']:.2f} %, "
        f"mask IoU {usual['mask_iou']:.3f}, joints {usual['joints']:.3f}."
    )


if __name__ == "__main__":
    sys.exit(main())
