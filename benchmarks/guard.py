"""Accuracy guard: every object of 33 kitchens against the figures stored for it.

    python benchmarks/guard.py [KITCHEN...] [--workdir DIR] [--second PATH/make_kitchen.py] [--franka WHEEL] [--fast] [--update]

Kitchens: sample-0..4 (own clicks), second-100..104 and franka (random clicks), as-filmed-20, -21, as-filmed-second-105 and -106
(with the faults of real recordings), opened-ours-21 and opened-second-101 (filmed while fronts open) go through `r2c2r run`,
`check` and `evaluate`; for STYLE-120 and STYLE-121 only the edges of clicked fronts are measured. Each kitchen is drawn once
into DIR/KITCHEN; stages with unchanged code are read from there, so that a run after a change to one stage recomputes only that
stage and the later ones. --fast takes six kitchens up to the scene, from the masks that an earlier run stored, and leaves out
the measures that need masks or a bundle.

Exits 1 if an object is worse than in benchmarks/baseline.json by more than a measure's tolerance, if a previously found object
is missing, if a certificate is lost, or if a measure gets worse on significantly more objects than it gets better on (sign
test). --update stores the kitchens that were run.
"""

import argparse
import json
import sys
import time
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from kitchens import FAST, KITCHENS, Generators, drawn
from recordings import clicked_overlaps, random_clicks, record_of, recording_in, write_prompts
from scipy.stats import binomtest
from segment_fronts import clicks_on, opened, true_fronts, try_click
from whole_way import whole_way

from r2c2r_core.evaluate.records import read_truth
from r2c2r_core.evaluate.stage import compare_objects
from r2c2r_core.model.inputs import Prompts
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.workspace import Workspace

BASELINE = Path(__file__).resolve().parent / "baseline.json"
MEASURES = {  # smallest change of an object's figure that is reported; negative where larger is better
    **dict.fromkeys(("width_error", "depth_error", "height_error"), 0.5),  # %
    **dict.fromkeys(("centre", "front_centre", "pivot", "edge"), 3.0),  # mm
    "inner_depth": 2.0,  # mm
    "yaw": 0.3,  # deg
    **dict.fromkeys(("joint_type", "hinge_side", "limit_source"), -1e-6),  # fraction right
    "false_motion": 1e-6,  # joints
    **dict.fromkeys(("mask_iou", "mask_iou_open", "state"), -0.02),  # fraction
}
DRIFT_P = 0.01  # significance level of the one-sided sign test
USABLE_PERCENT = 5.0
Row = dict[str, float] | None  # figures by measure; None: the object is missing
Kitchen = dict[str, Any]  # certified: bool | None; objects: {name: Row}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the kitchens, print the regressions and a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchens", nargs="*", metavar="KITCHEN", help=f"one of {', '.join(KITCHENS)}")
    parser.add_argument("--workdir", type=Path, default=Path("build/guard"))
    parser.add_argument("--second", type=Path, help="the second generator's program; without it, its kitchens are left out")
    parser.add_argument("--franka", type=Path, help="the gymnasium-robotics wheel; without it, its kitchen is left out")
    parser.add_argument("--fast", action="store_true")
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    if unknown := sorted(set(options.kitchens) - set(KITCHENS)):
        parser.error(f"{unknown[0]}: no such kitchen; one of {', '.join(KITCHENS)}")
    stored: dict[str, Kitchen] = json.loads(BASELINE.read_text(encoding="utf-8")) if BASELINE.exists() else {}
    measured: dict[str, Kitchen] = {}
    for name in options.kitchens or (FAST if options.fast else KITCHENS):
        folder = drawn(name, options.workdir, Generators(options.second, options.franka))
        if folder is None:
            print(f"{name}: left out, its generator is not given", file=sys.stderr)
            continue
        started = time.monotonic()
        measured[name] = _measure(name, folder, fast=options.fast)
        print(summary(name, measured[name], time.monotonic() - started), flush=True)
    worse = regressions(measured, stored)
    for line in worse:
        print(f"worse: {line}")
    print(f"{len(measured)} kitchens, {sum(len(each['objects']) for each in measured.values())} objects, {len(worse)} worse")
    if options.update:
        BASELINE.write_text(_document(stored | measured), encoding="utf-8")
    return 1 if worse else 0


def regressions(measured: Mapping[str, Kitchen], stored: Mapping[str, Kitchen]) -> list[str]:
    """One line for every object, certificate and measure that became worse; figures missing on either side are not compared."""
    lines: list[str] = []
    changes: dict[str, list[float]] = {}
    for name, kitchen in measured.items():
        before = stored.get(name, {"certified": None, "objects": {}})
        if before["certified"] and kitchen["certified"] is False:
            lines.append(f"{name}: no certificate")
        for thing, old in before["objects"].items():
            new = kitchen["objects"].get(thing)
            if old is None:
                continue
            if new is None:
                lines.append(f"{name}/{thing}: missing")
                continue
            for measure in MEASURES.keys() & old.keys() & new.keys():
                change = (new[measure] - old[measure]) / MEASURES[measure]
                changes.setdefault(measure, []).append(change)
                if change > 1.0:
                    lines.append(f"{name}/{thing}: {measure} {new[measure]:g}, was {old[measure]:g}")
    return sorted(lines) + [line for measure, each in sorted(changes.items()) if (line := _drift(measure, each))]


def _drift(measure: str, changes: Sequence[float]) -> str | None:
    """A line if significantly more objects became worse than better; changes below a hundredth of the tolerance are ties."""
    worse, better = sum(change > 0.01 for change in changes), sum(change < -0.01 for change in changes)
    if worse + better == 0 or binomtest(worse, worse + better, alternative="greater").pvalue > DRIFT_P:
        return None
    return f"{measure}: worse on {worse} objects, better on {better}"


def summary(name: str, kitchen: Kitchen, seconds: float) -> str:
    """One line of figures. Usable: sizes within 5 %, joints of the true types and no others, edges within 10 mm."""
    rows: dict[str, Row] = kitchen["objects"]
    usable = sum(row is not None and _usable(row) for row in rows.values())
    wrong = ", ".join(thing for thing, row in rows.items() if row is None or not _usable(row))
    return f"{name}: {usable} of {len(rows)} usable, {seconds:.0f} s{'; not ' if wrong else ''}{wrong}"


def _usable(row: Mapping[str, float]) -> bool:
    sizes = all(row.get(f"{side}_error", 0.0) <= USABLE_PERCENT for side in ("width", "depth", "height"))
    return sizes and row.get("joint_type", 1.0) == row.get("hinge_side", 1.0) == 1.0 and row.get("edge", 0.0) <= 10.0


def _measure(name: str, folder: Path, *, fast: bool) -> Kitchen:
    if KITCHENS[name].edges_only:
        return {"certified": None, "objects": _front_edges(folder)}
    random = KITCHENS[name].random_clicks
    prompts = random_clicks(folder, np.random.default_rng(0)) if random else read_prompts(folder / "prompts.json")
    return _scene(folder, prompts) if fast else _bundle(folder, prompts, KITCHENS[name].run_options)


def _bundle(folder: Path, prompts: Prompts, run_options: Sequence[str]) -> Kitchen:
    """The bundle's figures for every clicked object."""
    work, clicks = folder / "run", folder / "clicks.json"
    write_prompts(prompts, clicks)
    outcome = whole_way(recording_in(folder), clicks, folder / "truth.json", work, anew=False, run_options=run_options)
    found = {} if outcome.evaluation is None else {item["name"]: item for item in outcome.evaluation["objects"]}
    matched = {name: item["matched"] for name, item in found.items() if item["matched"]}
    overlaps = clicked_overlaps(folder, prompts, work / "masks", matched)
    rows = {}
    for name, overlap in overlaps.items():
        metrics = {key: entry["value"] for key, entry in found[name]["metrics"].items()} if name in matched else {}
        rows[name] = _row(metrics | {"mask_iou": overlap}) if name in matched else None
    return {"certified": outcome.certified, "objects": rows}


def _scene(folder: Path, prompts: Prompts) -> Kitchen:
    """The scene's figures for every clicked object, without masks and without a bundle."""
    work, truth = Workspace(folder / "run" / "work"), folder / "truth.json"
    reconstruct(Request(source=recording_in(folder), prompts=prompts), work, until="warp", workers=0)
    scene, capture = work.load_latest("warp", "scene"), work.load_latest("ingest", "scene")
    built = tuple(record_of(item) for item in scene.objects)
    rows = compare_objects(read_truth(truth, capture.world_from_capture), built, truth.parent, None)
    asked = {prompt.name for prompt in prompts.objects}
    found = {row.name: row for row in rows if row.name in asked}
    metrics = {name: {each.name: each.value for each in row.metrics} for name, row in found.items()}
    return {"certified": None, "objects": {name: _row(metrics[name]) if row.matched else None for name, row in found.items()}}


def _front_edges(folder: Path) -> dict[str, Row]:
    """The worst edge error (mm) of every front, clicked once at a random place."""
    session, capture = opened(folder, folder / "work")
    rng = np.random.default_rng(zlib.crc32(folder.name.encode()))
    rows: dict[str, Row] = {}
    for front in true_fronts(folder / "truth.json", capture.world_from_capture):
        for click in clicks_on(session.scene, front, 1, rng):
            worst = try_click(session, front, click).worst_mm
            rows[front.name] = _row({"edge": worst}) if np.isfinite(worst) else None
    return rows


def _row(values: Mapping[str, float | None]) -> Row:
    return {key: round(float(value), 3) for key in MEASURES if (value := values.get(key)) is not None}


def _document(kitchens: Mapping[str, Kitchen]) -> str:
    """JSON with one line per object."""
    parts = []
    for name in sorted(kitchens):
        rows = ",\n".join(f"  {json.dumps(thing)}: {json.dumps(row)}" for thing, row in kitchens[name]["objects"].items())
        parts.append(f'{json.dumps(name)}: {{"certified": {json.dumps(kitchens[name]["certified"])}, "objects": {{\n{rows}}}}}')
    return "{" + ",\n".join(parts) + "}\n"


if __name__ == "__main__":
    sys.exit(main())
