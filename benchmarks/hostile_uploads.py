"""Robustness test of malicious or broken uploads: each must end in 4xx with a one-line message, and leave nothing behind.

    python benchmarks/hostile_uploads.py [--count 1000] [--seed 0] [--json benchmarks/app.json]

A good recording (a tiny room as a .r3d) is damaged in every way listed in hostile_kinds.py, each with its own random choices,
and the protocol of resumable uploads is misused. After each: no file, no row, no process left; at the end: no memory leaked.
"""

import argparse
import ctypes
import gc
import random
import sys
import tempfile
import time
import zipfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from hostile_kinds import KINDS, Members, packed
from kept import add_options, report
from waiting import PATIENCE

from app.jobs.plans import Commands
from tests.app.conftest import Running, running
from tests.core.ingest.tiny import TinyRoom, write_r3d

ABUSE = "abused_protocol"
ENDED_S = 60.0  # processes of a request end with it: one that is still there after this long counts as left behind
NAMES = ("scan.r3d", "scan.zip", "../../etc/passwd", "a\nb.r3d", "<img src=x onerror=alert(1)>.zip", "\u202egpj.zip", "x" * 300)


def good_members(folder: Path) -> Members:
    """Members of a valid recording."""
    path = write_r3d(folder / "good.r3d", replace(TinyRoom(), count=4))
    with zipfile.ZipFile(path) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist() if not info.is_dir()}


def send_all(folder: Path, count: int, seed: int) -> dict[str, Any]:
    """Send `count` hostile uploads to a separate app; the faults, what was left behind, memory and time."""
    rng = random.Random(seed)
    good = good_members(folder)
    statuses, wrong, slowest, by_kind = Counter[int](), [], (0.0, ""), Counter[str]()
    names = [kind.__name__ for kind in KINDS] + [ABUSE]
    began = time.monotonic()
    with running(folder / "data", commands=Commands(), run_jobs=False) as web:
        assert upload(web, packed(good), "good.r3d").status_code == 202, "the undamaged recording is taken"
        for project in web.get("/api/projects"):
            web.delete(f"/api/projects/{project['id']}")
            web.delete(f"/api/trash/{project['id']}")
        memory = [_memory_mb()]
        ours = set(psutil.Process().children(recursive=True))  # processes of this benchmark
        for number in range(count):
            name = names[number % len(names)]
            sent = time.monotonic()
            if name == ABUSE:
                answers = abused_protocol(web, good, rng)
            else:
                answers = [upload(web, KINDS[names.index(name)](good, rng), rng.choice(NAMES))]
            slowest = max(slowest, (time.monotonic() - sent, name))
            by_kind[name] += 1
            statuses.update(answer.status_code for answer in answers)
            problem = next(filter(None, (complaint(web, answer) for answer in answers)), "") or left_behind(web, ours)
            if problem:
                wrong.append(f"{name} ({number}): {problem}")
            if number % max(count // 4, 1) == 0:
                memory.append(_memory_mb())
                sys.stderr.write(f"{number} of {count} in {time.monotonic() - began:.0f} s, wrong: {wrong}\n")
        memory.append(_memory_mb())
    return {
        "count": count,
        "kinds": dict(by_kind),
        "statuses": {str(status): many for status, many in sorted(statuses.items())},
        "wrong": wrong,
        "slowest_s": round(slowest[0], 2),
        "slowest_kind": slowest[1],
        "memory_mb": [round(size) for size in memory],  # before, after each quarter, and at the end
        "seconds": round(time.monotonic() - began, 1),
    }


def upload(web: Running, content: bytes, name: str) -> Any:
    """One upload in one piece."""
    return web.client.post("/api/projects/upload", params={"filename": name}, content=content)


def abused_protocol(web: Running, good: Members, rng: random.Random) -> list[Any]:
    """Requests that a resumable upload must refuse; the upload announced for them is deleted at the end."""
    ask = web.client.request
    announce = {"file_name": rng.choice(NAMES), "size": rng.randint(40, 4000)}
    size = announce["size"]
    if rng.random() < 0.3:  # no upload is announced at all
        impossible = rng.choice([-1, -(2**31), 0, 2**53, 2**63, 10**30, 1.5, "12", None, True, [], 2**50])
        strangers = rng.choice(["0" * 12, "..", "%2e%2e%2fr2c2r.db", "a" * 500, "\u202e", "-1"])
        return [
            ask("POST", "/api/uploads", json={**announce, "size": impossible}),
            ask("PATCH", f"/api/uploads/{strangers}x", content=b"x", headers={"Upload-Offset": "0"}),
            ask("POST", f"/api/uploads/{strangers}x/finish"),
            ask("DELETE", f"/api/uploads/{strangers}x"),
        ]
    upload_id = web.post("/api/uploads", announce, 201)["id"]
    at = f"/api/uploads/{upload_id}"
    told = rng.choice(["-1", "1", str(size), str(2**53), "nan", "", "0x0", "1e3", "9" * 400])
    answers = [
        ask("PATCH", at, content=b"x" * 20, headers={"Upload-Offset": told}),
        ask("PATCH", at, content=b"x" * 20),
        ask("POST", f"{at}/finish"),
        ask("PATCH", at, content=rng.randbytes(size + rng.randint(1, 90_000)), headers={"Upload-Offset": "0"}),
    ]
    offset = int(ask("HEAD", at).headers["upload-offset"])
    rest = packed(good)[offset:size].ljust(size - offset, b"\0")
    assert ask("PATCH", at, content=rest, headers={"Upload-Offset": str(offset)}).status_code == 204
    answers.append(ask("POST", f"{at}/finish"))  # complete but not a recording: refused and deleted
    answers.append(ask("DELETE", at))
    return answers


def complaint(web: Running, answer: Any) -> str:
    """The fault of a response to a hostile upload; empty if there is none."""
    if not 400 <= answer.status_code < 500:
        return f"{answer.status_code}: {answer.text[:200]}"
    said = answer.json()
    if set(said) != {"kind", "message", "hint", "current"}:
        return f"not an error's shape: {answer.text[:200]}"
    words = f"{said['message']} {said['hint']}"
    if any(ord(sign) < 32 for sign in words) or len(words) > 1000:
        return f"not one line: {words[:200]!r}"
    if str(web.settings.data_dir) in words or "Traceback" in words:
        return f"tells what it should not: {words[:200]}"
    return ""


def left_behind(web: Running, before: set[psutil.Process]) -> str:
    """Files, rows or processes that a refused upload left behind; `before`: processes that already ran."""
    data = web.settings.data_dir
    files = [path for place in ("projects", "uploads") for path in (data / place).rglob("*") if path.is_file()]
    for place, rows in (("projects", web.get("/api/projects")), ("uploads", web.get("/api/uploads"))):
        for row in rows:  # so that they are not attributed to the next upload
            web.client.delete(f"/api/{place}/{row['id']}")
            web.client.delete(f"/api/trash/{row['id']}")
            files.append(Path(row["id"]))
    if files or web.get("/api/jobs"):
        return f"left behind: {files[:3]}"
    processes = [child for child in psutil.Process().children(recursive=True) if child not in before and child.is_running()]
    _, alive = psutil.wait_procs(processes, timeout=ENDED_S * PATIENCE)
    return f"still running: {alive[:3]}" if alive else ""


def _memory_mb() -> float:
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # returns freed memory to the system
    return float(psutil.Process().memory_info().rss) / 1e6


def main() -> int:
    """Send and report; 1 if there was any fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-hostile-") as folder:
        figures = send_all(Path(folder), options.count, options.seed)
    return report("hostile_uploads", figures, options.json, failed=bool(figures["wrong"]))


if __name__ == "__main__":
    sys.exit(main())
