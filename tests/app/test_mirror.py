"""Two machines whose data folders mirror one store: files stored by one are fetched by the other, for any kind of store."""

import os
import threading
import urllib.request
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from app.errors import NotFound, Unavailable
from app.store.mirror import UNUSED_S, Lost, Mirror
from app.store.objects import Objects, open_objects
from r2c2r_core.errors import InputError
from tests.app.object_server import BUCKET, REQUIRED, ObjectServer
from tests.waiting import PATIENCE_S, held

LONG = timedelta(days=1)

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture(params=["memory", "folder", "s3"])
def objects(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Objects:
    if request.param == "memory":
        import obstore

        return Objects(obstore.store.MemoryStore())
    if request.param == "folder":
        return open_objects(f"file://{tmp_path / 'store'}")
    for name, value in request.getfixturevalue("s3").environment.items():
        monkeypatch.setenv(name, value)
    return open_objects(f"s3://{BUCKET}/{tmp_path.name}")


def machines(objects: Objects, tmp_path: Path) -> tuple[Mirror, Mirror]:
    return Mirror(objects, tmp_path / "a"), Mirror(objects, tmp_path / "b")


def write(folder: Path, path: str, content: str) -> Path:
    file = folder / "projects" / "p" / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content)
    return file


def read_all(folder: Path) -> dict[str, str]:
    root = folder / "projects" / "p"
    return {path.relative_to(root).as_posix(): path.read_text() for path in root.rglob("*") if path.is_file()}


def test_files_stored_by_one_machine_are_fetched_with_their_time_by_another(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "work/nouns/a.noun", "noun")
    scan = write(tmp_path / "a", "source/scan.r3d", "scan")
    os.utime(scan, ns=(1, 1_234_567_890_123_456_789))
    write(tmp_path / "a", "previews/1.jpg", "drawn")
    write(tmp_path / "a", "work/.half.tmp", "half")
    here.keep("p")
    there.fetch("p")
    assert read_all(tmp_path / "b") == {"work/nouns/a.noun": "noun"}
    there.fetch("p", recording=True)
    assert read_all(tmp_path / "b") == {"work/nouns/a.noun": "noun", "source/scan.r3d": "scan"}
    assert (tmp_path / "b/projects/p/source/scan.r3d").stat().st_mtime_ns == 1_234_567_890_123_456_789
    assert there.size("p") == len("nounscan")


def test_changes_and_deletions_propagate_also_from_partial_copies(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "source/scan.r3d", "scan")
    gone = write(tmp_path / "a", "facts.json", "old")
    here.keep("p")
    there.fetch("p")
    write(tmp_path / "b", "masks/1", "mask")
    there.keep("p")  # of a folder without the recording
    gone.unlink()
    write(tmp_path / "a", "work/x", "x")
    here.keep("p")
    there.fetch("p", recording=True)
    here.fetch("p")
    assert read_all(tmp_path / "a") == {"source/scan.r3d": "scan", "masks/1": "mask", "work/x": "x"} == read_all(tmp_path / "b")


def test_concurrent_writers_to_one_store_lose_no_files(objects: Objects, tmp_path: Path) -> None:
    mirrors = [Mirror(objects, tmp_path / str(number)) for number in range(6)]
    for number in range(6):
        write(tmp_path / str(number), f"masks/{number}", str(number))
    threads = [threading.Thread(target=mirror.keep, args=("p",)) for mirror in mirrors]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    last = Mirror(objects, tmp_path / "last")
    last.fetch("p")
    assert read_all(tmp_path / "last") == {f"masks/{number}": str(number) for number in range(6)}


def test_a_machine_fetches_files_stored_by_others_meanwhile(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "masks/1", "1")
    write(tmp_path / "b", "masks/2", "2")
    here.keep("p")
    there.keep("p")
    there.fetch("p")
    assert read_all(tmp_path / "b") == {"masks/1": "1", "masks/2": "2"}


def test_a_machine_that_lost_its_job_stores_page_changes_but_no_results(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "project.json", "{}")
    here.keep("p")
    here.hold("p", "first")
    write(tmp_path / "a", "work/nouns/old.noun", "kept in time")
    here.keep("p")
    there.hold("p", "second")  # the first has been silent for too long
    there.fetch("p")
    write(tmp_path / "b", "work/nouns/x.noun", "by the second")
    there.keep("p")
    write(tmp_path / "a", "work/nouns/x.noun", "by the first, late")
    write(tmp_path / "a", "work/nouns/y.noun", "by the first, late")
    write(tmp_path / "a", "masks/1.json", "drawn meanwhile")
    (tmp_path / "a/projects/p" / "work/nouns/old.noun").unlink()
    with pytest.raises(Lost, match="another machine goes on"):
        here.keep("p")
    here.keep("p")
    here.fetch("p")
    there.fetch("p")
    made = {"work/nouns/old.noun": "kept in time", "work/nouns/x.noun": "by the second"}
    assert (
        read_all(tmp_path / "a")
        == read_all(tmp_path / "b")
        == {"project.json": "{}", "masks/1.json": "drawn meanwhile", **made}
    )
    here.hold("p", "third")
    write(tmp_path / "a", "work/nouns/z.noun", "by its next job")
    here.keep("p")


def test_a_helper_stores_results_only_while_its_job_owns_the_project(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "project.json", "{}")
    here.keep("p")
    here.hold("p", "first")
    there.hold("p", "first", taken=True)
    write(tmp_path / "b", "work/part.noun", "part")
    there.keep("p")
    here.hold("p", "second")
    write(tmp_path / "b", "work/part.noun", "late")
    with pytest.raises(Lost):
        there.keep("p")


def test_a_permanently_deleted_project_cannot_be_stored_again(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "work/x", "x")
    here.keep("p")
    there.fetch("p")
    assert not there.was_deleted("p")
    here.delete("p")
    assert there.was_deleted("p")
    write(tmp_path / "b", "work/y", "y")
    with pytest.raises(NotFound, match="deleted"):
        there.keep("p")
    there.tidy(frozenset())
    assert not (tmp_path / "b/projects/p").exists()
    assert objects.has("projects/p/manifest.json") is False


def test_the_cache_evicts_only_stored_projects_that_are_not_in_use(
    objects: Objects, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = Mirror(objects, tmp_path / "a", quota_bytes=3)
    write(tmp_path / "a", "work/x", "four")
    cache.keep("p")
    cache.fetch("p")
    cache.tidy(frozenset())
    assert read_all(tmp_path / "a") == {"work/x": "four"}  # a page may be reading it
    monkeypatch.setattr("app.store.mirror.UNUSED_S", -1.0)
    cache.tidy(frozenset({"p"}))
    assert read_all(tmp_path / "a") == {"work/x": "four"}
    write(tmp_path / "a", "masks/1", "not kept yet")
    cache.tidy(frozenset())
    assert not (tmp_path / "a/projects/p").exists()
    monkeypatch.setattr("app.store.mirror.UNUSED_S", UNUSED_S)
    cache.fetch("p")
    assert read_all(tmp_path / "a") == {"work/x": "four", "masks/1": "not kept yet"}


def test_a_log_is_readable_on_another_machine_while_it_is_written(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    here.keep_log("p", write(tmp_path / "a", "logs/job-1.log", "one line"))
    log = tmp_path / "b/projects/p/logs/job-1.log"
    there.fetch_log("p", log)
    assert log.read_text() == "one line"


def test_stored_files_with_a_wrong_checksum_are_refused(objects: Objects, tmp_path: Path) -> None:
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "work/x", "x")
    here.keep("p")
    (name,) = (name for name in objects.old("projects/p/files/", -LONG))
    objects.put(name, write(tmp_path / "c", "x", "y"))
    with pytest.raises(Unavailable, match="other bytes"):
        there.fetch("p")
    assert read_all(tmp_path / "b") == {}


def test_a_browser_downloads_from_the_store_by_a_link_with_the_file_name(
    s3: ObjectServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in s3.environment.items():
        monkeypatch.setenv(name, value)
    mirror = Mirror(open_objects(f"s3://{BUCKET}/{tmp_path.name}"), tmp_path / "a")
    bundle = write(tmp_path / "a", "bundles/v1.zip", "bundle")
    assert mirror.link("p", bundle, "Kitchen-v1.zip") is None  # not stored yet
    mirror.keep("p")
    link = mirror.link("p", bundle, "Kitchen-v1.zip")
    assert link is not None
    assert link.partition("?")[0].endswith("/Kitchen-v1.zip")
    with urllib.request.urlopen(link) as answer:
        assert answer.read() == b"bundle"


def test_a_download_copy_is_renewed_before_it_is_old_enough_to_be_deleted(
    s3: ObjectServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import obstore

    for name, value in s3.environment.items():
        monkeypatch.setenv(name, value)
    objects = open_objects(f"s3://{BUCKET}/{tmp_path.name}")
    objects.put("bundle", write(tmp_path, "bundle", "bundle"))
    made: list[str] = []
    monkeypatch.setattr(obstore, "copy", lambda store, name, to, sound=obstore.copy: made.append(to) or sound(store, name, to))
    for fresh in (LONG, LONG, timedelta()):
        assert objects.link("bundle", "copy.zip", fresh=fresh) is not None
    assert made == ["copy.zip"] * 2


@pytest.mark.parametrize("recording", [False, True])
def test_pages_read_a_project_while_its_files_are_transferred(tmp_path: Path, recording: bool) -> None:
    import obstore

    objects = Objects(obstore.store.MemoryStore())
    here, there = machines(objects, tmp_path)
    write(tmp_path / "a", "work/x", "x")
    write(tmp_path / "a", "source/scan.r3d", "scan")
    here.keep("p")
    there.fetch("p")
    begun, slow = threading.Event(), Objects(objects._store)

    def hang(*given: Any) -> Any:
        begun.set()
        assert released.wait(PATIENCE_S)
        return getattr(objects, call)(*given)

    call = "get" if recording else "put"
    setattr(slow, call, hang)
    there._objects = slow
    write(tmp_path / "b", "masks/1", "mask")
    transfer = (lambda: there.fetch("p", recording=True)) if recording else (lambda: there.keep("p"))
    thread = threading.Thread(target=transfer, daemon=True)
    with held() as released:
        thread.start()
        assert begun.wait(PATIENCE_S)
        there.fetch("p")
    thread.join()
    there.keep("p")
    here.fetch("p")
    assert ("source/scan.r3d" in read_all(tmp_path / "b")) == recording
    assert read_all(tmp_path / "a")["masks/1"] == "mask" == read_all(tmp_path / "b")["masks/1"]


def test_transfers_at_the_same_time_lose_no_files(tmp_path: Path) -> None:
    import obstore

    store = obstore.store.MemoryStore()
    here, there = machines(Objects(store), tmp_path)
    write(tmp_path / "a", "work/old", "old")
    here.keep("p")
    there.fetch("p")
    begun, slow = threading.Event(), Objects(store)

    def get(name: str, path: Path) -> str:
        begun.set()
        assert released.wait(PATIENCE_S)
        return Objects(store).get(name, path)

    slow.get = get  # type: ignore[method-assign]
    there._objects = slow
    write(tmp_path / "a", "work/new", "new")
    (tmp_path / "a/projects/p" / "work/old").unlink()
    here.keep("p")
    thread = threading.Thread(target=there.fetch, args=("p",), daemon=True)
    with held() as released:
        thread.start()
        assert begun.wait(PATIENCE_S)
        write(tmp_path / "b", "masks/1", "mask")
        there.keep("p")
    thread.join()
    here.fetch("p")
    there.fetch("p")
    assert read_all(tmp_path / "a") == {"work/new": "new", "masks/1": "mask"} == read_all(tmp_path / "b")


@pytest.mark.parametrize("address", ["nonsense", "ftp://host/x", "s3://"])
def test_an_invalid_store_address_is_refused_in_one_line(address: str) -> None:
    with pytest.raises(InputError, match="R2C2R_STORE") as refused:
        open_objects(address)
    assert "\n" not in str(refused.value)
