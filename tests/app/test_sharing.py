"""Objects of a stage shared by several seats: each computed once, common parts by one seat, with recovery from lost seats."""

import contextlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from sqlmodel import select

from app.db.engine import reading
from app.db.tables import Job, Part
from app.jobs.parts import TRIES, PartRows, fair_share
from tests.app.conftest import Running, running
from tests.app.object_server import REQUIRED
from tests.app.postgres import PostgresServer
from tests.app.served import take_jobs
from tests.app.test_jobs import behave, run
from tests.forked import Forked
from tests.waiting import FACTOR, gone

SHARED = {"segment": "objects", "generate": "objects"}
NAMES = ("drawer_1", "mug_1")  # of the sample
FREE = {"sharing_costs_s": 0.0}  # so that sharing two objects pays off
QUICK = {"beat_s": 0.3, "beats_missed_s": 6.0 * FACTOR}  # longer than the interval between a seat's heartbeats


def held(web: Running, *names: str) -> tuple[str, Path]:
    """A project whose stages work object by object, with these objects blocked while computed; and its folder."""
    project = web.sample()
    folder = behave(web, project, **SHARED)
    for name in names:
        (folder / f"hold-{name}").touch()
    return project, folder


def both_at_work(web: Running, folder: Path) -> None:
    """Wait until both objects are being computed, at the same time."""
    web.until(lambda: all((folder / f"at-{name}.part").exists() for name in NAMES))


def computed(folder: Path) -> list[tuple[str, str, str]]:
    """Each computation of an object: its stage, the object, and whether it was a shared part."""
    return [tuple(line.split()[:3]) for line in (folder / "parts.txt").read_text().splitlines()]  # type: ignore[misc]


def stored(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.noun")}


def process_at(folder: Path, name: str) -> psutil.Process:
    return psutil.Process(int((folder / f"at-{name}.part").read_text()))


def parts(web: Running) -> list[Part]:
    with reading(web.context.engine) as session:
        return list(session.exec(select(Part)))


def test_two_seats_share_the_objects_of_a_job_with_identical_results(tmp_path: Path) -> None:
    with running(tmp_path / "two", heavy_jobs=2, **FREE) as web:
        project, folder = held(web, *NAMES)
        job = run(web, project)
        both_at_work(web, folder)
        for name in NAMES:
            (folder / f"hold-{name}").unlink()
        assert web.job(job, "done", "failed")["state"] == "done"
        assert sorted(computed(folder)) == sorted((stage, name, "part") for stage in SHARED for name in NAMES)
        assert parts(web) == []
        shared = stored(folder / "work")
        log = web.client.get(f"/api/jobs/{job}/log").text
    with running(tmp_path / "one", heavy_jobs=1, **FREE) as web:
        project, folder = held(web)
        assert web.job(run(web, project), "done", "failed")["state"] == "done"
        assert sorted(computed(folder)) == sorted((stage, name, "whole") for stage in SHARED for name in NAMES)
        assert stored(folder / "work") == shared
    for name in NAMES:
        assert log.count(f"a warning about {name}") == len(SHARED)
        assert f"segment of {name} at " in log


def test_a_shared_job_reports_the_number_of_finished_objects(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web, "mug_1")
        job = run(web, project)
        web.until(lambda: web.get(f"/api/jobs/{job}")["message"] == "1 of 2 objects")
        found = web.get(f"/api/jobs/{job}")
        assert (found["stage"], found["state"]) == ("segment", "running")
        assert found["stage_fraction"] == 0.5
        (folder / "hold-mug_1").unlink()
        assert web.job(job, "done", "failed")["state"] == "done"
        said = [event["fraction"] for event in web.get(f"/api/jobs/{job}/events") if event["stage"] == "segment"]
        assert said == sorted(said)


def test_an_object_whose_process_is_killed_is_retried(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web, *NAMES)
        job = run(web, project)
        both_at_work(web, folder)
        (folder / "hold-mug_1").unlink()
        killed = process_at(folder, "drawer_1")
        (folder / "at-drawer_1.part").unlink()
        killed.kill()
        web.until((folder / "at-drawer_1.part").exists)
        (folder / "hold-drawer_1").unlink()
        assert web.job(job, "done", "failed")["state"] == "done"
        segmented = [(name, how) for stage, name, how in computed(folder) if stage == "segment"]
        assert sorted(segmented) == [("drawer_1", "part"), ("drawer_1", "part"), ("mug_1", "part")]


def test_an_object_that_exhausts_its_tries_is_computed_by_the_stage(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web, "drawer_1")
        job = run(web, project)
        for _ in range(TRIES):
            web.until((folder / "at-drawer_1.part").exists)
            killed = process_at(folder, "drawer_1")
            (folder / "at-drawer_1.part").unlink()
            killed.kill()
        web.until((folder / "at-drawer_1.part").exists)
        (folder / "hold-drawer_1").unlink()
        assert web.job(job, "done", "failed")["state"] == "done"
        assert ("segment", "drawer_1", "whole") in computed(folder)


def test_cancelling_a_shared_job_stops_every_seat(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web, *NAMES)
        job = run(web, project)
        both_at_work(web, folder)
        processes = [process_at(folder, name) for name in NAMES]
        web.post(f"/api/jobs/{job}/cancel")
        assert web.job(job, "cancelled", "done", "failed")["state"] == "cancelled"
        assert all(gone(process) for process in processes)  # before the end is reported
        assert parts(web) == []


def test_an_object_that_fails_ends_the_job_with_its_message(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web)
        (folder / "bad.txt").write_text("mug_1")
        found = web.job(run(web, project), "done", "failed")
        assert (found["state"], found["error"]["message"]) == ("failed", "no frame shows mug_1")
        assert ("segment", "mug_1", "whole") in computed(folder)
        assert parts(web) == []


def test_objects_faster_than_a_process_start_are_not_shared(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2) as web:  # without a model two objects take a second or two
        project, folder = held(web)
        assert web.job(run(web, project), "done", "failed")["state"] == "done"
        assert {how for _, _, how in computed(folder)} == {"whole"}


def test_a_single_object_is_not_shared(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        project, folder = held(web)
        stored_before = folder / "work/nouns/segment/drawer_1.noun"
        stored_before.parent.mkdir(parents=True)
        stored_before.write_text("segment of drawer_1")
        assert web.job(run(web, project), "done", "failed")["state"] == "done"
        segmented = [(name, how) for stage, name, how in computed(folder) if stage == "segment"]
        assert segmented == [("mug_1", "whole")]


def test_seats_with_own_jobs_do_not_count_as_spare(tmp_path: Path) -> None:
    with running(tmp_path, heavy_jobs=2, **FREE) as web:
        projects = [web.sample() for _ in range(2)]
        rows = PartRows(web.context.engine, "somebody", web.settings)
        assert rows.spare() == 2
        for seats_left, project in zip((1, 0), projects, strict=True):
            folder = behave(web, project, segment="hang")
            run(web, project)
            web.until((folder / "hanging").exists)
            assert rows.spare() == seats_left


@pytest.mark.parametrize(
    ("waiting", "seats", "fewest", "taken"),
    [
        (20, 20, 4, 1),  # one each
        (14, 2, 1, 4),  # half of a seat's share, so that both end about the same time
        (14, 2, 4, 4),
        (14, 2, 16, 7),  # its whole share: otherwise its processors would idle
        (3, 8, 4, 1),
        (5, 1, 8, 5),
    ],
)
def test_a_seat_takes_its_fair_share_of_the_waiting_objects(waiting: int, seats: int, fewest: int, taken: int) -> None:
    assert fair_share(waiting, seats, fewest) == taken


def test_a_stopped_server_leaves_no_process_and_the_next_one_continues(tmp_path: Path) -> None:
    with running(tmp_path / "data", heavy_jobs=2, **FREE) as web:
        project, folder = held(web, *NAMES)
        job = run(web, project)
        both_at_work(web, folder)
        processes = [process_at(folder, name) for name in NAMES]
    assert all(gone(process) for process in processes)
    for name in NAMES:
        (folder / f"hold-{name}").unlink()
    with running(tmp_path / "data", heavy_jobs=2, **FREE, **QUICK) as web:
        assert web.job(job, "done", "failed")["state"] == "done"


@contextmanager
def seat(web: Running, folder: Path) -> Iterator[Forked]:
    """`r2c2r work` in its own process and data folder, accepting jobs."""
    folder.mkdir()
    process = Forked(take_jobs, folder, {"postgres": web.settings.postgres, "store": web.settings.store, **FREE, **QUICK})
    try:
        process.readline()
        yield process
    finally:
        with contextlib.suppress(psutil.Error):
            for each in psutil.Process(process.pid).children(recursive=True):
                each.kill()
        process.kill()


@pytest.fixture
def served(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[Running]:
    """A server without compute, with rows and files that seats can reach."""
    if not REQUIRED:
        pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")
    places = {"postgres": postgres_server.of_folder(tmp_path), "store": f"file://{tmp_path / 'store'}"}
    with running(tmp_path / "web", **places, **QUICK, heavy_jobs=0) as web:
        yield web
    postgres_server.drop_all()


def held_at(web: Running, one: Forked, two: Forked) -> tuple[int, dict[int, Path]]:
    """A job of which each of two seats computes one object; and the project's folder at each seat, by its process."""
    project, _ = held(web, *NAMES)
    web.context.store.keep(project)
    job = run(web, project)
    at = {seat.pid: web.settings.data_dir.parent / name / "projects" / project for name, seat in (("one", one), ("two", two))}
    web.until(lambda: all(list(folder.glob("at-*.part")) for folder in at.values()))
    return job, at


def test_objects_of_a_lost_machine_are_computed_by_another(served: Running, tmp_path: Path) -> None:
    with seat(served, tmp_path / "one") as one, seat(served, tmp_path / "two") as two:
        job, folders = held_at(served, one, two)
        with reading(served.context.engine) as session:
            owner = int((session.get_one(Job, job).owner or "").split(":")[1])
        (helper,) = folders.keys() - {owner}
        (name,) = (path.stem.removeprefix("at-") for path in folders[helper].glob("at-*.part"))
        lost = process_at(folders[helper], name)
        at_it = {found["process"]: found["jobs"][0]["objects"] for found in served.get("/api/seats")["seats"] if found["jobs"]}
        assert at_it == {owner: [], helper: [name]}
        (one if one.pid == helper else two).kill()
        served.until(lambda: gone(lost))  # processes started by the lost machine end with it
        for each in (*({*NAMES} - {name}), name):  # its own object, then the other's
            served.until((folders[owner] / f"at-{each}.part").exists)
            (folders[owner] / f"hold-{each}").unlink()
        project = served.job(job, "done", "failed")["project"]
        assert served.get(f"/api/jobs/{job}")["state"] == "done"
    served.context.store.fetch(project)
    nouns = stored(tmp_path / "web/projects" / project / "work")
    assert sorted(nouns) == sorted(f"nouns/{stage}/{name}.noun" for stage in SHARED for name in NAMES)


def test_cancelling_at_the_web_server_stops_the_job_on_every_machine(served: Running, tmp_path: Path) -> None:
    with seat(served, tmp_path / "one") as one, seat(served, tmp_path / "two") as two:
        job, folders = held_at(served, one, two)
        processes = [psutil.Process(int(path.read_text())) for folder in folders.values() for path in folder.glob("at-*.part")]
        served.post(f"/api/jobs/{job}/cancel")
        assert served.job(job, "cancelled", "done", "failed")["state"] == "cancelled"
        assert all(gone(process) for process in processes)
        assert parts(served) == []
