"""Accuracy of joints in ten kitchens of two generators, filmed while fronts are opened, from one click per object.

    python benchmarks/opened.py --second PATH/make_kitchen.py --workdir DIR [--only ours-27 second-106] [--frames F]
                                [--size WxH] [--again] [--json FILE]

Each kitchen is drawn into DIR/<name> and taken through `r2c2r run`, `check` and `evaluate`; existing results are kept, so that
a run resumes where it stopped, and --again reconstructs them. A joint counts once; "state unknown" is a miss, and so is every
figure of a joint that is missing or of another type. DIR/opened.md has one line per kitchen, the total against the bars, and
the errors of axes and pivots by the definitions of other papers (joint_definitions.py).
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joint_definitions import Line, definitions
from whole_way import CLI, whole_way

from r2c2r_core.evaluate.joints import pair_joints
from r2c2r_core.evaluate.motions import JointScore, false_motions, joint_scores
from r2c2r_core.evaluate.records import read_bundle, read_truth
from r2c2r_core.evaluate.stage import match_objects

OURS = {
    "ours-21": (21, "straight"),
    "ours-22": (22, "l"),
    "ours-23": (23, "galley"),
    "ours-24": (24, "island"),
    "ours-25": (25, "galley"),
    "ours-26": (26, "l"),
    "ours-27": (27, "straight"),
    "ours-28": (28, "island"),
}
SECOND = {f"second-{seed}": seed for seed in range(100, 108)}
FURTHER = ("ours-26", "ours-27", "ours-28", "second-105", "second-106", "second-107")
"""Drawn only on request: the other ten have been looked at while the code was written."""
_HERE = Path(__file__).resolve().parent
Rows = dict[str, dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """A required bound of one figure, over all joints of all kitchens."""

    title: str
    limit: float
    unit: str
    at_least: bool = False

    def line(self, value: float | None) -> str:
        """A row of the table of totals."""
        met = value is not None and (value >= self.limit if self.at_least else value <= self.limit)
        sign = "≥" if self.at_least else "≤"
        return f"| {self.title} | {_cell(value)} | {sign} {self.limit:g} {self.unit} | {'yes' if met else 'no'} |"


BARS = {
    "type": Bar(title="joint type", limit=100, unit="%", at_least=True),
    "axis_median": Bar(title="axis, median", limit=0.5, unit="deg"),
    "axis_worst": Bar(title="axis, worst", limit=1.5, unit="deg"),
    "pivot_median": Bar(title="pivot, median", limit=5, unit="mm"),
    "pivot_worst": Bar(title="pivot, worst", limit=12, unit="mm"),
    "states": Bar(title="states within 2° or 6 mm, of frames that show the front", limit=95, unit="%", at_least=True),
    "states_open": Bar(title="the same, of those in which it stands open", limit=95, unit="%", at_least=True),
    "limits": Bar(title="limits at least as wide as filmed", limit=100, unit="%", at_least=True),
    "depth_worst": Bar(title="inner depth of drawers, worst", limit=10, unit="mm"),
    "depth_seen": Bar(title="drawers whose inner depth is known", limit=100, unit="%", at_least=True),
    "masks_open": Bar(title="masks in open frames", limit=0.85, unit="IoU", at_least=True),
    "false": Bar(title="joints said to move that did not", limit=0, unit=""),
    "hinges_filmed": Bar(title="hinge sides of what was filmed while it opened", limit=100, unit="%", at_least=True),
    "joints": Bar(title="joints opened", limit=40, unit="", at_least=True),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw, reconstruct and score the missing kitchens; print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--second", type=Path, help="the second generator's program; without it, only the project's own kitchens"
    )
    parser.add_argument("--workdir", type=Path, required=True)
    parser.add_argument("--only", nargs="+", choices=[*OURS, *SECOND])
    parser.add_argument("--frames", type=int, default=240)
    parser.add_argument("--size", default="960x720")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    names = options.only or [name for name in (*OURS, *(SECOND if options.second else ())) if name not in FURTHER]
    rows: Rows = {}
    for name in names:
        folder = options.workdir / name
        draw(folder, name, options.second, options.frames, options.size)
        rows[name] = measured(folder, again=options.again)
        (options.workdir / "opened.md").write_text(tables(rows), encoding="utf-8")
        print(line(name, rows[name]), flush=True)
    print("\n" + tables(rows))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def draw(folder: Path, name: str, second: Path | None, frames: int, size: str) -> None:
    """Draw the recording of that name if it is missing."""
    if (folder / "prompts.json").exists():
        return
    shape = ["--frames", str(frames), "--size", size]
    if name in OURS:
        seed, layout = OURS[name]
        command = [*CLI, "sample", str(folder), "--opened", "--seed", str(seed), "--layout", layout, *shape]
    else:
        if second is None:
            raise SystemExit(f"{name}: give --second PATH/make_kitchen.py")
        command = [
            sys.executable,
            str(_HERE / "second_opened.py"),
            str(second),
            str(folder),
            "--seed",
            str(SECOND[name]),
            *shape,
        ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=_HERE.parent)


def measured(folder: Path, *, again: bool) -> dict[str, Any]:
    """Every joint's score, with the figures of the whole bundle."""
    recording = next(folder.glob("*.r3d"))
    bundle, work = folder / "run" / "bundle.zip", folder / "run"
    if again or not (work / "evaluation.json").exists():
        whole_way(recording, folder / "prompts.json", folder / "truth.json", work)
    truths = read_truth(folder / "truth.json", read_bundle(bundle).world_from_capture) if bundle.exists() else ()
    found = match_objects(truths, read_bundle(bundle).objects) if bundle.exists() else []
    scores: list[dict[str, Any]] = []
    others: list[dict[str, float]] = []
    false = 0.0
    for true, thing in zip(truths, found, strict=True):
        scores += [asdict(score) for score in joint_scores(true, thing)]
        false += (false_motions(true, thing) or 0.0) if thing is not None else 0.0
        pairs = pair_joints(true.joints, thing.joints) if thing is not None else []
        others += [
            definitions(Line(origin=a.origin, axis=a.axis), Line(origin=b.origin, axis=b.axis))
            for a, b in pairs
            if b is not None and a.type == b.type == "revolute" and a.motion is not None and a.motion.opens
        ]
    evaluation = json.loads((work / "evaluation.json").read_text(encoding="utf-8")) if bundle.exists() else {"objects": []}
    masks = [entry["metrics"].get("mask_iou_open", {}).get("value") for entry in evaluation["objects"]]
    sides = {entry["name"]: entry["metrics"].get("hinge_side", {}).get("value") for entry in evaluation["objects"]}
    filmed = {true.name for true in truths if any(joint.motion is not None and joint.motion.opens for joint in true.joints)}
    return {
        "bundle": bundle.exists(),
        "scores": scores,
        "masks_open": [value for value in masks if value is not None],
        "false": false,
        "hinges_filmed": [value for name, value in sides.items() if value is not None and name in filmed],
        "hinges_closed": [value for name, value in sides.items() if value is not None and name not in filmed],
        "others": others,
    }


def figures(rows: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    """The figures of the bars over all joints of the given kitchens."""
    scores = [JointScore(**score) for row in rows for score in row["scores"]]
    axes = [score.axis_deg for score in scores if score.axis_deg is not None]
    pivots = [score.pivot_mm for score in scores if score.pivot_mm is not None]
    drawers = [score for score in scores if score.type == "prismatic"]
    depths = [abs(score.inner_depth_mm) for score in drawers if score.inner_depth_mm is not None]
    masks = [value for row in rows for value in row["masks_open"]]
    return {
        "joints": float(len(scores)),
        "type": _percent([score.type_right for score in scores]),
        "axis_median": float(np.median(axes)) if axes else None,
        "axis_worst": max(axes, default=None),
        "pivot_median": float(np.median(pivots)) if pivots else None,
        "pivot_worst": max(pivots, default=None),
        "states": _ratio(sum(s.shown_right for s in scores), sum(s.shown for s in scores)),
        "states_open": _ratio(sum(s.open_right for s in scores), sum(s.open_shown for s in scores)),
        "limits": _percent([score.limit_right for score in scores]),
        "depth_worst": max(depths, default=None),
        "depth_seen": _ratio(len(depths), len(drawers)),
        "masks_open": float(np.mean(masks)) if masks else None,
        "false": sum(row["false"] for row in rows),
        **{key: _percent([side for row in rows for side in row[key]]) for key in ("hinges_filmed", "hinges_closed")},
    }


def tables(rows: Rows) -> str:
    """One line per kitchen, the total against the bars, and the other definitions."""
    head = "| kitchen | " + " | ".join(BARS) + " |\n|---" + "|---" * len(BARS) + "|"
    body = [line(name, row) for name, row in rows.items()]
    total = figures(list(rows.values()))
    bars = ["| of all joints | found | bar | met |", "|---|---|---|---|", *(bar.line(total[key]) for key, bar in BARS.items())]
    sides = f"Hinge sides of what stayed closed, a quarter with its handle beside the hinge: {_cell(total['hinges_closed'])} %."
    return "\n".join([head, *body, line("total", *rows.values()), "", *bars, "", sides, "", *_others(rows), ""])


def line(name: str, *rows: dict[str, Any]) -> str:
    """A table row of one kitchen, or of all."""
    values = figures(rows)
    return f"| {name} | " + " | ".join(_cell(values[key]) for key in BARS) + " |"


def _others(rows: Rows) -> list[str]:
    """Median and worst error by each definition over the revolute joints, and how many have none."""
    each = [entry for row in rows.values() for entry in row["others"]]
    if not each:
        return ["No revolute joint was found of those that open."]
    lines = ["| definition | median | worst | undefined |", "|---|---|---|---|"]
    for name in each[0]:
        values = np.array([entry[name] for entry in each], float)
        there = values[np.isfinite(values)]
        median, worst = (f"{np.median(there):.3g}", f"{there.max():.3g}") if len(there) else ("-", "-")
        lines.append(f"| {name} | {median} | {worst} | {len(values) - len(there)} of {len(values)} |")
    return lines


def _percent(values: Sequence[float | None]) -> float | None:
    return 100 * float(np.mean(np.array(values, float))) if values else None


def _ratio(part: float, whole: float) -> float | None:
    return 100 * part / whole if whole else None


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main())
