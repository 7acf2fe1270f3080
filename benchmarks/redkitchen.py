"""A real kitchen from one click per object to a certified scene: sizes, door lines, worktops and masks of two sets of frames.

    python benchmarks/redkitchen.py DATA [--set NAME ...] [--workdir DIR] [--keep]

DATA holds the folders of 7-Scenes RedKitchen frames that redkitchen.json names, with their clicks. Sizes are compared with
those read from orthographic photos of the planes, to about 5 mm for doors; doors L1 to L3 have no single true height. --keep
reads stages whose inputs and code are unchanged from DIR.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from measure import run_measured
from recordings import write_prompts
from whole_way import CLI, REPOSITORY

from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts

SETS = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
DOORS = ("L1", "L2", "L3", "B1", "B2", "B3", "B4")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run each set and print its figures."""
    parser = argparse.ArgumentParser(description="Figures of a real kitchen, one click per object.")
    parser.add_argument("data", type=Path)
    parser.add_argument("--set", nargs="+", dest="sets", default=list(SETS["sets"]), choices=list(SETS["sets"]))
    parser.add_argument("--workdir", type=Path, help="kept afterwards")
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="r2c2r-redkitchen-") as scratch:
        for name in options.sets:
            work = (options.workdir or Path(scratch)) / name
            if not options.keep:
                shutil.rmtree(work, ignore_errors=True)
            work.mkdir(parents=True, exist_ok=True)
            answer = run_set(options.data / name, SETS["sets"][name], work)
            print("\n".join([f"## {name}", *figures_of(answer, work)]), flush=True)
    return 0


def run_set(recording: Path, clicks: dict[str, Any], work: Path) -> dict[str, Any]:
    """The bundle's manifest and its certificate."""
    prompts, bundle, certificate = work / "prompts.json", work / "bundle.zip", work / "certificate.json"
    write_prompts(prompts_of(clicks["clicks"]), prompts)
    bundle.unlink(missing_ok=True)
    words = [*CLI, "run", str(recording), "--prompts", str(prompts), "-o", str(bundle), *clicks["options"]]
    words += ["--workdir", str(work / "work"), "--masks", str(work / "masks"), "--workers", "1"]
    cost = run_measured(words, cwd=REPOSITORY, log=work / "run.log")
    if not bundle.exists():
        raise SystemExit(f"no bundle (exit {cost.exit_code}); see {work / 'run.log'}")
    subprocess.run([*CLI, "check", str(bundle), "--json", str(certificate)], cwd=REPOSITORY, capture_output=True, check=False)
    with zipfile.ZipFile(bundle) as archive:
        manifest = json.loads(archive.read("manifest.json"))
    return {"manifest": manifest, "certificate": json.loads(certificate.read_text(encoding="utf-8")), "seconds": cost.wall_s}


def prompts_of(clicks: dict[str, list[Any]]) -> Prompts:
    """One positive click an object."""
    return Prompts(
        objects=tuple(
            ObjectPrompt(name=name, category=category, points=(PromptPoint(frame=frame, x=float(x), y=float(y), label=1),))
            for name, (category, frame, x, y) in clicks.items()
        )
    )


def figures_of(answer: dict[str, Any], work: Path) -> Iterator[str]:
    """Lines of text: checks, sizes with their errors, door lines, worktops, masks in each other, warnings."""
    objects = {item["name"]: item for item in answer["manifest"]["objects"]}
    certificate = answer["certificate"]
    passed, likeness = ("passed" if certificate["passed"] else "failed"), certificate["likeness"]
    yield f"certificate {passed}, likeness {likeness['state']}, {answer['seconds']:.0f} s"
    yield from (f"- {each['severity']}: {each['where']}: {each['message']}" for each in certificate["findings"])
    for name, item in objects.items():
        size = 100 * np.array(item["dimensions_m"])
        truth = SETS["truth_cm"].get(name, [None] * 3)
        size = size if name in DOORS else np.array([*sorted(size[:2], reverse=True), size[2]])  # things have no front
        errors = " ".join(
            "–" if real is None else f"{100 * (got / real - 1):+.0f}%" for got, real in zip(size, truth, strict=True)
        )
        middle = 100 * item["world_from_object"][2][3]
        low, high = middle - size[2] / 2, middle + size[2] / 2
        yield f"{name:22} {size[0]:6.1f} x {size[1]:5.1f} x {size[2]:5.1f} cm ({errors}), z {low:6.1f} to {high:6.1f}"
    doors = [objects[name] for name in DOORS if name in objects]
    tops, bottoms = (
        [100 * (door["world_from_object"][2][3] + sign * door["dimensions_m"][2] / 2) for door in doors] for sign in (1, -1)
    )
    yield f"{len(doors)} doors: tops spread over {np.ptp(tops):.1f} cm, bottoms over {np.ptp(bottoms):.1f} cm"
    shared = shared_masks(work / "masks", set(objects))
    yield from (f"- {a} has {100 * share:.0f} % of {b} in its mask" for a, b, share in shared)
    yield from (f"- {name}: {warning}" for name, item in objects.items() for warning in item["warnings"])


def shared_masks(folder: Path, names: set[str]) -> Iterator[tuple[str, str, float]]:
    """Pairs (a, b) with the largest fraction, above 2 %, of b's mask that lies in a's, over the frames that show both."""
    masks = {name: {path.name: path for path in (folder / name).glob("*.png")} for name in names if (folder / name).is_dir()}
    for a, b in permutations(sorted(masks), 2):
        both, of = 0, 0
        for frame in sorted(set(masks[a]) & set(masks[b])):
            first, second = (cv2.imread(str(masks[name][frame]), cv2.IMREAD_GRAYSCALE) > 127 for name in (a, b))
            both, of = both + int((first & second).sum()), of + int(second.sum())
        if of and both / of > 0.02:
            yield a, b, both / of


if __name__ == "__main__":
    sys.exit(main())
