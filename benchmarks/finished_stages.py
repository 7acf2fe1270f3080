"""Whether what a finished stage stored stays what it was while servers die."""

import contextlib
import hashlib
import time
from pathlib import Path

from kill_journey import Journey, Refused


class FinishedStages:
    """What a finished stage stored stays what it was as long as the same run goes on."""

    def __init__(self, journey: Journey) -> None:
        self._journey = journey
        self.seen: dict[tuple[int, str], dict[str, str]] = {}
        self.changed: list[str] = []
        self._looked = 0.0

    def look(self) -> None:
        """Note the files of stages that a running job has finished; compare those noted before."""
        if time.monotonic() - self._looked < 0.5:
            return
        self._looked = time.monotonic()
        self.compare()

    def compare(self) -> None:
        """Note and compare."""
        journey = self._journey
        work = journey.folder / "work"
        if not journey.ready:
            return
        with contextlib.suppress(Refused, FileNotFoundError):
            for job in journey.ask("GET", f"/api/jobs?project={journey.project}&limit=1"):
                for stage in job["stages"]:
                    if job["kind"] != "run" or stage["state"] != "done":
                        continue
                    key, digests = (job["id"], stage["name"]), _digests(work, stage["name"])
                    if digests and self.seen.setdefault(key, digests) != digests:
                        self.changed.append(f"job {job['id']}: what {stage['name']} had stored was changed")
                        self.seen[key] = digests


def _digests(work: Path, stage: str) -> dict[str, str]:
    found = {}
    for path in sorted((work / "nouns" / stage).glob("*.noun")):
        with contextlib.suppress(FileNotFoundError):
            found[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found
