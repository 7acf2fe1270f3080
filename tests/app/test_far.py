"""Live segmenters at a seat: masks computed there, shown by the server, and stopped with their users."""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psutil
import pytest

from app import work
from app.jobs.far import FarWorkers
from tests.app.conftest import FAKE_COMMANDS, Running, running
from tests.app.object_server import REQUIRED
from tests.app.postgres import PostgresServer
from tests.app.test_live import CLICK, listening, until

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")

ENDLESS = {**CLICK, "x": 157.5}


@pytest.fixture
def shared(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[dict[str, Any]]:
    yield {"postgres": postgres_server.of_folder(tmp_path), "store": f"file://{tmp_path / 'store'}", "beat_s": 0.5}
    postgres_server.drop_all()


@contextmanager
def live_seat(web: Running, folder: Path) -> Iterator[Callable[[], None]]:
    """`r2c2r work --live --jobs 0`; yields a function that ends it."""
    stopping, settings = threading.Event(), replace(web.settings, data_dir=folder, heavy_jobs=0)
    folder.mkdir(exist_ok=True)
    thread = threading.Thread(target=work.run_jobs, args=(settings, FAKE_COMMANDS, stopping), kwargs={"live": True})

    def end() -> None:
        stopping.set()
        thread.join()

    thread.start()
    try:
        web.until(lambda: web.context.live.far.__self__._seats != {})  # type: ignore[attr-defined]
        yield end
    finally:
        end()


def segmenters() -> list[str]:
    """Folders that live segmenters of this process work on."""
    processes = [found.info for found in psutil.process_iter(["ppid", "cmdline"])]  # skips processes that end meanwhile
    lines = [found["cmdline"] or [] for found in processes if found["ppid"] == os.getpid()]
    return [line[line.index(FAKE_COMMANDS.live[-1]) + 1] for line in lines if FAKE_COMMANDS.live[-1] in line]


def clicked(web: Running, project: str, click: dict[str, Any] = CLICK) -> Any:
    return web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [click]}, 201)


def state(web: Running, project: str) -> str:
    """State of the last object's masks."""
    return str(web.get(f"/api/projects/{project}/objects")[-1]["segment"])


def test_masks_computed_at_a_seat_are_shown_and_stored_by_the_server(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared) as web:
        project = web.sample()
        web.context.store.keep(project)
        with live_seat(web, tmp_path / "seat"), listening(web, project) as tab:
            made = clicked(web, project)
            seen, _ = until(tab, type="segment", object=made["id"], state="done")
            assert [message["frame"] for message in seen if message["type"] == "mask"] == [3, 0, 7]
            assert segmenters() == [str(tmp_path / f"seat/projects/{project}/work")]
            drawn = web.get(f"/api/projects/{project}/elevations")
            assert drawn["drawn"]
            assert web.client.get(drawn["items"][0]["url"]).content.startswith(b"\x89PNG")
            web.until(lambda: web.get(f"/api/projects/{project}/proposals")["state"] == "done")
        assert str(tmp_path / f"seat/projects/{project}/work") not in segmenters()  # the server's own may take over
        (lane,) = [lane for lane in web.get(f"/api/projects/{project}/lanes") if lane["object"] == made["id"]]
        assert (lane["frames"], lane["complete"]) == ([0, 3, 7], True)


def test_cancelling_or_deleting_ends_segmentation_at_the_seat(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared) as web:
        project = web.sample()
        web.context.store.keep(project)
        with live_seat(web, tmp_path / "seat"):
            made = clicked(web, project, ENDLESS)
            web.until(lambda: state(web, project) == "running")
            web.post(f"/api/projects/{project}/objects/{made['id']}/segment/cancel")
            web.until(lambda: state(web, project) == "partial")
            web.until(lambda: len(segmenters()) == 1)
            web.delete(f"/api/projects/{project}")
            web.until(lambda: segmenters() == [])


def test_the_server_takes_over_masks_of_a_seat_that_ends(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared) as web:
        project = web.sample()
        web.context.store.keep(project)
        with live_seat(web, tmp_path / "seat") as end:
            clicked(web, project, ENDLESS)
            web.until(lambda: state(web, project) == "running")
            end()
            web.until(lambda: segmenters() == [str(tmp_path / f"web/projects/{project}/work")])
            web.until(lambda: state(web, project) == "running")


def test_a_seat_lost_while_starting_a_segmenter_ends_that_segmenter(tmp_path: Path) -> None:
    channel: Any = SimpleNamespace(hears={}, on_gone=[], on_gap=[], say=lambda *_: None)
    workers = FarWorkers(channel)
    channel.hears["live-seat"]("seat", {"runs": 0})
    goes = SimpleNamespace(mkdir=lambda **_: channel.on_gone[0]("seat", True))
    files: Any = SimpleNamespace(root=tmp_path, work=tmp_path / "work", elevations=goes)
    begun = workers.start("project", files, ())
    assert begun is not None
    assert not begun.alive
    assert workers.start("project", files, ()) is None  # no seat is left


def test_segmenters_of_a_stopped_server_end_at_the_seat(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "other", run_jobs=False, **shared) as other, live_seat(other, tmp_path / "seat"):
        with running(tmp_path / "web", **shared) as web:
            project = web.sample()
            web.context.store.keep(project)
            web.until(lambda: web.context.live.far.__self__._seats != {})  # type: ignore[attr-defined]
            clicked(web, project)
            web.until(lambda: len(segmenters()) == 1)
        other.until(lambda: segmenters() == [])
