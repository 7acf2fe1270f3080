"""Sensitivity of the results to each tuned parameter, moved alone by a quarter in either direction and compared with the truth.

    python benchmarks/sensitivity.py RECORDING... [--rooms segment,generate] [--minutes 30] [--objects 6] [--frames 30]

A RECORDING is a folder with scan.r3d or capture.r3d, prompts.json, truth.json, and true masks (`r2c2r sample` writes one). A
first run with one object of each category records which parameters each step and each furniture run reads. A parameter is then
moved on one object of each kind (front, appliance, thing) whose steps read it, and only these steps are recomputed; later steps
follow only if the mean IoU of the masks with the usual ones is below 0.995 or a size differs by half a millimetre. Parameters
that nothing reads are listed as such. Runs resume where an earlier one stopped (benchmarks/sensitivity.json) while the code and
the recordings are the same; several processes may share the work, by packages (--rooms) or by recordings. --plot only redraws
docs/sensitivity.svg and docs/sensitivity.md.

loss: mean error of the sizes in percent + 100 (1 - mean mask IoU) + 100 (1 - fraction of right joints), over the objects used;
a lost object counts as an error of 100 % without mask and joint. Where fronts were filmed while they open, + 100 (1 - fraction
of frames with the right state); where proposals are made (--rooms contains segment or segment.proposals), + 100 (1 - their F1).
"""

import argparse
import fcntl
import json
import math
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from sensitivity_page import MOVES, same_everywhere, table, tornado
from sensitivity_steps import Case, open_case

from r2c2r_core.sources import source_key
from r2c2r_core.tuning import modules_with_numbers, params_of

HERE = Path(__file__).resolve().parent
FIGURES, PLOT, TABLE = (
    HERE / "sensitivity.json",
    HERE.parent / "docs" / "sensitivity.svg",
    HERE.parent / "docs" / "sensitivity.md",
)
ROOMS = ("segment", "generate", "align", "kitchen", "geometry", "synthesize", "warp")

Field = tuple[str, str, int | None]  # module, parameter, entry of a pair


def candidates_of(case: Case, rooms: Sequence[str]) -> list[Field]:
    """Every parameter that some step reads, entry by entry if it is a pair, by package (or module)."""
    read = {entry for entries in case.read.values() for entry in entries}
    found: list[Field] = []
    for room in rooms:
        for path, name in sorted(entry for entry in read if f"{entry[0]}.".startswith(f"{room}.")):
            default = next(f.default for f in fields(params_of(path)) if f.name == name)
            pair = isinstance(default, tuple) and len(default) == 2
            found += [(path, name, k) for k in (0, 1)] if pair else [(path, name, None)]
    return found


def moved_value(entry: Field, factor: float) -> Any:
    """The parameter moved by a quarter, within its bounds; a cosine by its angle, a count by at least one."""
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


def trial(case: Case, entry: Field) -> dict[str, Any]:
    """The figures with one parameter moved in either direction."""
    path, name, _ = entry
    of = params_of(path)
    found: dict[str, Any] = {}
    for label, factor in MOVES.items():
        value = moved_value(entry, factor)
        if value != getattr(of(), name):
            found[label] = {"value": value, **case.moved(of, replace(of(), **{name: value}))}
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Move the remaining parameters while there is time; save the figures after each, and the plot and the table at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--objects", type=int, default=6)
    parser.add_argument("--frames", type=int, default=30)
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
    end = time.monotonic() + 60 * options.minutes
    for number, folder in enumerate(options.recordings):
        share = (end - time.monotonic()) / (len(options.recordings) - number)
        proposes = "segment.proposals".startswith(tuple(options.rooms.split(",")))
        _measure_case(open_case(folder, work, options.frames, options.objects, proposes), options, time.monotonic() + share)


def _measure_case(case: Case, options: argparse.Namespace, end: float) -> None:
    every = {(path, f.name) for room in ROOMS for path in modules_with_numbers(room) for f in fields(params_of(path))}
    read = {entry for reads in case.read.values() for entry in reads}
    key = [source_key(*ROOMS, "ingest"), options.frames, case.name, sorted(case.prompts)]
    said = {
        "usual": case.figures(case.made, frozenset(case.prompts)),
        "untouched": sorted(f"{path}.{name}" for path, name in every - read),
        "read": len(candidates_of(case, ROOMS)),
    }
    done = _add(options.json, key, said, {})
    still = same_everywhere(json.loads(options.json.read_text()))
    print(f"{case.name}: {said['usual']}; {said['read']} numbers read", flush=True)
    entries = {_name(entry): entry for entry in candidates_of(case, options.rooms.split(","))}
    for name, entry in sorted(entries.items(), key=lambda item: item[0] not in still):  # those without effect so far first
        if time.monotonic() > end:
            break
        if name in done:
            continue
        started = time.monotonic()
        try:
            found = trial(case, entry)
        except Exception:  # a value that causes a programming error is itself a finding
            found = {"error": traceback.format_exc().splitlines()[-1]}
        _add(options.json, key, said, {name: found})
        print(f"{time.monotonic() - started:.0f} s {name} {json.dumps(found)}", file=sys.stderr, flush=True)


def _text(runs: Sequence[Mapping[str, Any]]) -> str:
    """JSON with a line for each number."""
    written = []
    for run in runs:
        numbers = ",\n".join(f"{json.dumps(name)}: {json.dumps(moves)}" for name, moves in run["numbers"].items())
        head = json.dumps({key: value for key, value in run.items() if key != "numbers"})
        written.append(f'{head[:-1]}, "numbers": {{\n{numbers}\n}}}}')
    return '{"runs": [\n' + ",\n".join(written) + "\n]}\n"


def _name(entry: Field) -> str:
    return f"{entry[0]}.{entry[1]}" + ("" if entry[2] is None else f"[{entry[2]}]")


def _add(path: Path, key: list[Any], said: Mapping[str, Any], numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The results so far, merged with these; a file lock serialises parallel processes."""
    with Path(__file__).open() as alone:
        fcntl.flock(alone, fcntl.LOCK_EX)
        runs = json.loads(path.read_text())["runs"] if path.exists() else []
        run = next((run for run in runs if run["key"] == key), {"key": key, "numbers": {}})
        run |= {**said, "numbers": run["numbers"] | numbers}
        rest = [other for other in runs if other["key"][2:] != key[2:]]  # runs of older code are dropped
        path.write_text(_text([*rest, run]), encoding="utf-8")
    return dict(run["numbers"])


if __name__ == "__main__":
    sys.exit(main())
