"""Check that the stored outputs of a finished stage stay unchanged while servers are killed."""

import contextlib
import time

from kill_journey import Journey, Refused
from kill_server import SetUp


class FinishedStages:
    """Monitor of stored stage outputs: they must not change while the same run continues."""

    def __init__(self, journey: Journey, server: SetUp) -> None:
        self._journey, self._server = journey, server
        self.seen: dict[tuple[int, str], dict[str, str]] = {}
        self.changed: list[str] = []
        self._looked = 0.0

    def look(self) -> None:
        """Record the files of a running job's finished stages and compare them with earlier records, at most every 0.5 s."""
        if time.monotonic() - self._looked < 0.5:
            return
        self._looked = time.monotonic()
        self.compare()

    def compare(self) -> None:
        """Record and compare now."""
        journey = self._journey
        if not journey.ready:
            return
        with contextlib.suppress(Refused, FileNotFoundError):
            for job in journey.ask("GET", f"/api/jobs?project={journey.project}&limit=1"):
                for stage in job["stages"]:
                    if job["kind"] != "run" or stage["state"] != "done":
                        continue
                    key, digests = (job["id"], stage["name"]), self._server.digests(journey.project, stage["name"])
                    if digests and self.seen.setdefault(key, digests) != digests:
                        self.changed.append(f"job {job['id']}: what {stage['name']} had stored was changed")
                        self.seen[key] = digests
