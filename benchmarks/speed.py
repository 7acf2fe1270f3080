"""Seconds by stage: scaling with objects and with frames, of a whole run, and after one changed click.

    python benchmarks/speed.py [--quick] [--objects 5,14,40] [--frames 60,180,600] [--workers N] [--workdir DIR]

Each case is a fresh workspace; each stage is a separate process, as in the app, so its seconds include the start of the process
and its workers. Objects beyond those of the sample are duplicates under other names: they are segmented, generated and placed,
but not arranged, as they would overlap. "whole" is `r2c2r run`, "again" the same with one click moved by two pixels.
Writes benchmarks/speed.json and a table; --quick measures "whole" and "again" alone and keeps the file's figures of stages.
Times depend on the machine's load: use an idle one. The load average is recorded beside each.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from measure import Cost, run_measured
from run import CLI, REPOSITORY, made_sample

RESULTS = Path(__file__).resolve().parent / "speed.json"
STAGES = ("ingest", "segment", "generate", "align", "synthesize", "warp", "export")
SIZE = (960, 720)
USUAL_OBJECTS, USUAL_FRAMES = 14, 180


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases and write their times."""
    parser = argparse.ArgumentParser(description="Seconds by stage, objects and frames.")
    parser.add_argument("--objects", type=_numbers, default=(5, 14, 40))
    parser.add_argument("--frames", type=_numbers, default=(60, 180, 600))
    parser.add_argument("--workers", type=int, default=0, help="0: as many as cores and memory allow")
    parser.add_argument("--workdir", type=Path, help="kept afterwards; samples in it are reused")
    parser.add_argument("--quick", action="store_true", help="only the whole run and the one after a changed click")
    options = parser.parse_args(arguments)
    cases = [(count, USUAL_FRAMES) for count in options.objects]
    cases += [(USUAL_OBJECTS, frames) for frames in options.frames if frames != USUAL_FRAMES]
    with tempfile.TemporaryDirectory(prefix="r2c2r-speed-") as scratch:
        workdir = (options.workdir or Path(scratch)).resolve()
        workdir.mkdir(parents=True, exist_ok=True)
        document: dict[str, Any] = {
            "version": 1,
            "cores": len(os.sched_getaffinity(0)),
            "workers": options.workers,
            "run": run_seconds(options.workers, workdir),
            "stages": _stages_before() if options.quick else [],
        }
        _write(document)
        for count, frames in () if options.quick else sorted(cases, key=lambda case: case[0] * case[1]):
            document["stages"].append(stage_seconds(count, frames, options.workers, workdir))
            print(json.dumps(document["stages"][-1]), file=sys.stderr, flush=True)
            _write(document)  # the larger cases take long: save what was measured
    print(markdown(document))
    return 0


def stage_seconds(count: int, frames: int, workers: int, workdir: Path) -> dict[str, Any]:
    """Wall and CPU seconds of every stage, for `count` objects of a kitchen filmed in `frames` frames."""
    sample = made_sample(0, frames, SIZE, workdir)
    prompts = json.loads((sample / "prompts.json").read_text())
    filmed = len(prompts["objects"])
    prompts["objects"] = [
        item | {"name": f"{item['name']}_{k // filmed}" if k >= filmed else item["name"]}
        for k in range(count)
        for item in [prompts["objects"][k % filmed]]
    ]
    work = workdir / f"speed-{count}-{frames}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    (work / "prompts.json").write_text(json.dumps(prompts))
    (work / "request.json").write_text(json.dumps({"source": str(sample / "scan.r3d"), "prompts": "prompts.json"}))
    taken: dict[str, Any] = {"objects": count, "frames": frames}
    for stage in STAGES[: 4 if count > filmed else None]:
        command = [sys.executable, "-m", "r2c2r_core.worker", str(work), "--until", stage, "--workers", str(workers)]
        cost = run_measured(command, cwd=REPOSITORY, log=work / f"{stage}.log")
        if cost.exit_code != 0:
            raise SystemExit(f"{stage} ended with {cost.exit_code}: see {work / f'{stage}.log'}")
        taken[stage] = _told(cost)
    return taken


def run_seconds(workers: int, workdir: Path) -> dict[str, Any]:
    """Wall and CPU seconds of `r2c2r run`: from nothing, after one changed click, and with nothing changed."""
    sample = made_sample(0, USUAL_FRAMES, SIZE, workdir)
    work = workdir / "speed-run"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    prompts = json.loads((sample / "prompts.json").read_text())
    taken = {}
    for name in ("whole", "again", "nothing changed"):
        if name == "again":
            prompts["objects"][0]["points"][0]["x"] += 2.0
        (work / "prompts.json").write_text(json.dumps(prompts))
        command = [*CLI, "run", str(sample / "scan.r3d"), "--prompts", str(work / "prompts.json"), "-o", str(work / "b.zip")]
        cost = run_measured([*command, "--workers", str(workers)], cwd=REPOSITORY, log=work / f"{name}.log")
        taken[name] = _told(cost) | {"exit_code": cost.exit_code}
        print(json.dumps({name: taken[name]}), file=sys.stderr, flush=True)
    return taken


def _told(cost: Cost) -> dict[str, Any]:
    return {
        "wall_s": round(cost.wall_s, 1),
        "cpu_s": round(cost.cpu_s, 1),
        "peak_gb": round(cost.peak_bytes / 1e9, 2),
        "largest_process_gb": round(cost.largest_bytes / 1e9, 2),
        "load": round(os.getloadavg()[0], 1),
    }


def _write(document: dict[str, Any]) -> None:
    RESULTS.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _stages_before() -> list[dict[str, Any]]:
    before: list[dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8"))["stages"] if RESULTS.exists() else []
    return before


def markdown(document: dict[str, Any]) -> str:
    """Wall seconds, with CPU seconds in brackets."""
    lines = [f"| objects | frames | {' | '.join(STAGES)} |", f"|{'---|' * (len(STAGES) + 2)}"]
    for row in document["stages"]:
        cells = [f"{row[s]['wall_s']:.0f} ({row[s]['cpu_s']:.0f})" if s in row else "" for s in STAGES]
        lines.append(f"| {row['objects']} | {row['frames']} | {' | '.join(cells)} |")
    runs = [f"{name}: {t['wall_s']:.0f} s ({t['cpu_s']:.0f} s of CPU)" for name, t in document["run"].items()]
    return "\n".join([*lines, "", f"{document['cores']} cores; `r2c2r run`, {'; '.join(runs)}"])


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(","))


if __name__ == "__main__":
    sys.exit(main())
