"""One process of a job, from its first word to its last, and how far the job is with it."""

import queue
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from app.jobs.plans import Step
from app.process import Line, Worker
from r2c2r_core.limits import HOURS_VARIABLE

POLL_S = 0.15
STORE_EVERY_S = 0.5
HEARTBEAT_S = 2.0
SHORTEST_S = 0.1  # a step is a process: none takes less to start


@dataclass(slots=True)
class JobProgress:
    """How far a job is, and when that was last stored."""

    steps: list[Step]
    began: float = field(default_factory=time.monotonic)
    at_step: int = 0
    fraction: float = 0.0  # of the step
    span: tuple[float, float] = (0.0, 1.0)  # of the step, that the process at hand does
    stored: float = 0.0

    @property
    def overall(self) -> float:
        """Share of all steps that is done."""
        weights, _ = self._weights
        return (sum(weights[: self.at_step]) + weights[self.at_step] * self.fraction) / sum(weights)

    @property
    def eta_s(self) -> float | None:
        """Seconds left: what the rest took before in this project, or more if this job is slower; None while nothing tells.

        A job that finds most of its work done gets through the first steps at once: its own pace alone would promise a rest
        as fast, and the time left would rise.
        """
        weights, measured = self._weights
        elapsed, overall = time.monotonic() - self.began, self.overall
        before = sum(weights) * (1 - overall) if measured else None
        paced = elapsed * (1 - overall) / overall if overall > 0.02 and elapsed > 2 else None
        told = [seconds for seconds in (before, paced) if seconds is not None]
        return round(max(told), 1) if told else None

    @property
    def _weights(self) -> tuple[list[float], bool]:
        """Of all steps, and whether they are seconds that these took before."""
        took = [max(step.took_s, SHORTEST_S) for step in self.steps if step.took_s is not None]
        measured = len(took) == len(self.steps)
        return took if measured else [step.weight for step in self.steps], measured

    def at(self, step: int) -> None:
        """The next step begins, and that is stored."""
        self.at_step, self.fraction, self.span, self.stored = step, 0.0, (0.0, 1.0), time.monotonic()

    def reached(self, fraction: float) -> None:
        """How far the process at hand is with its part of the step."""
        low, high = self.span
        self.fraction = low + (high - low) * fraction

    def is_due(self, every_s: float) -> bool:
        """Whether it is time to store it again; then it counts as stored."""
        now = time.monotonic()
        if now - self.stored <= every_s:
            return False
        self.stored = now
        return True


def listen(
    worker: Worker,
    stage: str,
    *,
    stop: Callable[[], bool],
    heard: Callable[[float, str], None],
    silent: Callable[[], None],
    grace_s: float,
) -> Line:
    """Follow a worker to its last word, empty when it has none; once `stop` says so it is asked to stop, then made to."""
    asked: float | None = None
    while True:
        now = time.monotonic()
        if asked is None and stop():
            worker.ask_to_stop()
            asked = now
        if asked is not None and now - asked > grace_s:
            worker.kill()
        try:
            line = worker.next_line(POLL_S)
        except queue.Empty:
            silent()
            continue
        if line is None:
            return {}
        if "done" in line or "error" in line:
            return line
        if line.get("stage") == stage:
            heard(min(max(float(line.get("fraction", 0.0)), 0.0), 1.0), str(line.get("text", "")))


def outcome(last: Line, status: int, stage: str) -> dict[str, Any] | None:
    """None for a process that did its work, else why it did not, from its last word and its exit status."""
    if "error" in last:
        return dict(last["error"])
    if "done" in last:  # what it made is stored: how it left does not matter any more
        return None
    if status == -signal.SIGXCPU:  # met again if it is tried again
        hint = f"give a smaller recording, or allow more with {HOURS_VARIABLE}"
        return {"kind": "EnvironmentProblem", "message": f"{stage}: it took all the processor time it may use", "hint": hint}
    reason = f"signal {-status}" if status < 0 else f"exit status {status}"
    hint = "the system may have run out of memory; see the log" if status == -9 else "see the log"
    return {"kind": VANISHED, "message": f"{stage}: its process ended early ({reason})", "hint": hint}


VANISHED = "worker-died"
