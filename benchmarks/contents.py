"""Accuracy of things in drawers: kitchens of the second generator, whose drawers are filmed from above while they open.

    python benchmarks/contents.py --second PATH/make_kitchen.py --workdir DIR [--seeds 200 201 ...] [--frames F] [--size WxH]
                                  [--json FILE]

Each thing is clicked once, and each drawer that a thing lies in, where it is closed or open. A thing counts once; one that is
missing, or that moves with another drawer or with none, is a miss. DIR keeps the recordings and results; a run resumes there.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from whole_way import whole_way

from r2c2r_core.evaluate.records import ObjectRecord, read_bundle, read_truth
from r2c2r_core.evaluate.stage import match_objects

_HERE = Path(__file__).resolve().parent
SEEDS = range(200, 206)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw, reconstruct and score the missing kitchens; print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--second", type=Path, required=True)
    parser.add_argument("--workdir", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=[*SEEDS])
    parser.add_argument("--frames", type=int, default=240)
    parser.add_argument("--size", default="480x360")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    rows: dict[str, list[dict[str, Any]]] = {}
    print("| kitchen | things | moves with its drawer | place off, mm | size off, mm | mask IoU |\n|---|---|---|---|---|---|")
    for seed in options.seeds:
        folder = options.workdir / f"second-{seed}"
        if not (folder / "prompts.json").exists():
            shape = ["--seed", str(seed), "--frames", str(options.frames), "--size", options.size, "--look-in"]
            draw = [sys.executable, str(_HERE / "second_opened.py"), str(options.second), str(folder), *shape]
            subprocess.run(draw, check=True, stdout=subprocess.DEVNULL)
        rows[folder.name] = measured(folder)
        print(line(folder.name, rows[folder.name]), flush=True)
    print(line("total", [score for scores in rows.values() for score in scores]))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def measured(folder: Path) -> list[dict[str, Any]]:
    """Scores of the things in one kitchen's drawers, reconstructed together with those drawers."""
    work, truth = folder / "run", json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    joints = {entry["carried_by"] for entry in truth["objects"]}
    chosen = [
        entry
        for entry in truth["objects"]
        if entry["carried_by"] is not None or any(joint["name"] in joints for joint in entry["joints"])
    ]
    _write(folder / "chosen_truth.json", {"version": 1, "objects": chosen})
    prompts, names = json.loads((folder / "prompts.json").read_text(encoding="utf-8")), {entry["name"] for entry in chosen}
    clicked = [entry for entry in prompts["objects"] if entry["name"] in names]
    _write(folder / "chosen_prompts.json", {"version": 1, "objects": clicked})
    if not (work / "evaluation.json").exists():
        whole_way(folder / "capture.r3d", folder / "chosen_prompts.json", folder / "chosen_truth.json", work)
    found = read_bundle(work / "bundle.zip")
    truths = read_truth(folder / "chosen_truth.json", found.world_from_capture)
    matched = match_objects(truths, found.objects)
    evaluation = json.loads((work / "evaluation.json").read_text(encoding="utf-8"))
    masks = {entry["name"]: entry["metrics"].get("mask_iou", {}).get("value") for entry in evaluation["objects"]}
    things = [(true, thing) for true, thing in zip(truths, matched, strict=True) if true.carried_by is not None]
    return [
        score
        | {
            "name": true.name,
            "size_mm": None if thing is None else (1000 * np.sort(thing.dimensions_m - true.dimensions_m)).round(1).tolist(),
            "mask_iou": masks.get(true.name),
        }
        for score, (true, thing) in zip(contents(truths, matched), things, strict=True)
    ]


def contents(truths: Sequence[ObjectRecord], found: Sequence[ObjectRecord | None]) -> list[dict[str, float | None]]:
    """Per thing in a drawer: whether it moves with that drawer (1 or 0), and how far off it lies in that drawer (mm)."""
    scores: list[dict[str, float | None]] = []
    owners = {joint.name: pair for pair in zip(truths, found, strict=True) for joint in pair[0].joints}
    for true, thing in zip(truths, found, strict=True):
        if true.carried_by is None:
            continue
        drawer, owner = owners[true.carried_by]
        moves = thing is not None and owner is not None and (thing.carried_by or "").startswith(f"{owner.name}_")
        off = None if thing is None or owner is None else _behind_front(thing, owner) - _behind_front(true, drawer)
        scores.append({"moves": float(moves), "off_mm": None if off is None else 1000 * float(np.linalg.norm(off))})
    return scores


def _behind_front(thing: ObjectRecord, drawer: ObjectRecord) -> np.ndarray:
    """Centre of a thing in its drawer's frame, from the middle of the front."""
    front = np.array([0.0, -drawer.dimensions_m[1] / 2, 0.0])
    return np.asarray(drawer.world_from_object.inverse.apply(thing.world_from_object.translation) - front)


def line(name: str, scores: Sequence[dict[str, Any]]) -> str:
    """A table row: medians over the things found, and how many move with their drawer."""
    places = [score["off_mm"] for score in scores if score["off_mm"] is not None]
    sizes = [np.abs(score["size_mm"]).max() for score in scores if score["size_mm"] is not None]
    masks = [score["mask_iou"] for score in scores if score["mask_iou"] is not None]
    medians = [f"{np.median(values):.3g}" if values else "-" for values in (places, sizes, masks)]
    moving = sum(score["moves"] for score in scores)
    return f"| {name} | {len(scores)} | {moving:.0f} | {' | '.join(medians)} |"


def _write(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
