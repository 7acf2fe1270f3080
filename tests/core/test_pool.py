"""Tasks in worker processes: results, failures, and no process that outlives its pool."""

import os
import shutil
import signal
import sys
from collections.abc import Iterator

import numpy as np
import psutil
import pytest

from r2c2r_core.errors import Cancelled, ObjectNotSeen
from r2c2r_core.pool import Failed, Pool, Task, WorkerLost, usual_workers
from r2c2r_core.progress import SILENT, Progress
from tests.waiting import PATIENCE_S, until


def double(value: int, progress: Progress) -> int:
    progress.at(0.5, f"doubling {value}")
    return 2 * value


def refuse(name: str, progress: Progress) -> None:
    raise ObjectNotSeen(f"{name}: seen in 0 of 9 frames", hint="click again")


def break_down(progress: Progress) -> None:
    raise np.linalg.LinAlgError("SVD did not converge")


def fall(progress: Progress) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def work_on(progress: Progress) -> None:
    """Work until told to stop."""
    progress.at(0.0, str(os.getpid()))
    until(progress.check)


@pytest.fixture(scope="module")
def pool() -> Iterator[Pool]:
    with Pool(2) as two:
        yield two


def test_every_task_returns_its_own_result_and_progress_is_reported(pool: Pool) -> None:
    shares: list[float] = []
    progress = Progress(lambda stage, share, text: shares.append(share))
    answers = dict(pool.run({str(k): Task(double, (k,)) for k in range(5)}, progress))
    assert answers == {str(k): 2 * k for k in range(5)}
    assert shares
    assert all(0 <= share <= 1 for share in shares)


def test_a_failing_task_reports_its_error_and_others_continue(pool: Pool) -> None:
    answers = dict(pool.run({"a": Task(refuse, ("a",)), "b": Task(break_down, ()), "c": Task(double, (3,))}))
    assert answers["c"] == 6
    assert isinstance(answers["a"].error, ObjectNotSeen)
    assert str(answers["a"].error) == "a: seen in 0 of 9 frames; click again"
    assert isinstance(answers["b"].error, np.linalg.LinAlgError)
    assert "break_down" in answers["b"].where


def test_a_killed_worker_process_loses_only_its_task(pool: Pool) -> None:
    answers = dict(pool.run({"a": Task(fall, ()), "b": Task(double, (1,)), "c": Task(double, (2,))}))
    lost = answers.pop("a")
    assert isinstance(lost, Failed)
    assert isinstance(lost.error, WorkerLost)
    assert "SIGKILL" in str(lost.error)
    assert answers == {"b": 2, "c": 4}


def test_an_idle_worker_killed_meanwhile_is_replaced() -> None:
    with Pool(1) as pool:
        assert dict(pool.run({"a": Task(double, (1,))})) == {"a": 2}
        (idle,) = pool._idle
        idle._process.kill()
        idle._process.wait()
        assert dict(pool.run({"b": Task(double, (2,)), "c": Task(double, (3,))})) == {"b": 4, "c": 6}


def test_a_worker_that_cannot_start_loses_its_task_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    with Pool(1) as pool:
        answer = dict(pool.run({"a": Task(double, (bytes(1 << 20),))}))["a"]  # larger than the socket's buffer
    assert isinstance(answer.error, WorkerLost)


def test_cancelling_stops_all_worker_processes() -> None:
    pids: list[int] = []
    progress = Progress(lambda stage, share, text: pids.append(int(text)), lambda: len(pids) == 2)
    with pytest.raises(Cancelled), Pool(2) as pool:
        list(pool.run({"a": Task(work_on, ()), "b": Task(work_on, ())}, progress))
    assert len(pids) == 2
    assert not any(psutil.pid_exists(pid) for pid in pids)


def test_a_worker_exits_when_its_owner_is_gone() -> None:
    class Gone(Exception):
        """Stand-in for the end of the process that owns the pool."""

    def heard(stage: str, share: float, text: str) -> None:
        raise Gone

    pool = Pool(1)
    with pytest.raises(Gone):
        list(pool.run({"a": Task(work_on, ())}, Progress(heard)))
    (worker,) = pool._busy.values()
    try:
        worker.channel.close()  # as the kernel does for a process that died
        assert worker._process.wait(timeout=PATIENCE_S) == 0
    finally:
        worker._process.kill()
        worker._process.wait()


def test_the_number_of_workers_is_limited_by_memory_and_by_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)))
    free = psutil.virtual_memory()
    monkeypatch.setattr(psutil, "virtual_memory", lambda: free._replace(available=4 << 30))
    assert usual_workers() == 2
    monkeypatch.setattr(psutil, "virtual_memory", lambda: free._replace(available=0))
    assert usual_workers() == 1
    monkeypatch.setattr(psutil, "virtual_memory", lambda: free._replace(available=64 << 30))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2})
    assert usual_workers() == 3


def test_a_pool_without_tasks_starts_no_process() -> None:
    with Pool(2) as pool:
        assert list(pool.run({}, SILENT)) == []
        assert not pool._idle
