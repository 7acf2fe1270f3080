"""Accuracy and cost of the whole way, on synthetic kitchens with exact truth.

    python benchmarks/run.py [--seeds 0-4] [--frames N] [--size WxH] [--gate] [--update] [--json FILE] [--workdir DIR]

Each seed: sample (kept in the workdir), `r2c2r run` from nothing, `r2c2r check`, `r2c2r evaluate`. Prints a Markdown table.
--gate exits 1 when a number is worse than benchmarks/baseline.json allows; --update rewrites that file.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from measure import Cost
from table import gate, markdown
from whole_way import CLI, REPOSITORY, whole_way

BASELINE = Path(__file__).resolve().parent / "baseline.json"
ACCURACY = (
    "objects_found",
    "mask_iou",
    "extents_observed",
    "joint_type",
    "hinge_side",
    "centre",
    "front_centre",
    "yaw",
    "pivot",
    "box_iou",
    "scan_to_mesh_median",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the seeds, print the table, and compare."""
    options = _parser().parse_args(arguments)
    if options.workdir is not None:
        return _bench(options, options.workdir)
    with tempfile.TemporaryDirectory(prefix="r2c2r-bench-") as folder:
        return _bench(options, Path(folder))


def _bench(options: argparse.Namespace, workdir: Path) -> int:
    results: dict[str, dict[str, Any]] = {}
    for seed in options.seeds:
        print(f"seed {seed} …", file=sys.stderr, flush=True)
        results[str(seed)] = bench_seed(seed, options.frames, options.size, workdir)
    document = {"version": 1, "frames": options.frames, "size": list(options.size), "seeds": results}
    print(markdown(document))
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if options.update:
        BASELINE.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if not options.gate:
        return 0
    if not BASELINE.exists():
        print(f"{BASELINE}: no baseline; make one with --update", file=sys.stderr)
        return 2
    regressions = gate(document, json.loads(BASELINE.read_text(encoding="utf-8")))
    for line in regressions:
        print(f"regression: {line}", file=sys.stderr)
    return 1 if regressions else 0


def bench_seed(seed: int, frames: int, size: tuple[int, int], workdir: Path) -> dict[str, Any]:
    """All numbers of one seed by name, each with value, unit, better and tolerance."""
    sample = made_sample(seed, frames, size, workdir)
    work = workdir / f"run-{seed}"
    outcome = whole_way(sample / "scan.r3d", sample / "prompts.json", sample / "truth.json", work)
    metrics = {"certificate": _entry(float(outcome.certified), "share passed", "higher", 0.0)} | _cost_entries(outcome.cost)
    if outcome.evaluation is None:
        return metrics
    scene = outcome.evaluation["scene"]
    return {name: scene[name] for name in ACCURACY if name in scene} | metrics


def made_sample(seed: int, frames: int, size: tuple[int, int], workdir: Path) -> Path:
    """The sample's folder, made unless the same generator made it before."""
    folder = workdir / f"sample-{seed}-{frames}-{size[0]}x{size[1]}-{_generator_digest()}"
    if not folder.exists():
        unfinished = workdir / f"unfinished-{seed}"
        shutil.rmtree(unfinished, ignore_errors=True)
        command = [
            *CLI,
            "sample",
            str(unfinished),
            "--seed",
            str(seed),
            "--frames",
            str(frames),
            "--size",
            f"{size[0]}x{size[1]}",
        ]
        subprocess.run(command, cwd=REPOSITORY, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        unfinished.rename(folder)
    return folder


def _generator_digest() -> str:
    """Changes with the generator's source, so that no stale sample is used."""
    digest = hashlib.sha256()
    for file in sorted((REPOSITORY / "r2c2r_core" / "synthetic").glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:10]


def _cost_entries(cost: Cost) -> dict[str, Any]:
    # Times move with the machine's load: the tolerances catch a doubling, not a busy neighbour.
    return {
        "minutes": _entry(cost.wall_s / 60, "min", "lower", 5.0),
        "cpu_minutes": _entry(cost.cpu_s / 60, "min", "lower", 5.0),
        "memory": _entry(cost.peak_bytes / 1e9, "GB", "lower", 0.5),
        "exit_code": _entry(float(cost.exit_code), "", "lower", 0.0),
    }


def _entry(value: float, unit: str, better: str, tolerance: float) -> dict[str, Any]:
    return {"value": value, "unit": unit, "better": better, "tolerance": tolerance, "note": ""}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Accuracy and cost on synthetic kitchens with exact truth.")
    parser.add_argument("--seeds", type=_seeds, default=_seeds("0-4"), help="such as 0-4 or 1,3")
    parser.add_argument("--frames", type=int, default=180)
    parser.add_argument("--size", type=_size, default=(960, 720), metavar="WxH")
    parser.add_argument("--gate", action="store_true", help="exit 1 when a number is worse than the baseline allows")
    parser.add_argument("--update", action="store_true", help="rewrite the baseline")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--workdir", type=Path, help="kept afterwards; samples in it are used again")
    return parser


def _seeds(text: str) -> tuple[int, ...]:
    seeds: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        seeds += range(int(first), int(last or first) + 1)
    return tuple(seeds)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    return int(width), int(height)


if __name__ == "__main__":
    sys.exit(main())
