"""Kitchens that nobody here drew: how many objects come out usable, one click an object.

    python benchmarks/unseen.py FOLDER... [--workdir DIR] [--json benchmarks/unseen.json]

A FOLDER holds capture.r3d or scan.r3d, prompts.json and truth.json. Usable: every extent within 5 %, and the joint of the
right type, hinged on the right side. What is missing is wrong: its joint, its size by 100 %, all its mask. Rows are added
to the JSON file by the folder's name.
"""

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from recordings import recording_in
from whole_way import Outcome, whole_way

USABLE_PERCENT = 5.0
_SIDES = ("width_error", "depth_error", "height_error")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run each folder and print the table."""
    parser = argparse.ArgumentParser(description="Objects of unseen kitchens that come out usable.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--workdir", type=Path, help="kept afterwards")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="r2c2r-unseen-") as folder:
        rows = {}
        for each in options.folders:
            print(f"{each.name} …", file=sys.stderr, flush=True)
            work = (options.workdir or Path(folder)) / f"unseen-{each.name}"
            rows[each.name] = row_of(
                whole_way(recording_in(each), each / "prompts.json", each / "truth.json", work), each / "truth.json"
            )
    print(table(rows))
    if options.json:
        before = json.loads(options.json.read_text(encoding="utf-8")) if options.json.exists() else {}
        options.json.write_text(json.dumps(before | rows, indent=1) + "\n", encoding="utf-8")
    return 0


def row_of(outcome: Outcome, truth: Path) -> dict[str, Any]:
    """The figures of one kitchen."""
    names = [item["name"] for item in json.loads(truth.read_text(encoding="utf-8"))["objects"]]
    found = {} if outcome.evaluation is None else {item["name"]: item["metrics"] for item in outcome.evaluation["objects"]}
    judged = {name: judge(found.get(name, {})) for name in names}
    errors = [error for error, _ in judged.values()]
    masks = [_value(found.get(name, {}), "mask_iou") or 0.0 for name in names]
    return {
        "objects": len(names),
        "usable": sum(error <= USABLE_PERCENT and right for error, right in judged.values()),
        "median_percent": round(statistics.median(errors), 2),
        "worst_percent": round(max(errors), 1),
        "joints_right": sum(right for _, right in judged.values()),
        "mask_iou": round(statistics.fmean(masks), 3),
        "certified": outcome.certified,
        "cpu_minutes": round(outcome.cost.cpu_s / 60, 1),
        "wrong": {name: round(error, 1) for name, (error, right) in judged.items() if error > USABLE_PERCENT or not right},
    }


def judge(metrics: dict[str, Any]) -> tuple[float, bool]:
    """The largest error of an extent, percent, and whether the joint is right (as it is of what has none); missing: wrong."""
    sides = [value for name in _SIDES if (value := _value(metrics, name)) is not None]
    if not sides:
        return 100.0, False
    joint = (_value(metrics, name) for name in ("joint_type", "hinge_side"))
    return min(max(sides), 100.0), all(share is None or share == 1.0 for share in joint)


def _value(metrics: dict[str, Any], name: str) -> float | None:
    value = metrics.get(name, {}).get("value")
    return None if value is None else float(value)


def table(rows: dict[str, dict[str, Any]]) -> str:
    """As Markdown."""
    lines = ["| kitchen | usable | median % | worst % | mask IoU | certified | wrong |", "|---|---|---|---|---|---|---|"]
    for name, row in rows.items():
        wrong = ", ".join(f"{key} {value:g}" for key, value in row["wrong"].items())
        share = f"{row['usable']} of {row['objects']}"
        figures = (share, row["median_percent"], row["worst_percent"], row["mask_iou"], row["certified"], wrong)
        lines.append(f"| {name} | {' | '.join(str(figure) for figure in figures)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
