"""Start time and memory of `r2c2r serve` with its defaults, alternately for this checkout and an earlier one.

    python benchmarks/start_up.py [--against CHECKOUT] [--starts 7] [--json benchmarks/app.json]

Each start is on a data folder whose database exists. Recorded are the seconds until /api/health answers, the memory of the
process then (PSS: a page that processes share counts once), and which of the libraries of a laboratory's deployment it loaded.
Both checkouts use this Python environment.
"""

import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx2 as httpx
import psutil
from kept import add_options, report
from waiting import until

HERE = Path(__file__).resolve().parents[1]
LIBRARIES = ("psycopg", "obstore", "ray", "_raylet")
START_S = 120.0


def main() -> int:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="checkout of an earlier commit")
    parser.add_argument("--starts", type=int, default=7)
    add_options(parser)
    options = parser.parse_args()
    checkouts = {"this": HERE, **({"earlier": options.against.resolve()} if options.against else {})}
    with tempfile.TemporaryDirectory(prefix="r2c2r-start-") as folder:
        for name, checkout in checkouts.items():
            start(checkout, Path(folder) / name)  # makes the database
        starts = [{name: start(root, Path(folder) / name) for name, root in checkouts.items()} for _ in range(options.starts)]
    figures = {name: _summary([each[name] for each in starts]) for name in checkouts}
    return report("start_up", figures, options.json, failed=any(each["libraries"] for each in figures.values()))


def start(checkout: Path, data: Path) -> dict[str, Any]:
    """Start the server once: its figures."""
    command = [sys.executable, "-m", "r2c2r_core.cli", "serve", "--data", str(data), "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    began = time.monotonic()
    with subprocess.Popen(command, cwd=checkout, env=environment, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = re.search(r"http://[^/\s]+", server.stdout.readline())
            assert address, "the server printed no address"
            until(lambda: _answers(f"{address.group()}/api/health"), START_S)
            took = time.monotonic() - began
            process = psutil.Process(server.pid)
            mapped = " ".join(region.path for region in process.memory_maps())
            return {
                "seconds": took,
                "megabytes": process.memory_full_info().pss / 1e6,
                "libraries": [name for name in LIBRARIES if f"/{name}" in mapped],
            }
        finally:
            server.terminate()


def _answers(url: str) -> bool:
    try:
        return httpx.get(url).is_success
    except httpx.HTTPError:
        return False


def _summary(starts: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians over the starts."""
    return {
        "seconds": round(statistics.median(each["seconds"] for each in starts), 2),
        "megabytes": round(statistics.median(each["megabytes"] for each in starts), 1),
        "libraries": sorted({name for each in starts for name in each["libraries"]}),
    }


if __name__ == "__main__":
    sys.exit(main())
