"""Execution of one process of a job, and the job's progress."""

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
CLEAR_RISE = 1.2  # ratio of an estimate to the one told before
SHORTEST_S = 0.1  # a step is a process, which takes at least this long to start


@dataclass(slots=True)
class JobProgress:
    """Progress of a job, and when it was last stored."""

    steps: list[Step]
    began: float = field(default_factory=time.monotonic)
    at_step: int = 0
    fraction: float = 0.0  # of the step
    span: tuple[float, float] = (0.0, 1.0)  # part of the step done by the current process
    stored: float = 0.0
    told_s: float | None = None  # the last estimate of the time left

    @property
    def overall(self) -> float:
        """Completed fraction of all steps."""
        weights, _ = self._weights
        return (sum(weights[: self.at_step]) + weights[self.at_step] * self.fraction) / sum(weights)

    def estimate_s(self) -> float | None:
        """Estimated seconds left, from earlier durations in this project, or more if this job is slower; None if unknown.

        A job that reuses most results passes the first steps at once: its own pace alone would underestimate the rest, and
        the estimate would rise. Steps progress unevenly too, so only a clear rise is told.
        """
        weights, measured = self._weights
        elapsed, overall = time.monotonic() - self.began, self.overall
        before = sum(weights) * (1 - overall) if measured else None
        paced = elapsed * (1 - overall) / overall if overall > 0.02 and elapsed > 2 else None
        found = max((seconds for seconds in (before, paced) if seconds is not None), default=None)
        if found is not None and (self.told_s is None or not self.told_s < found < CLEAR_RISE * self.told_s):
            self.told_s = round(found, 1)
        return self.told_s

    @property
    def _weights(self) -> tuple[list[float], bool]:
        """Weights of all steps, and whether they are measured seconds."""
        took = [max(step.took_s, SHORTEST_S) for step in self.steps if step.took_s is not None]
        measured = len(took) == len(self.steps)
        return took if measured else [step.weight for step in self.steps], measured

    def at(self, step: int) -> None:
        """Begin a step, and count it as stored."""
        self.at_step, self.fraction, self.span, self.stored = step, 0.0, (0.0, 1.0), time.monotonic()

    def reached(self, fraction: float) -> None:
        """Update the current process's fraction of its part of the step."""
        low, high = self.span
        self.fraction = low + (high - low) * fraction

    def is_due(self, every_s: float) -> bool:
        """Whether it is time to store the progress; if so, it counts as stored."""
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
    """Follow a worker to its last message, or {}; once `stop` returns True, it is terminated, then killed."""
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
    """Failure of a process from its last message and exit status; None on success."""
    if "error" in last:
        return dict(last["error"])
    if "done" in last:  # its results are stored, so its exit status does not matter
        return None
    if status == -signal.SIGXCPU:  # a retry would reach the limit again
        hint = f"use a smaller recording, or raise the limit with {HOURS_VARIABLE}"
        return {"kind": "EnvironmentProblem", "message": f"{stage}: it used up its processor time", "hint": hint}
    reason = f"signal {-status}" if status < 0 else f"exit status {status}"
    hint = "the system may have run out of memory; see the log" if status == -9 else "see the log"
    return {"kind": VANISHED, "message": f"{stage}: its process ended unexpectedly ({reason})", "hint": hint}


VANISHED = "worker-died"
