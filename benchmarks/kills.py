"""Crash test of the server and its workers: after SIGKILL at random moments no acknowledged change is lost and work resumes.

    python benchmarks/kills.py [--kills 50] [--seed 0] [--real SCAN_FOLDER] [--lab [--ray]] [--json benchmarks/app.json]

One simulated user (kill_journey.py) uploads a recording, clicks, names, undoes, judges, corrects, comments, steps through the
review, runs and downloads, one request after the other; SIGKILL comes at moments drawn from a seed and hits the server, all its
workers with it, a job's process, or the live segmenter. A request whose response was lost is repeated under its key. Then the
stored state must be exactly the acknowledged one. By default the stages are stand-ins that take a moment each; with
--real (a folder with scan.r3d and prompts.json, as `r2c2r sample` writes) they are the real ones, and the moments are spread
over them: every second and third kill waits until one or two more stages have finished. The stored outputs of a finished stage
must stay the same, byte by byte. With --lab rows are in a Postgres, files in an S3 server, two servers answer and two seats
compute (kill_lab.py), with --ray one of them on a Ray node: each of these parts is killed, a seat may also be frozen until
others have taken over its job, and no job may end twice.
"""

import argparse
import contextlib
import random
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import httpx2 as httpx

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(1, str(Path(__file__).resolve().parent.parent))

from finished_stages import FinishedStages
from kept import add_options, report
from kill_journey import Journey, Refused
from kill_lab import lab
from kill_server import Server, SetUp
from waiting import PATIENCE

MOST_ACTS = 16
FIRST_KILLS = 3  # may hit the import; later kills wait until there is a project to work on
MOST_STAGES = 2  # number of stages to wait for before a kill
PATIENCE_S = 240.0 * PATIENCE


def kill_often(server: SetUp, *, kills: int, seed: int, real: Path | None = None) -> dict[str, Any]:
    """Figures of one seeded session of kills."""
    rng = random.Random(seed)
    began, restarts = time.monotonic(), []
    latest, pause = (15.0, 0.5) if real else (1.2, 0.02)
    server.start()
    journey = Journey(server, random.Random(seed + 1), real)
    stages = FinishedStages(journey, server)
    try:
        journey.sign_in()
        for kill in range(kills):
            while kill == FIRST_KILLS and not journey.ready:
                _live(journey, stages, pause)
            for _ in range(rng.randrange(MOST_ACTS)):  # moments are counted in actions: a slow machine gets as far
                _live(journey, stages, pause)
            if real:  # a stage takes as long as many actions: some kills come after one or two more stages have finished
                _live_through(journey, stages, pause, kill % (MOST_STAGES + 1))
            timer = threading.Timer(rng.uniform(0.0, latest), server.kill, (rng.choice(server.kinds),))
            timer.start()
            while timer.is_alive():
                _live(journey, stages, pause)
            timer.join()
            if not server.whole:
                started = time.monotonic()
                _live_while(threading.Thread(target=server.start), journey, stages, pause)
                restarts.append(time.monotonic() - started)
            journey.send_again()
            journey.compare()
            sys.stderr.write(f"{kill + 1} of {kills} {dict(server.hits)} {dict(journey.acknowledged)}\n")
        settled = journey.settles(900 if real else 300)
        journey.compare()
        stages.compare()
        twice = server.twice()
    finally:
        journey.client.close()
        server.stop()
    return {
        "kills": sum(server.hits.values()),
        "hits": dict(server.hits),
        "acknowledged": dict(journey.acknowledged),
        "sent_again": dict(journey.sent_again),
        "lost": journey.lost + stages.changed,
        "done_twice": twice,
        "went_on_by_itself": settled,
        "jobs": dict(journey.job_ends),
        "finished_stages_watched": len(stages.seen),
        "restart_s_median": round(sorted(restarts)[len(restarts) // 2], 2) if restarts else None,
        "seconds": round(time.monotonic() - began, 1),
        "stages": "real" if real else "stand-ins",
    }


def _live(journey: Journey, stages: FinishedStages, pause: float) -> None:
    """One action of the user; the server may die during it."""
    with contextlib.suppress(httpx.HTTPError, Refused):
        journey.act()
        stages.look()
    time.sleep(pause)


def _live_while(starting: threading.Thread, journey: Journey, stages: FinishedStages, pause: float) -> None:
    """Act until the killed part runs again; no actions while the server is down."""
    starting.start()
    while starting.is_alive():
        if journey.server.runs:
            _live(journey, stages, pause)
        starting.join(pause)


def _live_through(journey: Journey, stages: FinishedStages, pause: float, count: int) -> None:
    """Act until `count` more stages have finished."""
    wanted, deadline = len(stages.seen) + count, time.monotonic() + PATIENCE_S
    while len(stages.seen) < wanted and time.monotonic() < deadline:
        _live(journey, stages, pause)


def main() -> int:
    """Kill and report; 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--real", type=Path)
    add_options(parser)
    parser.add_argument("--lab", action="store_true", help="Postgres, an S3 server, two servers, two seats")
    parser.add_argument("--ray", action="store_true", help="with --lab: one of the seats computes on Ray")
    options = parser.parse_args()
    if options.ray and not options.lab:
        parser.error("--ray needs --lab")
    real = options.real is not None
    with tempfile.TemporaryDirectory(prefix="r2c2r-kills-") as folder:
        set_up = (
            lab(Path(folder), real=real, ray=options.ray)
            if options.lab
            else contextlib.nullcontext(Server(Path(folder) / "data", real))
        )
        with set_up as server:
            figures = kill_often(server, kills=options.kills, seed=options.seed, real=options.real)
    return report(
        "_".join(["kills", *["lab"] * options.lab, *["ray"] * options.ray, *["real"] * real]),
        figures,
        options.json,
        failed=bool(figures["lost"] or figures["done_twice"]) or not figures["went_on_by_itself"],
    )


if __name__ == "__main__":
    sys.exit(main())
