"""Test runner of CI: JavaScript, Python, then browser tests, each on two workers; failed tests are run once more, alone.

Tests marked `slow` are left out; `--slow` runs only them. Other arguments are passed to both pytest runs. With
R2C2R_REQUIRE_ALL set (CI), node and a Chromium are required; without it, tests that cannot run are reported as not run. At the
end, `tests/durations.py` tells where the time went, with CHECKED_S for `make check`, which ran before.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
PATIENCE = float(os.environ.get("R2C2R_PATIENCE", "1"))
LONGEST_S = 600 * PATIENCE  # for one test, including its fixtures
BLOCKED_S = 30 * PATIENCE  # after LONGEST_S, a process that cannot run Python code (a deadlock in a library) is ended
REQUIRED = bool(os.environ.get("R2C2R_REQUIRE_ALL"))
TWO_WORKERS = ("-n", "2", "--dist", "worksteal")  # half of the tests each, then tests that the other has not begun
WITHOUT_BROWSER, WITH_BROWSER = "tests without a browser", "browser tests"
SELECTIONS = {
    WITHOUT_BROWSER: ("not browser", "--ignore=tests/browser"),  # ignored folders are not even imported
    WITH_BROWSER: ("browser", "--ignore=tests/app", "--ignore=tests/core"),
}
PASSED, FAILED, NOTHING_RAN = 0, 1, 5  # exit codes of pytest
MEMORY = Path("/dev/shm")  # temporary files of tests: a disk would be waited for at every transaction
MIN_MEMORY_B = 4 << 30  # required free space; a run takes 1 GB
DURATIONS = "durations.json"  # in BUILD
MAX_RERUN = 20  # number of tests; more failures are not a matter of timing


def main() -> int:
    """Run the suites; the exit code is 0 if every test passed, in the suite or when rerun alone."""
    node = shutil.which("node")
    chromium = any(map(shutil.which, ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")))
    not_run = [
        what for what, tool in (("JavaScript tests (no node)", node), ("browser tests (no Chromium)", chromium)) if not tool
    ]
    if REQUIRED and not_run:
        sys.stderr.write(f"required here but not possible: {', '.join(not_run)}\n")
        return 1
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # hundreds of processes start: each would compile all its imports
    if MEMORY.is_dir() and shutil.disk_usage(MEMORY).free > MIN_MEMORY_B:
        os.environ.setdefault("TMPDIR", str(MEMORY))
    arguments = sys.argv[1:]
    slow = "--slow" in arguments
    passes = {
        part: ("-m", f"{tests} and {'slow' if slow else 'not slow'}", *ignored, *TWO_WORKERS)
        for part, (tests, *ignored) in SELECTIONS.items()
        if chromium or part != WITH_BROWSER
    }
    codes = []
    (BUILD / DURATIONS).unlink(missing_ok=True)
    if checked_s := os.environ.get("CHECKED_S"):
        note_part("make check", float(checked_s))
    if node and not slow:
        tests = sorted(str(path) for path in (ROOT / "tests" / "js").glob("*.test.js"))
        with timed("JavaScript tests"):
            codes.append(subprocess.call([node, "--test", *tests], cwd=ROOT))
    codes.append(run_python(passes, [one for one in arguments if one != "--slow"]))
    for what in not_run:
        sys.stdout.write(f"NOT RUN: {what}\n")
    print_durations()
    return max(codes)


def run_python(passes: dict[str, tuple[str, ...]], arguments: list[str]) -> int:
    """Run pytest once per selection, by part, then each failed test once more in its own process."""
    BUILD.mkdir(exist_ok=True)
    failures: dict[str, str] = {}
    codes = []
    for part, selection in passes.items():
        with timed(part):
            code, failed = run_pytest(*selection, *arguments)
        if code == FAILED and not failed:
            return FAILED  # no test to rerun: the session itself failed
        failures |= failed
        codes.append(code)
    if others := set(codes) - {PASSED, FAILED, NOTHING_RAN}:
        return max(others)
    if set(codes) == {NOTHING_RAN}:
        return NOTHING_RAN
    if not failures:
        return PASSED
    with timed("failed tests once more"):
        return run_again(failures)


def run_pytest(*arguments: str) -> tuple[int, dict[str, str]]:
    """Exit code of one pytest run, and the reports of its failed tests by node id."""
    path = BUILD / "failures.jsonl"
    path.unlink(missing_ok=True)
    blocked = ("-o", f"faulthandler_timeout={LONGEST_S + BLOCKED_S}", "-o", "faulthandler_exit_on_timeout=true")
    limits = (f"--timeout={LONGEST_S}", *blocked)
    files = (f"--failures={path}", f"--seconds-spent={BUILD / DURATIONS}")
    command = [sys.executable, "-m", "pytest", "-p", "tests.suite", "-p", "tests.durations", *files, *limits, *arguments]
    code = subprocess.call(command, cwd=ROOT)
    lines = path.read_text().splitlines() if path.exists() else []
    return code, {line["test"]: line["report"] for line in map(json.loads, lines)}


def run_again(failures: dict[str, str]) -> int:
    """Rerun failed tests alone: those that pass are reported as flaky with their first failure, the others fail the run."""
    if len(failures) > MAX_RERUN:
        sys.stdout.write(f"{len(failures)} tests failed; up to {MAX_RERUN} would have been run once more\n")
        return FAILED
    flaky, failed = [], []
    for test in failures:
        sys.stdout.write(f"once more, alone: {test}\n")
        sys.stdout.flush()
        code, _ = run_pytest("-n", "0", test)
        (failed if code else flaky).append(test)
    for test in flaky:
        sys.stdout.write(f"\nFLAKY {test}: first failure\n{failures[test]}\n")
    with (BUILD / "flaky.txt").open("a") as names:
        names.writelines(f"{test}\n" for test in flaky)
    sys.stdout.writelines(f"FLAKY {test}: failed in the suite, passed alone\n" for test in flaky)
    sys.stdout.writelines(f"FAILED {test}: in the suite and alone\n" for test in failed)
    return FAILED if failed else PASSED


@contextmanager
def timed(part: str) -> Iterator[None]:
    """Note the wall time of a part of the run."""
    began = time.monotonic()
    try:
        yield
    finally:
        note_part(part, time.monotonic() - began)


def note_part(part: str, seconds: float) -> None:
    """Add a part's wall time to the file of tests/durations.py."""
    path = BUILD / DURATIONS
    BUILD.mkdir(exist_ok=True)
    known = json.loads(path.read_text()) if path.exists() else {}
    row = {"part": part, "seconds": round(seconds, 1)}
    path.write_text(json.dumps(known | {"parts": [*known.get("parts", []), row]}))


def print_durations() -> None:
    """Print where the time went."""
    sys.stdout.flush()
    subprocess.call([sys.executable, "-m", "tests.durations", str(BUILD / DURATIONS)], cwd=ROOT)


if __name__ == "__main__":
    sys.exit(main())
