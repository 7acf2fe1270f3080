import os
import threading
from itertools import count

import pytest

from r2c2r_core.threads import in_threads, usable_cores
from tests.waiting import PATIENCE_S


def test_results_are_returned_in_order_regardless_of_completion() -> None:
    second_ended = threading.Event()

    def work(number: int) -> int:
        if number == 0:
            assert second_ended.wait(PATIENCE_S)
        elif number == 1:
            second_ended.set()
        return number

    assert list(in_threads(work, range(9))) == list(range(9))


def test_work_runs_ahead_of_the_consumer_by_a_limited_amount() -> None:
    begun: list[int] = []
    results = in_threads(lambda number: begun.append(number) or number, count())  # an endless iterator
    assert [next(results), next(results)] == [0, 1]
    results.close()
    assert len(begun) <= 12


def test_all_cores_count_where_a_process_cannot_be_restricted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2}, raising=False)
    assert usable_cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")  # macOS and Windows have none
    monkeypatch.setattr(os, "cpu_count", lambda: 10)
    assert usable_cores() == 10
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert usable_cores() == 1
