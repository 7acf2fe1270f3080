"""Throughput in kitchens per hour by number of seats: bottlenecks of rows, files and pages, and needs of 1000 kitchens a day.

    python benchmarks/throughput.py [--seats 1,2,4] [--quicker 8] [--kitchens 2] [--json benchmarks/throughput.json]
    python benchmarks/throughput.py --one [--seats 1,2,4] [--model-s 10] [--json benchmarks/throughput.json]

A laboratory's deployment on this machine: a server without compute, a Postgres with durable commits, an S3 server, and seats
whose stages sleep as long as the real ones took (benchmarks/speed.json, 14 objects in 180 frames) and store as many files and
bytes. As stages cost no CPU, the cost of rows, files, pages and seats can be measured: CPU seconds per kitchen, from its upload
by a program over clicks and a run to its bundle. --quicker repeats the largest number of seats with all durations divided by
that number, which loads everything but the stages like that many times more seats.

--one measures the run of a single kitchen instead, whose objects are distributed over all seats. A stage's time before its
objects, and per object, is a regression line over kitchens of different object counts (SPEED); a process takes as long to start
as a run without any change. --model-s makes each object's meshes take so many seconds, as with a generative model, one after
another in a process.
"""

import argparse
import contextlib
import json
import math
import os
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx2 as httpx
import psutil
import psycopg

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(1, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report
from kill_server import ROOT, Server, kill_all

from r2c2r_core.client import Server as Client
from r2c2r_core.pipeline import OBJECT_STAGES
from tests.app.object_server import BUCKET, ObjectServer, object_server
from tests.app.postgres import PostgresServer, server

SPEED = ROOT / "benchmarks" / "speed.json"
OBJECTS, FRAMES, POINTS = 14, 180, 3  # of a kitchen; POINTS: clicks on each object
RECORDING_BYTES = 51_000_000
STORED = {  # files and bytes that each stage of that kitchen stores (`r2c2r sample` and `run`, seed 0)
    "ingest": (363, 41_400_000),
    "segment": (48, 22_200_000),
    "generate": (14, 13_400_000),
    "align": (14, 35_000),
    "synthesize": (1, 119_000),
    "warp": (1, 5_000_000),
    "export": (1, 8_600_000),
}
SEAT = """
import sys, threading
from dataclasses import replace
from pathlib import Path
from app.settings import Settings
from app.work import run_jobs
from tests.app.conftest import BARE, FAKES, FAKE_COMMANDS
data, lengths, stage = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
def slow(name): return sys.executable, BARE, stage, lengths, str(FAKES / f"{name}.py")
commands = replace(FAKE_COMMANDS, worker=slow("worker"), ingest=slow("ingest"))
run_jobs(Settings(data_dir=data, min_free_bytes=0, job_memory_bytes=0), commands, threading.Event())
"""
SERVES_ONLY = {"heavy_jobs": 0}
DURABLE = ("max_connections=200",)  # all else is the default: committed data is on the disk
WRITER = 0x72326332  # advisory lock of app.db.postgres
LOOKED_EVERY_S = 0.02
UPLOADS = 3  # at a time: the server examines only a few uploads of one person at once
A_DAY, WORKING_DAY_S = 1000, 8 * 3600  # kitchens per day, which arrive during working hours


class Farm(Server):
    """A server without compute, and a number of seats."""

    def __init__(self, folder: Path, seats: int, lengths: Path, rows: PostgresServer, store: ObjectServer) -> None:
        super().__init__(folder / "web", real=False)
        self._folder, self._count, self._lengths, self._rows, self._store = folder, seats, lengths, rows, store
        self.address_of_rows = rows.of_folder(folder)
        self._place = f"{BUCKET}/{folder.name}"
        self._seats: list[subprocess.Popen[bytes]] = []
        os.environ.update(store.environment)
        self.settings = SERVES_ONLY

    def environment(self) -> dict[str, str]:
        """Environment with the addresses of rows and files."""
        places = {"R2C2R_DATABASE": self.address_of_rows, "R2C2R_STORE": f"s3://{self._place}", "RUST_LOG": "error"}
        return {**super().environment(), **places}

    def start(self) -> None:
        """Start the server, then the seats."""
        super().start()
        for number in range(self._count):
            data = self._folder / f"seat-{number}"
            data.mkdir()
            command = [
                sys.executable,
                "-c",
                SEAT,
                str(data),
                str(self._lengths),
                str(Path(__file__).with_name("throughput_stage.py")),
            ]
            self._seats.append(subprocess.Popen(command, env=self.environment(), cwd=ROOT, stdout=subprocess.PIPE))
        for seat in self._seats:
            assert seat.stdout is not None
            seat.stdout.readline()  # wait until it takes jobs

    def stop(self) -> None:
        """Stop the seats and the server."""
        kill_all([psutil.Process(seat.pid) for seat in self._seats])
        for seat in self._seats:
            seat.wait()
            assert seat.stdout is not None
            seat.stdout.close()
        super().stop()

    def client(self) -> Client:
        """An API client with an admin token."""
        with httpx.Client(headers={"X-Requested-With": "throughput"}) as browser:
            browser.get(f"{self.address}/", params={"token": "key"})
            made = browser.post(f"{self.address}/api/tokens", json={"name": "throughput", "scope": "admin"})
        return Client(self.address, made.json()["secret"])

    def spent(self, apart: int) -> dict[str, float]:
        """CPU seconds so far, by part; the database's backend with pid `apart`, which only monitors, is excluded."""
        assert self.process is not None
        rows = psutil.Process(self._rows.pid)
        return {
            "database": _seconds(rows, ended=True) + sum(_seconds(each) for each in rows.children() if each.pid != apart),
            "store": _seconds(psutil.Process(self._store.process.pid)),
            "web": _seconds(psutil.Process(self.process.pid)),
            "seats": sum(_seconds(psutil.Process(seat.pid)) for seat in self._seats),
        }

    def stored(self) -> tuple[int, int]:
        """Number of objects in the store, and their bytes."""
        import obstore

        entries = [each for chunk in obstore.list(obstore.store.from_url(f"s3://{self._place}")) for each in chunk]
        return len(entries), sum(each["size"] for each in entries)


class Looks:
    """Monitor of the database: samples how often its one writer holds the lock, and how many wait for it."""

    def __init__(self, address: str) -> None:
        self._rows = psycopg.connect(address.replace("+psycopg", ""), autocommit=True)
        self.pid = self._rows.info.backend_pid
        self._before = self._counted()
        self._looks = self._held = self._waiting = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def end(self, kitchens: int) -> dict[str, float]:
        """Stop sampling; fractions of the time, and WAL and transactions per kitchen."""
        self._ended.set()
        self._thread.join()
        wal, commits = (now - before for now, before in zip(self._counted(), self._before, strict=True))
        self._rows.close()
        return {
            "writer_holds_the_lock": round(self._held / self._looks, 4),
            "wait_for_it": round(self._waiting / self._looks, 4),
            "wal_mb_a_kitchen": round(wal / kitchens / 1e6, 2),
            "transactions_a_kitchen": round(commits / kitchens),
        }

    def _look(self) -> None:
        while not self._ended.wait(LOOKED_EVERY_S):
            held, waiting = self._ask(
                "SELECT count(*) FILTER (WHERE granted), count(*) FILTER (WHERE NOT granted) "
                f"FROM pg_locks WHERE locktype = 'advisory' AND objid = {WRITER}"
            )
            self._looks, self._held, self._waiting = self._looks + 1, self._held + held, self._waiting + waiting

    def _counted(self) -> tuple[int, int]:
        wal, commits = self._ask(
            "SELECT pg_current_wal_insert_lsn() - '0/0', xact_commit FROM pg_stat_database WHERE datname = current_database()"
        )
        return int(wal), int(commits)

    def _ask(self, statement: str) -> Any:
        return self._rows.execute(statement).fetchone()


def one_round(farm: Farm, folder: Path, kitchens: int, stages_s: float, seats: int) -> dict[str, Any]:
    """Process `kitchens` kitchens, submitted at once; total time, and cost per kitchen."""
    recordings, client = _recordings(folder, kitchens), farm.client()
    looks = Looks(farm.address_of_rows)
    before, began = farm.spent(looks.pid), time.monotonic()
    uploading = threading.Semaphore(UPLOADS)
    with ThreadPoolExecutor(kitchens) as pool:
        list(pool.map(lambda recording: _one_kitchen(client, recording, uploading), recordings))
    took, after = time.monotonic() - began, farm.spent(looks.pid)
    objects, size = farm.stored()
    return {
        "seats": seats,
        "stages_s": round(stages_s, 1),
        "kitchens": kitchens,
        "seconds": round(took, 1),
        "kitchens_an_hour": round(kitchens * 3600 / took, 1),
        "seats_in_stages": round(kitchens * stages_s / seats / took, 3),
        "cpu_s_a_kitchen": {part: round((after[part] - before[part]) / kitchens, 2) for part in after},
        "objects_a_kitchen": round(objects / kitchens),
        "stored_mb_a_kitchen": round(size / kitchens / 1e6, 1),
        **looks.end(kitchens),
    }


def one_run(farm: Farm, folder: Path) -> float:
    """Seconds from the start of one kitchen's run to its bundle."""
    (recording,), client = _recordings(folder, 1), farm.client()
    project = client.upload(recording)
    client.wait(project)
    client.click(project, prompts())
    began = time.monotonic()
    client.run(project)
    client.wait(project)
    return round(time.monotonic() - began, 1)


def _one_kitchen(client: Client, recording: Path, uploading: threading.Semaphore) -> None:
    """One kitchen from the upload to the bundle, through the API client."""
    with uploading:
        project = client.upload(recording)
    client.wait(project)
    client.click(project, prompts())
    client.run(project)
    client.wait(project)
    client.download(project, recording.with_suffix(".bundle"))


def prompts() -> dict[str, Any]:
    """Clicks on the objects of a kitchen, on frames that the import's stand-in provides."""
    points = [{"frame": frame, "x": 80.5, "y": 60.5, "label": 1} for frame in (0, 3, 7)[:POINTS]]
    objects = [{"name": f"drawer_{number}", "category": "drawer", "points": points} for number in range(OBJECTS)]
    return {"version": 1, "objects": objects}


def _recordings(folder: Path, count: int) -> list[Path]:
    """One recording under many names, as interrupted uploads are identified by name."""
    first = folder / "0.r3d"
    with zipfile.ZipFile(first, "w") as archive:
        archive.writestr("metadata", b"{}")
        archive.writestr("noise", random.Random(0).randbytes(RECORDING_BYTES))
    for number in range(1, count):
        os.link(first, folder / f"{number}.r3d")
    return [folder / f"{number}.r3d" for number in range(count)]


def _seconds(process: psutil.Process, *, ended: bool = False) -> float:
    """CPU seconds of a process; with `ended`, including its terminated children."""
    with contextlib.suppress(psutil.NoSuchProcess):
        times = process.cpu_times()
        return times.user + times.system + (times.children_user + times.children_system if ended else 0.0)
    return 0.0


def lengths_of_stages(quicker: float, model_s: float = 0.0) -> dict[str, dict[str, float]]:
    """Duration and stored files of each stage."""
    took = _measured(OBJECTS, FRAMES)
    lengths = {
        stage: {"seconds": seconds / quicker, "files": STORED[stage][0], "bytes": STORED[stage][1]}
        for stage, seconds in took.items()
    }
    start_s = json.loads(SPEED.read_text())["run"]["nothing changed"]["wall_s"]
    for stage in OBJECT_STAGES:
        lengths[stage] |= {"shared": max(_before_objects(stage), start_s) / quicker, "start": start_s / quicker}
    if model_s:
        lengths["generate"] |= {"seconds": start_s + OBJECTS * model_s, "shared": start_s}
    return lengths


def _before_objects(stage: str) -> float:
    """Seconds of a stage before its first object: intercept of a linear regression over kitchens of FRAMES frames."""
    rows = [row for row in json.loads(SPEED.read_text())["stages"] if row["frames"] == FRAMES]
    return statistics.linear_regression([row["objects"] for row in rows], [row[stage]["wall_s"] for row in rows]).intercept


def _measured(objects: int, frames: int) -> dict[str, float]:
    rows = json.loads(SPEED.read_text())["stages"]
    row = next(row for row in rows if (row["objects"], row["frames"]) == (objects, frames))
    return {stage: row[stage]["wall_s"] for stage in STORED}


def limits(rounds: list[dict[str, Any]]) -> dict[str, float]:
    """Kitchens per hour at which one core, or the one writer, is saturated; from the busiest round, which idles least."""
    busiest = max(rounds, key=lambda each: each["kitchens_an_hour"])
    of = {f"one core of the {part}": 3600 / cost for part, cost in busiest["cpu_s_a_kitchen"].items() if part != "seats"}
    of["the one writer of rows"] = busiest["kitchens_an_hour"] / max(busiest["writer_holds_the_lock"], 1e-4)
    return {name: round(rate) for name, rate in sorted(of.items(), key=lambda item: item[1])}


def needs(rounds: list[dict[str, Any]]) -> dict[str, Any]:
    """Seats, cores and storage for a thousand kitchens a day, all within eight hours."""
    busiest, plain = max(rounds, key=lambda each: each["kitchens_an_hour"]), rounds[0]
    share = A_DAY / WORKING_DAY_S
    seats = {
        f"{objects} objects, {frames} frames": math.ceil(
            sum(_measured(objects, frames).values()) * share / plain["seats_in_stages"]
        )
        for objects, frames in ((OBJECTS, 60), (OBJECTS, FRAMES), (OBJECTS, 600))
    }
    cores = {part: round(cost * share, 2) for part, cost in busiest["cpu_s_a_kitchen"].items()}
    return {"seats": seats, "cores": cores, "stored_gb": round(busiest["stored_mb_a_kitchen"] * A_DAY / 1e3, 1)}


def table(figures: dict[str, Any]) -> str:
    """The rounds as a Markdown table."""
    lines = ["| seats | stages of a kitchen | kitchens an hour | seats in stages | database | store | web | seats | writer |"]
    lines += [f"|{'---|' * 9}"]
    for each in figures["rounds"]:
        cost = " | ".join(f"{each['cpu_s_a_kitchen'][part]:.1f} s" for part in ("database", "store", "web", "seats"))
        busy = f"{100 * each['seats_in_stages']:.0f} % | {cost} | {100 * each['writer_holds_the_lock']:.1f} %"
        lines.append(f"| {each['seats']} | {each['stages_s']:.0f} s | {each['kitchens_an_hour']:.0f} | {busy} |")
    return "\n".join(lines)


@contextlib.contextmanager
def farm(
    folder: Path, seats: int, quicker: float, rows: PostgresServer, store: ObjectServer, model_s: float = 0.0
) -> Iterator[Farm]:
    """A running farm in a folder of its own."""
    folder.mkdir()
    lengths = folder / "lengths.json"
    lengths.write_text(json.dumps(lengths_of_stages(quicker, model_s)))
    made = Farm(folder, seats, lengths, rows, store)
    try:
        made.start()
        yield made
    finally:
        made.stop()


def _measure_one(counts: tuple[int, ...], model_s: float, file: Path | None) -> int:
    took: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="r2c2r-throughput-") as scratch, server(DURABLE) as rows, object_server() as store:
        for seats in counts:
            folder = Path(scratch) / f"seats-{seats}"
            with farm(folder, seats, 1.0, rows, store, model_s) as running:
                took[str(seats)] = one_run(running, folder)
    part = "one_kitchen_with_a_model" if model_s else "one_kitchen"
    return report(part, {"seconds_by_seats": took, "model_s": model_s, "objects": OBJECTS, "frames": FRAMES}, file)


def main() -> int:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seats", type=lambda text: tuple(int(part) for part in text.split(",")), default=(1, 2, 4))
    parser.add_argument("--quicker", type=float, default=8.0)
    parser.add_argument("--kitchens", type=int, default=2, help="kitchens per seat")
    parser.add_argument("--one", action="store_true", help="measure a single kitchen that all seats share")
    parser.add_argument("--model-s", type=float, default=0.0, help="with --one: seconds that a model takes per object")
    add_options(parser)
    options = parser.parse_args()
    if options.one:
        return _measure_one(options.seats, options.model_s, options.json)
    asked = [(seats, 1.0, seats * options.kitchens) for seats in options.seats]
    asked.append((max(options.seats), options.quicker, max(options.seats) * options.kitchens * 2))
    rounds = []
    with tempfile.TemporaryDirectory(prefix="r2c2r-throughput-") as scratch, server(DURABLE) as rows, object_server() as store:
        for number, (seats, quicker, kitchens) in enumerate(asked):
            folder = Path(scratch) / f"round-{number}"
            with farm(folder, seats, quicker, rows, store) as running:
                stages_s = sum(_measured(OBJECTS, FRAMES).values()) / quicker
                rounds.append(one_round(running, folder, kitchens, stages_s, seats))
            sys.stderr.write(json.dumps(rounds[-1]) + "\n")
    figures = {"rounds": rounds, "limits": limits(rounds), "a_thousand_a_day": needs(rounds), "cores": os.cpu_count()}
    print(table(figures))
    return report("throughput", figures, options.json)


if __name__ == "__main__":
    sys.exit(main())
