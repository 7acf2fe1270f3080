"""Jobs on a small local Ray cluster: same results as on one machine, and recovery when a part dies."""

from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from app.jobs import compute, ray_relay
from app.jobs.plans import Step
from app.settings import Settings
from app.store.protocol import Folder
from r2c2r_core.errors import InputError
from r2c2r_core.pool import WORKER_BYTES
from tests.app.conftest import running
from tests.app.object_server import REQUIRED
from tests.app.ray_cluster import RayNode, ray_node
from tests.app.test_jobs import behave, run
from tests.app.test_sharing import FREE, NAMES, SHARED, held, stored
from tests.waiting import PATIENCE_S

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture(scope="module")
def node() -> Iterator[RayNode]:
    with ray_node() as found, pytest.MonkeyPatch.context() as patched:
        for name, value in found.environment.items():
            patched.setenv(name, value)
        yield found


def processes_of(folder: Path) -> list[psutil.Process]:
    """Processes of a project's step in that folder, except the relay to it."""
    words = {found: " ".join(found.info["cmdline"] or []) for found in psutil.process_iter(["cmdline"])}
    return [found for found, said in words.items() if folder.name in said and "ray_relay" not in said]


def test_a_step_of_a_killed_actor_ends_restarts_and_can_be_cancelled(node: RayNode, tmp_path: Path) -> None:
    with running(tmp_path / "web", compute="ray", store=f"file://{tmp_path / 'store'}") as web:
        project = web.sample()  # fetched here from the node's own folder
        cache = tmp_path / f"web/ray/0/projects/{project}"
        assert (cache / "facts.json").is_file()
        folder = behave(web, project, segment="hang")
        web.context.store.keep(project)
        job = run(web, project)
        web.until((cache / "hanging").exists)
        lost = processes_of(folder)
        assert lost
        (cache / "hanging").unlink()
        (actor,) = node.actors()
        actor.kill()
        _, alive = psutil.wait_procs(lost, timeout=PATIENCE_S)
        assert alive == []
        web.until((cache / "hanging").exists)
        web.post(f"/api/jobs/{job}/cancel")
        assert web.job(job, "cancelled", "failed", "done")["state"] == "cancelled"
        web.until(lambda: not processes_of(folder))
        assert "vanished" in web.client.get(f"/api/jobs/{job}/log").text


def test_nodes_use_the_shared_folder_if_there_is_no_store(node: RayNode, tmp_path: Path) -> None:
    with running(tmp_path / "web", compute="ray") as web:
        web.sample()
        assert not (tmp_path / "web/ray").exists()


def test_objects_of_one_job_are_computed_by_parallel_actors(node: RayNode, tmp_path: Path) -> None:
    with running(tmp_path / "web", compute="ray", store=f"file://{tmp_path / 'store'}", heavy_jobs=2, **FREE) as web:
        project, folder = held(web, *NAMES)
        web.context.store.keep(project)
        job = run(web, project)
        caches = tmp_path / "web/ray"
        web.until(lambda: len([*caches.glob(f"*/projects/{project}/at-*.part")]) == len(NAMES))  # each in a folder of its own
        for at in caches.glob(f"*/projects/{project}/at-*.part"):
            at.with_name(f"hold-{at.stem.removeprefix('at-')}").unlink()
        for name in NAMES:
            (folder / f"hold-{name}").unlink()
        assert web.job(job, "done", "failed")["state"] == "done"
        nouns = stored(folder / "work")
        assert sorted(nouns) == sorted(f"nouns/{stage}/{name}.noun" for stage in SHARED for name in NAMES)


def test_nodes_of_another_version_are_refused_in_one_line(
    node: RayNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compute, "version", lambda: "9.9 of another day")
    with running(tmp_path / "web", compute="ray") as web:
        project = web.post("/api/projects/sample", {}, 202)["id"]
        web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "failed")
        said = web.get(f"/api/projects/{project}")["error"]
    assert said["kind"] == "environment"
    assert said["message"].startswith("this is r2c2r 9.9 of another day, and the Ray node's is ")
    assert "\n" not in said["message"]


def test_a_step_requests_the_cpus_gpu_and_memory_it_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[tuple[str, ...]] = []
    monkeypatch.setattr(compute, "Worker", lambda command, log: started.append(command))
    settings = Settings(data_dir=tmp_path, compute="ray", workers=4, job_memory_bytes=2 << 30)
    seat = compute.seat_of(settings, Folder(tmp_path))
    seat.ready("p", "holder")
    for step in (Step("segment", ("s",), 1.0, side_by_side=True, learned=True), Step("export", ("e",), 1.0)):
        seat.start(1, "p", step, tmp_path / "log")
    orders = [ray_relay.order_of(command[-1]) for command in started]
    assert [(order.cpus, order.gpu) for order in orders] == [(4, True), (1, False)]
    assert [order.memory_bytes for order in orders] == [(2 << 30) + 3 * WORKER_BYTES, 2 << 30]
    assert seat.memory_bytes < 1 << 30  # only the relay runs here


def test_an_unknown_compute_backend_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="R2C2R_COMPUTE 'slurm': not known"):
        _ = Settings(data_dir=tmp_path, compute="slurm").on_ray
