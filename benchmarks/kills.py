"""Kill the server and its workers at random moments of the journey: nothing acknowledged may be lost, work goes on by itself.

    python benchmarks/kills.py [--kills 50] [--seed 0] [--real SCAN_FOLDER] [--json benchmarks/app.json]

One person clicks, names, undoes, judges, corrects, uploads and runs, one request after the other; SIGKILL comes at moments
drawn from a seed and hits the server, all its workers with it, a job's process, or the live segmenter. What the server had
answered is compared with what the next one says. The request that was under way may count or not, but nothing in between.
By default the stages are stand-ins that take a moment each; with --real (a folder with scan.r3d and prompts.json, as
`r2c2r sample` writes) they are the real ones, and what a finished stage stored must stay what it was, byte by byte.
"""

import argparse
import contextlib
import hashlib
import json
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

from kept import add_options, report

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
HITS = ("server", "server and workers", "a job's process", "the live segmenter")
PIECE = 64


class Refused(Exception):
    """The server answered with an error."""


@dataclass
class Server:
    """A server that is started again whenever it was killed, always at the same address."""

    data: Path
    real: bool
    port: int = 0
    process: subprocess.Popen | None = None

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
        """SIGKILL, and wait until what was hit is gone."""
        assert self.process is not None
        hit = []
        if what == "a job's process":
            hit = self.workers("worker", "ingest", "sample")
        elif what == "the live segmenter":
            hit = self.workers("live")
        elif what == "server and workers":
            hit = self.workers()
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


@dataclass
class Journey:
    """What one person does, and what the server said to it."""

    server: Server
    rng: random.Random
    project: str = ""
    frames: list[dict[str, Any]] = field(default_factory=list)
    objects: dict[int, dict[str, Any]] = field(default_factory=dict)  # by number, as last acknowledged
    verdicts: dict[int, dict[str, Any]] = field(default_factory=dict)
    upload: tuple[str, int] | None = None  # id, acknowledged bytes
    clicks: int = 0
    lost: list[str] = field(default_factory=list)
    client: httpx.Client = field(default_factory=lambda: httpx.Client(timeout=60))

    def ask(self, method: str, path: str, **options: Any) -> Any:
        """One request; raises httpx.HTTPError when the server vanished meanwhile, Refused when it says no."""
        headers = {"X-Requested-With": "kills", **options.pop("headers", {})}
        answer = self.client.request(method, f"http://127.0.0.1:{self.server.port}{path}", headers=headers, **options)
        if answer.status_code >= 500 and answer.status_code != 503:
            self.lost.append(f"{method} {path}: {answer.status_code} {answer.text[:200]}")
        if answer.status_code >= 400:
            raise Refused(f"{method} {path}: {answer.status_code} {answer.text[:200]}")
        return answer.json() if answer.content and "json" in answer.headers["content-type"] else answer

    def sign_in(self) -> None:
        """The session outlives every server."""
        self.client.get(f"http://127.0.0.1:{self.server.port}/", params={"token": "key"})

    def act(self) -> None:
        """One random thing a person does."""
        at = f"/api/projects/{self.project}"
        known = [number for number, item in self.objects.items() if not item["deleted"]]
        number = self.rng.choice(known) if known else 0
        where = f"{at}/objects/{number}"
        actions = [self._upload, self._run]
        if not self.server.real:  # a click anywhere would be an object more to reconstruct
            actions += [self._add] * 2
            actions += [lambda: self._take("POST", f"{where}/points", self._click())] * (4 if number else 0)
        if number:
            actions += [lambda: self._take("PATCH", where, {"category": self.rng.choice(["drawer", "oven", "mug"])})]
            actions += [lambda: self._take("POST", f"{at}/undo", {"object": number})]
            actions += [lambda: self._correct(where, number)] * 2
        with contextlib.suppress(Refused):
            self.rng.choice(actions)()

    def compare(self) -> None:
        """Everything acknowledged is there; the request that was under way may be there too."""
        now = {item["id"]: item for item in self.ask("GET", f"/api/projects/{self.project}/objects?deleted=true")}
        for number, said in self.objects.items():
            self._compare_object(number, said, now.get(number))
        if len(now) > len(self.objects) + 1:
            self.lost.append(f"{len(now)} objects, {len(self.objects)} were acknowledged")
        for number in now:
            override = (
                self.ask("GET", f"/api/projects/{self.project}/objects/{number}/override") if not now[number]["deleted"] else {}
            )
            said = self.verdicts.get(number)
            if said is not None and now[number]["version"] == self.objects[number]["version"] and override and override != said:
                self.lost.append(f"object {number}: corrected to {said}, found {override}")
            if override:
                self.verdicts[number] = override
        self.objects = now
        if self.upload is not None:
            length = int(self.ask("HEAD", f"/api/uploads/{self.upload[0]}").headers["upload-offset"])
            if length < self.upload[1]:
                self.lost.append(f"upload: {self.upload[1]} bytes acknowledged, {length} found")
            self.upload = (self.upload[0], length)

    def _compare_object(self, number: int, said: dict[str, Any], found: dict[str, Any] | None) -> None:
        if found is None:
            self.lost.append(f"object {number} is gone")
        elif found["version"] < said["version"] or found["version"] > said["version"] + 1:
            self.lost.append(f"object {number}: version {said['version']} acknowledged, {found['version']} found")
        elif found["version"] == said["version"]:
            kept = ("name", "category", "points", "deleted")
            if any(found[key] != said[key] for key in kept):
                self.lost.append(f"object {number}: {said} acknowledged, {found} found")

    def _take(self, method: str, path: str, body: Any) -> None:
        answer = self.ask(method, path, json=body)
        item = answer.get("object", answer) if "points" not in answer else answer
        self.clicks += 1
        self.objects[item["id"]] = item

    def _add(self) -> None:
        if len(self.objects) < 12:
            category = self.rng.choice(["drawer", "cabinet", "mug"])
            self._take("POST", f"/api/projects/{self.project}/objects", {"category": category, "points": [self._click()]})

    def _click(self) -> dict[str, Any]:
        frame = self.rng.choice(self.frames)
        x, y = self.rng.uniform(0, frame["width"] - 1), self.rng.uniform(0, frame["height"] - 1)
        return {"frame": frame["index"], "x": x, "y": y, "label": 1}

    def _correct(self, where: str, number: int) -> None:
        hinge = self.rng.choice(["left", "right", None])
        self.ask("PATCH", f"{where}/override", json={"hinge": hinge, "rerun": False})
        self.verdicts[number] = self.ask("GET", f"{where}/override")
        self.objects[number] = next(
            item for item in self.ask("GET", f"/api/projects/{self.project}/objects?deleted=true") if item["id"] == number
        )

    def _upload(self) -> None:
        if self.upload is None:
            self.upload = (self.ask("POST", "/api/uploads", json={"file_name": "big.zip", "size": 1 << 20})["id"], 0)
        number, offset = self.upload
        headers = {"Upload-Offset": str(offset)}
        answer = self.ask("PATCH", f"/api/uploads/{number}", content=bytes(PIECE), headers=headers)
        self.upload = (number, int(answer.headers["upload-offset"]))

    def _run(self) -> None:
        self.ask("POST", f"/api/projects/{self.project}/run", json={})


def kill_often(data: Path, *, kills: int, seed: int, real: Path | None = None) -> dict[str, Any]:
    """The figures of one seeded session of kills."""
    rng = random.Random(seed)
    journey = Journey(Server(data, real is not None), random.Random(seed + 1))
    began, hits, restarts = time.monotonic(), Counter[str](), []
    stages = _FinishedStages()
    try:
        journey.server.start()
        journey.sign_in()
        _import(journey, real)
        for _ in range(kills):
            what = rng.choice(HITS)
            moment = rng.uniform(0.05, 8.0 if real else 1.2)
            timer = threading.Timer(moment, journey.server.kill, (what,))
            timer.start()
            while timer.is_alive() or (what.startswith("server") and journey.server.process.poll() is None):  # type: ignore[union-attr]
                try:
                    journey.act()
                    stages.look(journey)
                    time.sleep(0.02)
                except httpx.HTTPError:
                    break
            timer.join()
            hits[what] += 1
            if what.startswith("server"):
                started = time.monotonic()
                journey.server.start()
                restarts.append(time.monotonic() - started)
            journey.compare()
        settled = _settles(journey, 600 if real else 120)
        stages.compare(journey)
    finally:
        journey.client.close()
        journey.server.stop()
    return {
        "kills": sum(hits.values()),
        "hits": dict(hits),
        "acknowledged": journey.clicks,
        "lost": journey.lost + stages.changed,
        "went_on_by_itself": settled,
        "finished_stages_watched": len(stages.seen),
        "restart_s_median": round(sorted(restarts)[len(restarts) // 2], 2) if restarts else None,
        "seconds": round(time.monotonic() - began, 1),
        "stages": "real" if real else "stand-ins",
    }


class _FinishedStages:
    """What a finished stage stored stays what it was as long as the same run goes on."""

    def __init__(self) -> None:
        self.seen: dict[tuple[int, str, str], dict[str, str]] = {}
        self.changed: list[str] = []
        self._looked = 0.0

    def look(self, journey: Journey) -> None:
        """Note the files of stages that a running job has finished; compare those noted before."""
        if time.monotonic() - self._looked < 0.5:
            return
        self._looked = time.monotonic()
        self.compare(journey)

    def compare(self, journey: Journey) -> None:
        """Note and compare."""
        work = journey.server.data / "projects" / journey.project / "work"
        with contextlib.suppress(Refused):
            for job in journey.ask("GET", f"/api/jobs?project={journey.project}&limit=1"):
                for stage in job["stages"]:
                    if job["kind"] != "run" or stage["state"] != "done":
                        continue
                    key, digests = (job["id"], stage["name"], _given(work)), _digests(work, stage["name"])
                    if digests and self.seen.setdefault(key, digests) != digests:
                        self.changed.append(f"job {job['id']}: what {stage['name']} had stored was changed")
                        self.seen[key] = digests


def _given(work: Path) -> str:
    """What the run was given: a run that is taken up again takes the clicks of then."""
    return hashlib.sha256(b"".join((work / name).read_bytes() for name in ("prompts.json", "overrides.json"))).hexdigest()


def _digests(work: Path, stage: str) -> dict[str, str]:
    found = {}
    for path in sorted((work / "nouns" / stage).glob("*.noun")):
        with contextlib.suppress(FileNotFoundError):
            found[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def _import(journey: Journey, real: Path | None) -> None:
    if real is None:
        journey.project = journey.ask("POST", "/api/projects/sample", json={})["id"]
    else:
        scan = journey.server.data.parent / "scan.r3d"
        scan.write_bytes((real / "scan.r3d").read_bytes())
        journey.project = journey.ask("POST", "/api/projects/import", json={"path": str(scan)})["id"]
    until(lambda: journey.ask("GET", f"/api/projects/{journey.project}")["status"] == "ready", 300)
    if real is not None:
        prompts = json.loads((real / "prompts.json").read_text())
        journey.ask(
            "POST", f"/api/projects/{journey.project}/prompts.json", json={**prompts, "objects": prompts["objects"][:4]}
        )
    journey.frames = journey.ask("GET", f"/api/projects/{journey.project}/frames")
    found = journey.ask("GET", f"/api/projects/{journey.project}/objects?deleted=true")
    journey.objects = {item["id"]: item for item in found}
    folder = journey.server.data / "projects" / journey.project
    if real is None:  # each stand-in takes a moment
        (folder / "behave.json").write_text(json.dumps(dict.fromkeys(("segment", "generate", "align", "export"), "slow")))


def _settles(journey: Journey, seconds: float) -> bool:
    """Whether every job and every object's masks come to an end with nobody asking for it."""

    def quiet() -> bool:
        jobs = journey.ask("GET", f"/api/jobs?project={journey.project}")
        lanes = journey.ask("GET", f"/api/projects/{journey.project}/lanes")
        busy = [job for job in jobs if job["state"] in ("queued", "running", "cancelling")]
        failed = [
            job
            for job in jobs
            if job["state"] == "failed" and (job["error"] or {}).get("kind") in ("worker-died", "interrupted")
        ]
        journey.lost += [f"job {job['id']} gave up: {job['error']['message']}" for job in failed if not journey.lost]
        return not busy and all(lane["state"] not in ("waiting", "running", "partial") for lane in lanes)

    with contextlib.suppress(TimeoutError):
        until(quiet, seconds)
        return True
    return False


def _words(process: psutil.Process) -> list[str]:
    try:
        return [Path(word).name for word in process.cmdline()]
    except psutil.Error:
        return []


def until(condition: Any, seconds: float) -> None:
    """Wait for it; raises TimeoutError."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"not within {seconds} s")
        time.sleep(0.05)


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
