"""Latency for other users and shutdown time of the server while one person requests 44 expensive operations at once, twice.

    python benchmarks/flood.py SAMPLE [--json benchmarks/app.json]

SAMPLE holds scan.r3d, as `r2c2r sample` writes it. One person uploads it 44 times; the 44 requests to finish the uploads, each
of which examines the recording in its own process, arrive at once with 44 requests to show the scan in the 3D view. Meanwhile
another person requests /api/health and /api/system in turn; after enough responses of both, the server gets SIGTERM.
"""

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import httpx2 as httpx

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(1, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report
from waiting import until

from app.serve import new_address

CROWD = 44
ASKED = 100  # times each, during the flood
HEADERS = {"X-Requested-With": "flood"}
COMMAND = "import sys; from r2c2r_core.cli import main; sys.exit(main())"


def flood(sample: Path, data: Path) -> dict[str, Any]:
    """Worst response time in seconds, the status codes of the flood, and seconds from SIGTERM to the end."""
    words = [sys.executable, "-c", COMMAND, "serve", "--port", "0", "--data", str(data)]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    printed = server.stdout.readline().split(" ", 1)[1].strip()
    limits = httpx.Limits(max_connections=2 * CROWD)
    many = httpx.Client(base_url=printed.split("/?")[0], headers=HEADERS, timeout=600, limits=limits)
    other = httpx.Client(base_url=printed.split("/?")[0], headers=HEADERS, timeout=600)
    try:
        until(lambda: _answers(many), 120)
        many.get(printed)
        other.get(new_address(data))
        content = (sample / "scan.r3d").read_bytes()
        project = many.post(f"/api/uploads/{_upload(many, 'first.r3d', content)}/finish").json()["id"]
        until(lambda: many.get(f"/api/projects/{project}").json()["status"] == "ready", 900)
        uploads = [_upload(many, f"{number}.r3d", content) for number in range(CROWD)]
        statuses = Counter[int]()
        wishes = [(f"/api/uploads/{upload}/finish", None) for upload in uploads]
        wishes += [(f"/api/projects/{project}/viewer/show", {"mode": "cloud", "full": True})] * CROWD
        threads = [threading.Thread(target=_ask, args=(many, *wish, statuses), daemon=True) for wish in wishes]
        for thread in threads:
            thread.start()
        worst = {path: 0.0 for path in ("/api/health", "/api/system")}
        for _ in range(ASKED):
            for path in worst:
                began = time.monotonic()
                assert other.get(path).status_code == 200
                worst[path] = max(worst[path], time.monotonic() - began)
        under_way = sum(thread.is_alive() for thread in threads)
        began = time.monotonic()
        server.send_signal(signal.SIGTERM)
        server.wait(timeout=600)
        ended = time.monotonic() - began
    finally:
        server.kill()
        server.stdout.close()
        many.close()
        other.close()
    return {
        "requests": 2 * CROWD,
        "statuses": {str(status): count for status, count in sorted(statuses.items())},
        "under_way_at_the_end": under_way,
        "worst_s": {path: round(seconds, 2) for path, seconds in worst.items()},
        "sigterm_to_exit_s": round(ended, 1),
        "cores": os.cpu_count(),
    }


def _answers(client: httpx.Client) -> bool:
    with contextlib.suppress(httpx.HTTPError):
        return client.get("/api/health").status_code == 200
    return False


def _upload(client: httpx.Client, name: str, content: bytes) -> str:
    upload = client.post("/api/uploads", json={"file_name": name, "size": len(content)}).json()["id"]
    client.patch(f"/api/uploads/{upload}", content=content, headers={"Upload-Offset": "0"}).raise_for_status()
    return str(upload)


def _ask(client: httpx.Client, path: str, body: Any, statuses: Counter[int]) -> None:
    with contextlib.suppress(httpx.HTTPError):  # the server has ended
        statuses[client.post(path, json=body).status_code] += 1


def main() -> int:
    """Flood, report; fails if a response takes more than 5 s, or the shutdown more than 10 s."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sample", type=Path)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-flood-") as folder:
        figures = flood(options.sample, Path(folder) / "data")
    failed = max(figures["worst_s"].values()) > 5.0 or figures["sigterm_to_exit_s"] > 10.0
    return report("flood", figures, options.json, failed=failed)


if __name__ == "__main__":
    sys.exit(main())
