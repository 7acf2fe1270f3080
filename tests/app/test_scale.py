"""Cost of requests independent of the amount of data, counted in queries and bytes, which need no clock."""

import json
import re
from typing import Any

import pytest
from sqlalchemy.event import listen, remove
from sqlmodel import select

from app import schemas
from app.db import history
from app.db.engine import writing
from app.db.queries import project_row
from app.db.tables import Bundle, Comment, Event, Job, Override, Point, Project, SceneObject, Verdict
from app.file_cache import FileCache
from app.files import project_files
from app.jobs import mask_store
from app.jobs.mask_store import mask_path
from app.jobs.plain import plain
from app.services import views
from app.services.candidates import _candidate_facts
from r2c2r_core.workspace import Workspace, content_key
from tests.app.conftest import Running, statements
from tests.app.nouns import candidates, finish, placement
from tests.app.test_jobs import run

pytestmark = pytest.mark.both_databases


OBJECTS, CLICKS = 40, 12  # added to the project
MOST_BYTES = 40_000  # on the wire, at that size: 300 kB at 200 objects and 5,000 clicks


def questions(web: Running, project: str, item: int) -> list[str]:
    """Every GET path of the API that concerns the project."""
    values = {
        "project": project,
        "object": item,
        "frame": 3,
        "job": 1,
        "version": 1,
        "webhook": 1,
        "template": 1,
        "other": project,
    }
    paths = web.app.openapi()["paths"]
    asked = [path for path, methods in paths.items() if "get" in methods and path.startswith("/api/")]
    return [path.format(**values) + ("?since=1" * path.endswith("changes")) for path in asked if "{upload}" not in path]


def grow(web: Running, project: str) -> None:
    """Add objects, clicks, comments, verdicts, jobs and bundles to the project, and more projects."""
    with writing(web.context.engine) as session:
        row = project_row(session, project)
        for k in range(OBJECTS):
            item = SceneObject(project_id=project, name=f"more_{k}", category="drawer", colour=k, deleted=True)
            session.add(item)
            session.flush()
            with history.change(session, item, "prompts", "create", "made", who="eve"):
                item.deleted = False
                clicks = [Point(object_id=item.id or 0, frame=3, x=float(n), y=60.5, label=1) for n in range(CLICKS)]
                session.add_all(clicks)
            session.add(Override(project_id=project, object_id=item.id, data={"hinge": "left"}))
            session.add(Verdict(object_id=item.id or 0, candidate="c0", verdict="accepted", who="eve", at=1.0))
            session.add(Comment(project_id=project, object_id=item.id, text="look", who="eve", at=1.0))
            session.add(Job(project_id=project, kind="run", state="done", created=1.0))
            session.add(Bundle(project_id=project, version=10 + k, path="v1.zip", sha256="ab" * 32, size=1, created=1.0))
            path = mask_path(web.context.files(row).masks, item.id or 0, item.masks_key)
            mask_store.write(path, [_entry(frame) for frame in range(0, 400, 2)], "geometric")
        for k in range(OBJECTS):
            other = row.model_dump(exclude={"id", "name"})
            session.add(Project(id=f"other{k}", name=f"Kitchen {k}", **other))
            session.flush()
            session.add(Job(project_id=f"other{k}", kind="run", state="queued", created=1.0))
            session.add(Bundle(project_id=f"other{k}", version=1, path="v1.zip", sha256="ab" * 32, size=1, created=1.0))


def _entry(frame: int) -> mask_store.Entry:
    box = {"width": 160, "height": 120, "left": frame % 100, "top": 1, "box_width": 0, "box_height": 0, "bits": ""}
    return {"frame": frame, "confidence": (frame * 37 % 100) / 100, "area": 0.01, "mask": box}


@pytest.fixture
def finished(web: Running, monkeypatch: pytest.MonkeyPatch) -> tuple[Running, str, int]:
    monkeypatch.setattr("app.services.people.REMEMBERED_S", 1e6)  # session look-ups are cached
    web.context.people.look_again()
    project = web.sample()
    web.job(run(web, project), "done")
    finish(web.settings.data_dir / "projects" / project / "work")
    web.context.runner.stop()  # jobs of the other projects stay queued
    return web, project, web.get(f"/api/projects/{project}/objects")[0]["id"]


@pytest.mark.both_databases(quick=False)
def test_get_requests_need_no_more_queries_or_bytes_with_more_data(
    finished: tuple[Running, str, int],
) -> None:
    web, project, item = finished
    asked = questions(web, project, item)
    web.context.runner.stop()  # no background statements are counted
    web.context.descriptions.stop()

    def count(path: str) -> tuple[int, int]:
        with statements(web.context.engine) as queries, web.client.stream("GET", path) as answer:
            size = len(b"".join(answer.iter_raw()))
        assert answer.status_code < 500, path
        return len(queries), size

    before = {path: count(path)[0] for path in asked}
    grow(web, project)
    after = {path: min(count(path), count(path)) for path in asked}  # at most one of the two counts includes a clean-up
    assert len(asked) > 25
    more = {path: (before[path], number) for path, (number, _) in after.items() if number > before[path] + QUEUE.get(path, 0)}
    assert more == {}
    assert {path: size for path, (_, size) in after.items() if size > MOST_BYTES} == {}


@pytest.mark.both_databases(quick=False)
def test_get_requests_do_not_load_the_stored_states_of_events(finished: tuple[Running, str, int]) -> None:
    """Neither the undo flags of objects nor the history need the stored states, and events are not replayed."""
    web, project, item = finished
    grow(web, project)
    with writing(web.context.engine) as session:
        stored = session.exec(select(Event.before, Event.after)).all()
    assert sum(before is not None or after is not None for before, after in stored) > OBJECTS  # there are states to read
    web.context.descriptions.stop()
    loaded: list[Event] = []
    listen(Event, "load", count := lambda event, _: loaded.append(event))
    try:
        for path in questions(web, project, item):
            loaded.clear()
            with statements(web.context.engine) as queries:
                web.client.get(path)
            whole = [ONE_WORD.sub("", query) for query in queries]
            bodies = [query for query in whole if re.search(r'events\."?(before|after)\b', query)]
            last = path.endswith("/review")  # the project's last change of state is shown with its reason
            assert len(bodies) <= last, f"{path} asked {bodies}"
            assert (len(loaded) > last) == path.endswith("/history"), f"{path} loaded {len(loaded)} events"
    finally:
        remove(Event, "load", count)


ONE_WORD = re.compile(r"JSON_EXTRACT\([^)]*\)|events\.(before|after) ->> ")  # one field of a state, in SQLite and Postgres
QUEUE = {"/api/projects": 1, "/api/jobs": 1}  # a waiting job's position in the queue takes one more query


@pytest.mark.both_databases(quick=False)
def test_masks_and_objects_sent_as_stored_match_their_schemas(finished: tuple[Running, str, int]) -> None:
    web, project, item = finished
    grow(web, project)
    frames = web.get(f"/api/projects/{project}/masks/4")
    objects = web.get(f"/api/projects/{project}/objects?deleted=true")
    assert len(frames) >= OBJECTS
    assert max(len(each["points"]) for each in objects) == CLICKS
    for address, shape, said in (("masks/{frame}", schemas.FrameMask, frames), ("objects", schemas.SceneObject, objects)):
        assert [shape.model_validate(each, strict=True).model_dump() for each in said] == said
        declared = web.app.openapi()["paths"][f"/api/projects/{{project}}/{address}"]["get"]["responses"]["200"]
        assert declared["content"]["application/json"]["schema"]["items"] == {"$ref": f"#/components/schemas/{shape.__name__}"}
    one = next(each for each in objects if each["id"] == item)
    assert web.post(f"/api/projects/{project}/objects/{item}/segment/cancel", {}) == one


def test_facts_are_cached_on_disk_and_reread_when_a_noun_changes(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    files, reads = project_files(tmp_path, "p"), []
    files.work.mkdir(parents=True)
    finish(files.work)

    def told(noun: Any) -> list[str]:
        reads.append(noun.object_name)
        return [noun.object_name]

    def look() -> list[str] | None:
        monkeypatch.setattr(views, "_FACTS", FileCache(1000))  # as after a restart of the server
        kept = views.KeptFacts(files)
        said = kept.of("generate", "drawer_1", told)
        kept.keep()
        return said

    assert [look(), look(), reads] == [["drawer_1"], ["drawer_1"], ["drawer_1"]]
    finish(files.work)  # another run
    assert [look(), len(reads)] == [["drawer_1"], 2]
    files.kept_facts.write_bytes(b"{")
    assert [look(), len(reads)] == [["drawer_1"], 3]
    monkeypatch.setattr(views, "FACTS_VERSION", 2)
    assert [look(), len(reads)] == [["drawer_1"], 4]
    Workspace(files.work).forget("generate", "drawer_1")
    assert look() is None


def test_the_fields_of_cached_facts_match_their_version() -> None:
    """Increase FACTS_VERSION whenever a field is added or removed: caches of an older server lack the change."""
    told = {"generate": _candidate_facts(candidates("drawer_1")), "align": plain(placement("drawer_1"))}
    fields = sorted(f"{stage} {key}" for stage, said in told.items() for key in (*said, *said.get("candidates", [{}])[0]))
    assert (views.FACTS_VERSION, content_key(fields)) == (1, "76d66364613bb625a1d514b4b602d08a")


MOST_OF_A_CLICK = 16  # statements without the transactions' begins; each row is written once


def test_a_click_stores_only_its_change_with_a_constant_number_of_queries(finished: tuple[Running, str, int]) -> None:
    web, project, item = finished
    web.context.descriptions.stop()  # it would write the descriptions of the added projects meanwhile

    def click() -> int:
        point = {"frame": 3, "x": 1.5, "y": 1.5, "label": 0}
        with statements(web.context.engine) as queries:
            web.post(f"/api/projects/{project}/objects/{item}/points?infer=false", point, 201)
        return len(queries)

    click()
    before = click()
    grow(web, project)
    assert click() == before <= MOST_OF_A_CLICK
    with writing(web.context.engine) as session:
        events = session.exec(select(Event).where(Event.object_id == item, Event.action == "add point")).all()
        assert {(len(stored.before or {}), len(stored.after or {})) for stored in events} == {(0, 1)}


def test_the_file_cache_is_bounded_in_bytes_and_detects_changed_files(tmp_path: Any) -> None:
    made: list[str] = []
    cache: FileCache[str] = FileCache(25)

    def look(name: str) -> str | None:
        def make() -> str:
            made.append(name)
            return (tmp_path / name).read_text()

        return cache.get(tmp_path / name, make, lambda text, _: len(text))

    for name in "abc":
        (tmp_path / name).write_text(name * 10)
    assert [look(name) for name in "abab"] == ["a" * 10, "b" * 10, "a" * 10, "b" * 10]
    assert (made, cache.bytes) == (["a", "b"], 20)
    look("c")  # the third exceeds the size: the least recently used is evicted
    assert (look("b"), made, cache.bytes) == ("b" * 10, ["a", "b", "c"], 20)
    (tmp_path / "b").write_text("new")
    assert (look("b"), cache.bytes) == ("new", 13)
    assert look("nowhere") is None


def test_the_mask_index_is_read_from_the_file_end_or_rebuilt_without_it(tmp_path: Any) -> None:
    path = tmp_path / "masks" / "k.jsonl"
    mask_store.begin(path)
    for frame in (7, 3, 3):
        mask_store.append(path, {**_entry(frame), "confidence": frame / 10})
    begun = mask_store.read(path)
    assert begun is not None
    assert (begun.end, begun.seen()[:, 0].tolist(), begun.entry(5)) == (None, [3.0, 7.0], None)
    mask_store.finish(path, "done", None)
    done = mask_store.read(path)
    assert done is not None
    assert (done.end, done.index.tolist()) == ("done", begun.index.tolist())
    assert (done.entry(7) or {})["confidence"] == 0.7
    with path.open("a") as handle:
        handle.write('{"frame": 9, "conf')  # as after a crash
    cut = mask_store.read(path)
    assert cut is not None
    assert cut.seen().tolist() == done.seen().tolist()
    mask_store.begin(path)  # recomputed meanwhile: the old offsets are invalid
    assert done.entry(7) is None


def test_a_mask_index_of_the_older_unpacked_format_is_readable(tmp_path: Any) -> None:
    entry = {"frame": 4, "confidence": 0.5, "area": 0.1, "mask": {}}
    mask_store.write(tmp_path / "packed", [entry], "geometric")
    line, end = (tmp_path / "packed").read_text().splitlines()
    index = [[4, 0.5, 0.1, 0, len(line) + 1]]
    (tmp_path / "numbers").write_text(f"{line}\n{json.dumps({**json.loads(end), 'index': index})}")
    packed, numbers = (mask_store.read(tmp_path / name) for name in ("packed", "numbers"))
    assert packed is not None
    assert numbers is not None
    assert packed.index.tolist() == numbers.index.tolist() == index
    assert packed.entry(4) == numbers.entry(4) == entry


def test_cached_facts_are_evicted_by_bytes_and_read_again(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    files, reads = project_files(tmp_path, "p"), []
    files.work.mkdir(parents=True)
    finish(files.work)
    monkeypatch.setattr(views, "_FACTS", FileCache(40))

    def told(noun: Any) -> list[str]:
        reads.append(noun.object_name)
        return [noun.object_name] * 2  # 26 bytes as JSON

    for _ in range(2):
        views.facts(files, "generate", "drawer_1", told)
    assert len(reads) == 1
    views.facts(files, "align", "drawer_1", told)  # replaces it
    views.facts(files, "generate", "drawer_1", told)
    assert len(reads) == 3
    assert views.facts(files, "generate", "nothing", told) is None
