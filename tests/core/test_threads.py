import threading
from itertools import count

from r2c2r_core.threads import in_threads
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
