"""End-to-end accuracy and cost on synthetic kitchens with exact truth.

    python benchmarks/run.py [--seeds 0-4] [--frames N] [--size WxH] [--json FILE] [--workdir DIR]

Each seed: sample (kept in the workdir), `r2c2r run` from nothing, `r2c2r check`, `r2c2r evaluate`. Prints a Markdown table.
Regressions are checked by guard.py.
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

from whole_way import CLI, REPOSITORY, whole_way

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


_COLUMNS = (
    ("objects_found", "objects", "{:.2f}"),
    ("mask_iou", "mask IoU", "{:.3f}"),
    ("extents_observed", "extents observed %", "{:.2f}"),
    ("joint_type", "joint types", "{:.2f}"),
    ("hinge_side", "hinge sides", "{:.2f}"),
    ("centre", "centre mm", "{:.0f}"),
    ("front_centre", "front centre mm", "{:.0f}"),
    ("yaw", "yaw deg", "{:.2f}"),
    ("scan_to_mesh_median", "scan to mesh mm", "{:.1f}"),
    ("certificate", "certificate", "{:.2f}"),
    ("cpu_minutes", "CPU minutes", "{:.1f}"),
    ("memory", "GB", "{:.1f}"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the seeds and print the table."""
    options = _parser().parse_args(arguments)
    if options.workdir is not None:
        return _bench(options, options.workdir)
    with tempfile.TemporaryDirectory(prefix="r2c2r-bench-") as folder:
        return _bench(options, Path(folder))


def _bench(options: argparse.Namespace, workdir: Path) -> int:
    results: dict[str, dict[str, float | None]] = {}
    for seed in options.seeds:
        print(f"seed {seed} …", file=sys.stderr, flush=True)
        results[str(seed)] = bench_seed(seed, options.frames, options.size, workdir)
    document = {"version": 1, "frames": options.frames, "size": list(options.size), "seeds": results}
    print(markdown(document))
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


def bench_seed(seed: int, frames: int, size: tuple[int, int], workdir: Path) -> dict[str, float | None]:
    """All figures of one seed by name; None if missing."""
    sample = made_sample(seed, frames, size, workdir)
    work = workdir / f"run-{seed}"
    outcome = whole_way(sample / "scan.r3d", sample / "prompts.json", sample / "truth.json", work)
    cost = {
        "certificate": float(outcome.certified),
        "minutes": outcome.cost.wall_s / 60,
        "cpu_minutes": outcome.cost.cpu_s / 60,
        "memory": outcome.cost.peak_bytes / 1e9,
        "exit_code": outcome.cost.exit_code,
    }
    scene = {} if outcome.evaluation is None else outcome.evaluation["scene"]
    return {name: scene.get(name, {}).get("value") for name in ACCURACY} | cost


def made_sample(seed: int, frames: int, size: tuple[int, int], workdir: Path) -> Path:
    """The sample's folder, made unless the same version of the generator has already made it."""
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
    """Digest of the generator's source, so that no stale sample is used."""
    digest = hashlib.sha256()
    for file in sorted((REPOSITORY / "r2c2r_core" / "synthetic").glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:10]


def markdown(document: dict[str, Any]) -> str:
    """One line per seed, and their mean."""
    seeds: dict[str, dict[str, float | None]] = document["seeds"]
    lines = ["| seed | " + " | ".join(title for _, title, _ in _COLUMNS) + " |", "|---" * (len(_COLUMNS) + 1) + "|"]
    for seed, metrics in seeds.items():
        lines.append(_line(seed, {name: metrics[name] for name, _, _ in _COLUMNS}))
    lines.append(_line("mean", {name: _mean([metrics[name] for metrics in seeds.values()]) for name, _, _ in _COLUMNS}))
    return "\n".join(lines)


def _line(title: str, values: dict[str, float | None]) -> str:
    cells = []
    for name, _, form in _COLUMNS:
        value = values[name]
        cells.append("-" if value is None else form.format(value))
    return f"| {title} | " + " | ".join(cells) + " |"


def _mean(values: list[float | None]) -> float | None:
    present = [value for value in values if value is not None]
    return sum(present) / len(present) if present else None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Accuracy and cost on synthetic kitchens with exact truth.")
    parser.add_argument("--seeds", type=_seeds, default=_seeds("0-4"), help="such as 0-4 or 1,3")
    parser.add_argument("--frames", type=int, default=180)
    parser.add_argument("--size", type=_size, default=(960, 720), metavar="WxH")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--workdir", type=Path, help="kept afterwards; samples in it are reused")
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
