"""Fraction of usable objects in kitchens not drawn for this project, from one random click per object.

    python benchmarks/unseen.py FOLDER... [--workdir DIR] [--json benchmarks/unseen.json] [--seed N] [--preset NAME]

A FOLDER holds capture.r3d or scan.r3d, truth.json and masks/NNNNNN.png (number of the object in truth.json + 1), as
second_styles.py, franka.py and replicacad.py write them, or is a sample of `r2c2r sample`. Clicks are those of
`recordings.random_clicks`, with the seed.

Usable: every extent within 5 %, the joint of the right type, hinged on the right side. A missing object counts as wrong in
every mean: its size by 100 %, its joint, its whole mask. Joint figures are over the objects that have joints. Rows are added to
the JSON file by the folder's name, each as soon as it is known.
"""

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from recordings import clicked_overlaps, random_clicks, recording_in, write_prompts
from whole_way import Outcome, whole_way

from r2c2r_core.kitchen.names import category_of

USABLE_PERCENT, FAR_OFF_PERCENT = 5.0, 10.0
_SIDES = ("width_error", "depth_error", "height_error")
_HEIGHTS = ("bottle", "wall_cabinet")  # categories whose height has a separate bound


def main(arguments: Sequence[str] | None = None) -> int:
    """Run each folder and print the table."""
    parser = argparse.ArgumentParser(description="Objects of unseen kitchens that come out usable.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--workdir", type=Path, help="kept afterwards")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--seed", type=int, default=0, help="seed of the clicks")
    parser.add_argument("--preset", default="default", help="settings of `r2c2r run`")
    options = parser.parse_args(arguments)
    rows: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory(prefix="r2c2r-unseen-") as scratch:
        for folder in options.folders:
            print(f"{folder.name} …", file=sys.stderr, flush=True)
            work = (options.workdir or Path(scratch)) / folder.name
            rows[folder.name] = run_folder(folder, work, options.seed, options.preset)
            if options.json:
                before = json.loads(options.json.read_text(encoding="utf-8")) if options.json.exists() else {}
                options.json.write_text(json.dumps(before | rows, indent=1) + "\n", encoding="utf-8")
    print(table(rows))
    return 0


def run_folder(folder: Path, work: Path, seed: int, preset: str) -> dict[str, Any]:
    """One kitchen from random clicks to its figures; the masks in `work`/masks are compared with the true ones."""
    prompts, clicks = random_clicks(folder, np.random.default_rng(seed)), work.parent / f"{work.name}.prompts.json"
    clicks.parent.mkdir(parents=True, exist_ok=True)
    write_prompts(prompts, clicks)
    outcome = whole_way(recording_in(folder), clicks, folder / "truth.json", work, preset=preset)
    found = {} if outcome.evaluation is None else {item["name"]: item for item in outcome.evaluation["objects"]}
    overlaps = clicked_overlaps(folder, prompts, work / "masks", {name: item["matched"] for name, item in found.items()})
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["objects"]
    return row_of(outcome, [item for item in truth if item["name"] in overlaps], overlaps)


def row_of(outcome: Outcome, truth: Sequence[dict[str, Any]], overlaps: dict[str, float]) -> dict[str, Any]:
    """The figures of one kitchen; `truth` are the clicked objects of truth.json, `overlaps` the IoU of their masks."""
    found = {} if outcome.evaluation is None else {item["name"]: item["metrics"] for item in outcome.evaluation["objects"]}
    errors = {item["name"]: extents_of(found.get(item["name"], {})) for item in truth}
    largest = {name: max(sides) for name, sides in errors.items()}
    joints = {item["name"]: joint_right(found.get(item["name"], {})) for item in truth if item["joint"]}
    usable = [name for name in errors if largest[name] <= USABLE_PERCENT and joints.get(name, True)]
    named = {name for name in errors if name in outcome.doubted or name not in outcome.present}  # missing: reported
    wrong = [name for name in errors if name not in usable]
    category = {item["name"]: item["category"] for item in truth}
    return {
        "objects": len(errors),
        "usable": len(usable),
        "usable_percent": round(100 * len(usable) / len(errors), 1),
        "median_percent": round(statistics.median(largest.values()), 2),
        "worst_percent": round(max(largest.values()), 1),
        "mean_extents_percent": _mean(float(np.mean(sides)) for sides in errors.values()),
        "box_iou": _mean(_value(found.get(name, {}), "box_iou") or 0.0 for name in errors),
        "joints_right": f"{sum(joints.values())} of {len(joints)}",
        "mask_iou": {
            kind: _mean(overlaps[name] for name in errors if kind_of(category[name]) == kind)
            for kind in sorted({kind_of(category[name]) for name in errors})
        },
        "worst_height_percent": {
            each: round(max(errors[name][2] for name in errors if category[name] == each), 1)
            for each in _HEIGHTS
            if each in category.values()
        },
        "far_off": [name for name in errors if largest[name] > FAR_OFF_PERCENT],
        "certified": outcome.certified,
        "wrong_flagged": f"{len(named.intersection(wrong))} of {len(wrong)}",
        "right_flagged": f"{len(named.intersection(usable))} of {len(usable)}",
        "cpu_minutes": round(outcome.cost.cpu_s / 60, 1),
        "seconds": round(outcome.cost.wall_s),
        "wrong": {name: _failing(errors[name], joints.get(name, True)) for name in wrong},
    }


def kind_of(category: str) -> str:
    """The kind of a category: front, appliance or thing."""
    known = category_of(category)
    return "thing" if known is None else known.kind


def extents_of(metrics: dict[str, Any]) -> list[float]:
    """Errors of width, depth and height in percent; 100 if the object is missing."""
    return [100.0 if (value := _value(metrics, name)) is None else value for name in _SIDES]


def joint_right(metrics: dict[str, Any]) -> bool:
    """Whether the joint's type and hinge side are right; False if it is missing."""
    return _value(metrics, "joint_type") == 1.0 and _value(metrics, "hinge_side") in (None, 1.0)


def _failing(sides: list[float], right: bool) -> str:
    """The extents beyond the bound, with the names that people use, and the joint if it is wrong."""
    words = [f"{name[0]} {error:.0f}" for name, error in zip(_SIDES, sides, strict=True) if error > USABLE_PERCENT]
    return " ".join([*words, *([] if right else ["joint"])])


def _mean(values: Iterable[float]) -> float | None:
    listed = list(values)
    return round(statistics.fmean(listed), 3) if listed else None


def _value(metrics: dict[str, Any], name: str) -> float | None:
    value = metrics.get(name, {}).get("value")
    return None if value is None else float(value)


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown table; w, d and h are width, depth and height in percent."""
    heads = ("kitchen", "usable", "median %", "worst %", "joints", "masks", "certified", "seconds", "wrong told", "right told")
    lines = [f"| {' | '.join(heads)} | wrong |", "|---" * (len(heads) + 1) + "|"]
    for name, row in rows.items():
        wrong = ", ".join(f"{key} ({what})" for key, what in row["wrong"].items())
        masks = ", ".join(f"{kind}s {share}" for kind, share in row["mask_iou"].items())
        share = f"{row['usable']} of {row['objects']}"
        certified = "yes" if row["certified"] else "no"
        named = (row.get("wrong_flagged", "–"), row.get("right_flagged", "–"))
        sides, seconds = (row["median_percent"], row["worst_percent"]), row.get("seconds", "–")
        figures = (share, *sides, row["joints_right"], masks, certified, seconds, *named, wrong)
        lines.append(f"| {name} | {' | '.join(str(figure) for figure in figures)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
