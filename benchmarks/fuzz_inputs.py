"""Mutation fuzzing of every command: each run must end in time and in bounded memory, with an exit code and a one-line message.

    python benchmarks/fuzz_inputs.py [--minutes 60 | --count 300] [--seed 0] [--json benchmarks/fuzz.json]

The cases (fuzz_cases.py) run one after the other in a worker process, which announces each case that it begins; when it stops
reporting or ends, that case is a suspect: it is run again alone, and counts only then. Case N of a seed is always the same:
`--only N` runs it with its traceback.
"""

import argparse
import contextlib
import io
import json
import os
import queue
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from waiting import PATIENCE

SILENT_S, ALONE_S = 40.0, 150.0  # on a busy machine; the slowest valid case takes some 5 s
MOST_BYTES = 6 << 30
_LINE = re.compile(r"^(r2c2r(?: \w+)*: |usage: )")


def fuzz(seed: int, *, count: int | None = None, minutes: float | None = None, patience: float = PATIENCE) -> dict[str, Any]:
    """Run cases 0, 1, … up to that count or time limit; the counts, and every case that ended wrongly.

    `patience` scales the silence after which a case is a suspect, and the limit after which it counts as hanging.
    """
    began, number = time.monotonic(), 0
    faults: list[dict[str, Any]] = []
    by_command, by_kind, codes = Counter[str](), Counter[str](), Counter[str]()
    peak_mb, slowest = 0.0, (0.0, -1)
    while (count is None or number < count) and (minutes is None or time.monotonic() - began < 60 * minutes):
        for said in _worker(seed, number, patience * SILENT_S):
            if "end" in said:  # the worker stopped reporting, or died
                alone = list(_worker(seed, number, patience * ALONE_S, only=True))
                if "end" in alone[-1] and not any("done" in line for line in alone):
                    faults.append({"case": number, "wrong": alone[-1]["end"], "said": ""})
                number += 1
                break
            if "done" not in said:
                continue
            by_command[said["command"]] += 1
            by_kind[said["kind"]] += 1
            codes[str(said["code"])] += 1
            peak_mb, slowest = max(peak_mb, said["peak_mb"]), max(slowest, (said["seconds"], number))
            if said["wrong"]:
                faults.append({"case": number, "wrong": said["wrong"], "said": said["said"]})
            number += 1
            if (count is not None and number >= count) or (minutes is not None and time.monotonic() - began >= 60 * minutes):
                break
    wrong = Counter(fault["wrong"] for fault in faults)
    return {
        "seed": seed,
        "cases": number,
        "minutes": round((time.monotonic() - began) / 60, 1),
        "by_command": dict(by_command.most_common()),
        "by_kind": dict(by_kind.most_common()),
        "exit_codes": dict(codes),
        "tracebacks": wrong["traceback"],
        "hangs": wrong["hang"],
        "crashes": wrong["crash"],
        "not_one_line": wrong["not one line"],
        "peak_mb": peak_mb,
        "slowest_s": slowest[0],
        "slowest_case": slowest[1],
        "faults": faults,
    }


def _worker(seed: int, first: int, silent_s: float, *, only: bool = False) -> Iterator[dict[str, Any]]:
    """Messages of a worker that runs the cases from `first` on; last {"end": why}, unless it ended as expected."""
    words = [sys.executable, __file__, "--worker", str(first), "--seed", str(seed), *(["--alone"] if only else [])]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=log, stdin=subprocess.DEVNULL)
        lines: queue.Queue[bytes] = queue.Queue()
        assert process.stdout is not None
        listener = threading.Thread(target=_listen, args=(process.stdout, lines), daemon=True)
        listener.start()
        try:
            while True:
                try:
                    line = lines.get(timeout=silent_s)
                except queue.Empty:
                    yield {"end": "hang"}
                    return
                if not line:
                    if process.wait() != 0:
                        yield {"end": "crash"}
                    return
                yield json.loads(line)
        finally:
            process.kill()
            process.wait()
            listener.join()  # its end of the pipe has ended
            process.stdout.close()


def _listen(stream: Iterable[bytes], lines: "queue.Queue[bytes]") -> None:
    for line in stream:
        lines.put(line)
    lines.put(b"")


def work(seed: int, first: int, *, alone: bool) -> int:
    """Run the cases from `first` on, or only that one, and report how each ended."""
    from fuzz_cases import Inputs, case_of

    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    out = os.fdopen(os.dup(1), "w")  # output of the cases goes elsewhere
    with tempfile.TemporaryDirectory(prefix="r2c2r-fuzz-") as root:
        (Path(root) / "good").mkdir()
        inputs, number = Inputs(Path(root) / "good"), first
        while True:
            folder = Path(root) / "case"
            folder.mkdir()
            case = case_of(inputs, folder, seed, number)
            _tell(out, begin=number)
            began = time.monotonic()
            code, wrong, said = judged(case)
            peak_mb = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)
            seconds = round(time.monotonic() - began, 2)
            about = {"command": case.command, "kind": case.kind, "peak_mb": peak_mb, "seconds": seconds}
            _tell(out, done=number, code=code, wrong=wrong, said=said, **about)
            shutil.rmtree(folder)
            number += 1
            if alone:
                return 0


def judged(case: Any, *, debug: bool = False) -> tuple[int, str, str]:
    """Exit code of a case run in this process, the fault in how it ended, and its last output; the last two empty if none."""
    runners = {"cli": _cli, "worker": _job_worker, "probe": _probe}
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors=e) for e in ("strict", "backslashreplace"))
    failure = ""
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = runners[case.run](["--debug", *case.arguments] if debug and case.run == "cli" else list(case.arguments))
        except SystemExit as left:
            code = left.code if isinstance(left.code, int) else 1
        except BaseException as error:
            code, failure = -1, f"{type(error).__name__}: {error}"
    words = [_text(stream) for stream in (out, err)]
    said = failure or (words[1].strip().splitlines() or words[0].strip().splitlines() or [""])[-1]
    if debug:
        print(*words, sep="\n")
    if failure or "Traceback" in words[1] or "internal error (" in words[1] or "unexpected: " in words[0]:
        return code, "traceback", said[-400:]
    if code not in (0, 1, 2) or (case.run == "cli" and code == 2 and not _LINE.match(said)):
        return code, "not one line", said[-400:]
    return code, "", ""


def _cli(arguments: list[str]) -> int:
    from r2c2r_core.cli import main

    return main(arguments)


def _job_worker(arguments: list[str]) -> int:
    from r2c2r_core.worker import main

    return main(arguments)


def _probe(arguments: list[str]) -> int:
    """Examine a recording as app.jobs.probe does, without its limits, which would also apply to all later cases."""
    from app.jobs.messages import run_stage
    from app.jobs.probe import LOOKS

    return run_stage("probe", lambda progress: LOOKS[arguments[0]].probe(Path(arguments[1])))


def _text(stream: io.TextIOWrapper) -> str:
    stream.flush()
    written: bytes = stream.buffer.getvalue()  # type: ignore[attr-defined]
    return written.decode(errors="replace")


def _tell(out: Any, **message: object) -> None:
    out.write(json.dumps(message) + "\n")
    out.flush()


def main() -> int:
    """Fuzz, and save the counts."""
    from kept import add_options, report

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="run this case here, with its traceback")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    add_options(parser)
    options = parser.parse_args()
    if options.worker is not None:
        return work(options.seed, options.worker, alone=options.alone)
    if options.only is not None:
        return _show(options.seed, options.only)
    count = 300 if options.count is None and options.minutes is None else options.count
    figures = fuzz(options.seed, count=count, minutes=options.minutes)
    return report(f"inputs, seed {options.seed}", figures, options.json, failed=bool(figures["faults"]))


def _show(seed: int, number: int) -> int:
    from fuzz_cases import Inputs, case_of

    root = Path(tempfile.mkdtemp(prefix="r2c2r-fuzz-"))
    (root / "good").mkdir()
    (root / "case").mkdir()
    case = case_of(Inputs(root / "good"), root / "case", seed, number)
    print(case)
    print(judged(case, debug=True))
    print(f"its files stay in {root}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
