"""Node side of a step, without Ray: fetch, start, progress, storing; and the process group that ends with its starter."""

import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from app.jobs.ray_order import Order
from app.jobs.ray_seat import Heard, NodeSeat
from app.jobs.seats import version
from app.process import python_module
from app.settings import Settings
from app.store.opening import open_store
from tests.app.object_server import REQUIRED
from tests.waiting import PATIENCE_S, gone, until

SAYS = """
import json, pathlib, sys
print("not JSON", flush=True)
print(json.dumps({"stage": "segment", "fraction": 0.5, "text": "half"}), flush=True)
pathlib.Path(sys.argv[1], "made.noun").write_text("made")
print(json.dumps({"done": "segment"}), flush=True)
"""
WAITS = 'import time; print(\'{"stage": "segment"}\', flush=True); time.sleep(600)'


@pytest.fixture
def order(tmp_path: Path) -> Order:
    """An order for a project that is in the store."""
    if not REQUIRED:
        pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")
    data, store = tmp_path / "web", f"file://{tmp_path / 'store'}"
    work = data / "projects/p/work"
    work.mkdir(parents=True)
    (work / "before.noun").write_text("before")
    kept = open_store(Settings(data_dir=data, store=store))
    kept.hold("p", "holder")
    kept.keep("p")
    return Order(
        version=version(),
        job=1,
        project="p",
        holder="holder",
        stage="segment",
        command=(sys.executable, "-c", SAYS, str(work)),
        data_dir=str(data),
        store=store,
        cache_gb="",
        cpus=1,
        gpu=False,
        memory_bytes=0,
        grace_s=5.0,
    )


def heard_to_the_end(seat: NodeSeat) -> Heard:
    heard: list[Heard] = []
    until(lambda: heard.append(seat.hear()) or heard[-1].status is not None)  # type: ignore[func-returns-value]
    lines = [line for each in heard for line in each.lines]
    return Heard(lines, b"".join(each.log for each in heard), heard[-1].status)


def test_results_of_a_node_are_in_the_store_when_its_step_ends(order: Order, tmp_path: Path) -> None:
    seat = NodeSeat(order)
    assert seat.start() is None
    heard = heard_to_the_end(seat)
    assert [*heard.lines][-1] == {"done": "segment"}
    assert (heard.log, heard.status) == (b"not JSON\n", 0)
    assert (tmp_path / "web/ray/0/projects/p" / "work/before.noun").read_text() == "before"
    there = open_store(Settings(data_dir=tmp_path / "other", store=order.store))
    there.fetch("p")
    assert (tmp_path / "other/projects/p" / "work/made.noun").read_text() == "made"


def test_concurrent_steps_on_a_node_have_separate_caches(order: Order, tmp_path: Path) -> None:
    first, second = NodeSeat(order), NodeSeat(order)
    assert (first.start(), second.start()) == (None, None)
    assert heard_to_the_end(first).status == heard_to_the_end(second).status == 0
    assert {path.name for path in (tmp_path / "web/ray").iterdir()} == {"0", "1"}
    third = NodeSeat(order)
    assert third.start() is None
    heard_to_the_end(third)
    assert not (tmp_path / "web/ray/2").exists()


def test_a_step_of_a_lost_job_stores_no_results(order: Order, tmp_path: Path) -> None:
    seat = NodeSeat(order)
    assert seat.start() is None
    other = open_store(Settings(data_dir=tmp_path / "other", store=order.store))
    other.hold("p", "another")
    heard = heard_to_the_end(seat)
    assert heard.lines[-1]["error"]["kind"] == "Lost"
    other.fetch("p")
    assert not (tmp_path / "other/projects/p" / "work/made.noun").exists()


def test_a_step_is_stopped_by_sigterm(order: Order) -> None:
    seat = NodeSeat(replace(order, command=(sys.executable, "-c", WAITS)))
    assert seat.start() is None
    until(lambda: seat.hear().lines)
    seat.ask_to_stop()
    assert heard_to_the_end(seat).status == -15


def test_a_step_of_another_version_is_refused(order: Order) -> None:
    wrong = NodeSeat(replace(order, version="9.9")).start()
    assert wrong is not None
    assert wrong["error"]["message"] == f"this is r2c2r 9.9, and the Ray node's is {version()}"


def test_a_tethered_process_group_ends_with_its_starter() -> None:
    script = "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']); " + WAITS
    with subprocess.Popen(
        [*python_module("app.tethered"), sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    ) as tethered:
        assert tethered.stdin is not None
        assert tethered.stdout is not None
        tethered.stdout.readline()
        group = psutil.Process(tethered.pid).children(recursive=True)
        try:
            assert len(group) == 2
            tethered.stdin.close()
            tethered.wait(timeout=PATIENCE_S)
            until(lambda: all(gone(process) for process in group))
        finally:
            for process in (*group, tethered):
                with suppress(psutil.NoSuchProcess):
                    process.kill()


@pytest.mark.parametrize(("code", "status"), [("raise SystemExit(3)", 3), ("import os; os.kill(os.getpid(), 9)", -9)])
def test_a_tethered_program_keeps_its_exit_status_and_receives_stdin(code: str, status: int) -> None:
    echo = "import sys; sys.stdout.write(sys.stdin.readline()); sys.stdout.flush(); "
    with subprocess.Popen(
        [*python_module("app.tethered"), sys.executable, "-c", echo + code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as tethered:
        assert tethered.stdin is not None
        assert tethered.stdout is not None
        tethered.stdin.write(b"said\n")
        tethered.stdin.flush()
        assert tethered.stdout.read() == b"said\n"
        assert tethered.wait() == status
