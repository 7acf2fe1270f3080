"""Kill the server and its workers at random moments of the journey: nothing acknowledged may be lost, work goes on by itself.

    python benchmarks/kills.py [--kills 50] [--seed 0] [--real SCAN_FOLDER] [--json benchmarks/app.json]

One person (kill_journey.py) uploads a recording, clicks, names, undoes, judges, corrects, comments, steps through the review,
runs and downloads, one request after the other; SIGKILL comes at moments drawn from a seed and hits the server, all its
workers with it, a job's process, or the live segmenter. The request whose answer was lost is sent again under its key. Then
what is stored must be what was acknowledged: no more, no less. By default the stages are stand-ins that take a moment each;
with --real (a folder with scan.r3d and prompts.json, as `r2c2r sample` writes) they are the real ones, and the moments are
spread over them: every second and third kill waits until one or two more stages have finished. What a finished stage stored
must stay what it was, byte by byte.
"""

import argparse
import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx2 as httpx
import psutil

sys.path.insert(0, str(Path(__file__).resolve().parent))

from finished_stages import FinishedStages
from kept import add_options, report
from kill_journey import Journey, until

ROOT = Path(__file__).resolve().parent.parent
SERVER = """
import sys, uvicorn
from pathlib import Path
from app.main import create_app
from app.settings import Settings
from app.jobs.plans import Commands
data, port, real = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "real"
if real:
    commands = Commands()
else:
    from tests.app.conftest import FAKE_COMMANDS as commands
settings = Settings(data_dir=data, launch_token="key", min_free_bytes=0, job_memory_bytes=0, import_roots=(data.parent,))
uvicorn.run(create_app(settings, commands=commands), host="127.0.0.1", port=port, log_level="critical")
"""
MOST_ACTS = 16
MOST_STAGES = 2  # that are waited for before a kill
PATIENCE_S = 240.0
HITS = ("server", "server and workers", "a job's process", "the live segmenter")


@dataclass
class Server:
    """A server that is started again whenever it was killed, always at the same address."""

    data: Path
    real: bool
    port: int = 0
    process: subprocess.Popen | None = None
    hits: Counter[str] = field(default_factory=Counter)

    @property
    def runs(self) -> bool:
        """Whether its process is there."""
        return self.process is not None and self.process.poll() is None

    @property
    def address(self) -> str:
        """Where it answers."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it and wait until it answers."""
        if not self.port:
            with socket.create_server(("127.0.0.1", 0)) as free:
                self.port = free.getsockname()[1]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        words = [sys.executable, "-c", SERVER, str(self.data), str(self.port), "real" if self.real else "fake"]
        self.process = subprocess.Popen(words, env=environment, cwd=ROOT)
        until(lambda: self._answers(), 120)

    def workers(self, *names: str) -> list[psutil.Process]:
        """Its running workers whose command line holds one of the names."""
        if self.process is None or self.process.poll() is not None:
            return []
        with contextlib.suppress(psutil.Error):
            found = psutil.Process(self.process.pid).children(recursive=True)
            return [child for child in found if not names or any(name in " ".join(_words(child)) for name in names)]
        return []

    def kill(self, what: str) -> None:
        """SIGKILL, and wait until what was hit is gone; the server when the wanted one does not run."""
        assert self.process is not None
        hit = []
        if what == "a job's process":
            hit = self.workers("worker", "ingest", "sample")
        elif what == "the live segmenter":
            hit = self.workers("live")
        elif what == "server and workers":
            hit = self.workers()
        if not hit:
            what = "server"
        self.hits[what] += 1
        for child in hit:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child.pid, signal.SIGKILL)
        if what.startswith("server"):
            self.process.kill()
            self.process.wait()

    def stop(self) -> None:
        """The end."""
        if self.process is not None:
            self.process.terminate()
            self.process.wait()

    def _answers(self) -> bool:
        with contextlib.suppress(httpx.HTTPError):
            return httpx.get(f"http://127.0.0.1:{self.port}/api/health").status_code == 200
        return False


def kill_often(data: Path, *, kills: int, seed: int, real: Path | None = None) -> dict[str, Any]:
    """The figures of one seeded session of kills."""
    rng = random.Random(seed)
    server = Server(data, real is not None)
    began, restarts = time.monotonic(), []
    latest, pause = (15.0, 0.5) if real else (1.2, 0.02)
    server.start()
    journey = Journey(server.address, data, random.Random(seed + 1), real)
    stages = FinishedStages(journey)
    try:
        journey.sign_in()
        for kill in range(kills):
            for _ in range(rng.randrange(MOST_ACTS)):  # moments are counted in what was done: a slow machine gets as far
                _live(journey, stages, pause)
            if real:  # a stage takes as long as many acts: some kills come after one or two more of them have finished
                _live_through(journey, stages, pause, kill % (MOST_STAGES + 1))
            timer = threading.Timer(rng.uniform(0.0, latest), server.kill, (rng.choice(HITS),))
            timer.start()
            while timer.is_alive():
                _live(journey, stages, pause)
            timer.join()
            if not server.runs:
                started = time.monotonic()
                server.start()
                restarts.append(time.monotonic() - started)
            journey.send_again()
            journey.compare()
            sys.stderr.write(f"{kill + 1} of {kills} {dict(server.hits)} {dict(journey.acknowledged)}\n")
        settled = journey.settles(900 if real else 300)
        journey.compare()
        stages.compare()
    finally:
        journey.client.close()
        server.stop()
    return {
        "kills": sum(server.hits.values()),
        "hits": dict(server.hits),
        "acknowledged": dict(journey.acknowledged),
        "sent_again": dict(journey.sent_again),
        "lost": journey.lost + stages.changed,
        "went_on_by_itself": settled,
        "jobs": dict(journey.job_ends),
        "finished_stages_watched": len(stages.seen),
        "restart_s_median": round(sorted(restarts)[len(restarts) // 2], 2) if restarts else None,
        "seconds": round(time.monotonic() - began, 1),
        "stages": "real" if real else "stand-ins",
    }


def _live(journey: Journey, stages: FinishedStages, pause: float) -> None:
    """One thing this person does; the server may vanish meanwhile."""
    with contextlib.suppress(httpx.HTTPError):
        journey.act()
        stages.look()
    time.sleep(pause)


def _live_through(journey: Journey, stages: FinishedStages, pause: float, count: int) -> None:
    """Live until so many more stages have finished."""
    wanted, deadline = len(stages.seen) + count, time.monotonic() + PATIENCE_S
    while len(stages.seen) < wanted and time.monotonic() < deadline:
        _live(journey, stages, pause)


def _words(process: psutil.Process) -> list[str]:
    try:
        return [Path(word).name for word in process.cmdline()]
    except psutil.Error:
        return []


def main() -> int:
    """Kill, report; 1 when something was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--real", type=Path)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-kills-") as folder:
        figures = kill_often(Path(folder) / "data", kills=options.kills, seed=options.seed, real=options.real)
    return report(
        "kills" if options.real is None else "kills_real",
        figures,
        options.json,
        failed=bool(figures["lost"]) or not figures["went_on_by_itself"],
    )


if __name__ == "__main__":
    sys.exit(main())
