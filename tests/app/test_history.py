"""History of differences, from which every state is restored, also for databases from before it stored those."""

import json
import random
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from alembic.config import Config
from sqlmodel import Session, create_engine, select

from alembic import command
from app.db import history
from app.db.engine import open_engine, writing
from app.db.migrations import migrate
from app.db.tables import Bundle, Event, Project, SceneObject
from app.settings import shipped
from r2c2r_core.workspace import content_key
from tests.app.conftest import Running

pytestmark = pytest.mark.both_databases


OLD = "0010"  # the last revision that stored whole states


class OldHistory:
    """Random edits of one object, as revision 0010 would have stored them."""

    def __init__(self, seed: int) -> None:
        self.rng, self.at = random.Random(seed), 0
        self.states: dict[str, Any] = {
            "prompts": {"name": "drawer_1", "category": "drawer", "colour": 0, "deleted": True, "points": []},
            "review": {"override": {}, "verdicts": []},
        }
        self.events: list[tuple[Any, ...]] = []
        self.done: dict[str, list[int]] = {"prompts": [], "review": []}
        self.undone: dict[str, list[int]] = {"prompts": [], "review": []}
        self.past: dict[str, list[Any]] = {"prompts": [], "review": []}  # states that undo returns to

    def do(self, scope: str) -> None:
        before = json.loads(json.dumps(self.states[scope]))
        if self.undone[scope] and self.rng.random() < 0.3:
            target = self.undone[scope].pop()
            self.past[scope].append(before)
            self._record(scope, "redo", before, self.events[target - 1][9], target)
            self.done[scope].append(target)
        elif self.done[scope] and self.rng.random() < 0.35:
            target = self.done[scope].pop()
            self._record(scope, "undo", before, self.past[scope].pop(), target)
            self.undone[scope].append(target)
        else:
            after = self._changed(scope, before)
            if after == before:
                return
            self.past[scope].append(before)
            self._record(scope, "change", before, after, None)
            self.done[scope].append(self.at)
            self.undone[scope].clear()

    def _changed(self, scope: str, before: Any) -> Any:
        rng, after = self.rng, json.loads(json.dumps(before))
        if scope == "review":
            after["override"] = rng.choice(
                [{}, {"hinge": "left"}, {"joint_lower": 0.0, "joint_upper": 1.5, "rejected": ["c1"]}]
            )
            said = {"verdict": rng.choice(["accepted", "rejected"]), "reason": "", "who": "eve", "at": 5.0}
            after["verdicts"] = [{"candidate": c, **said} for c in ("c0", "c1") if rng.random() < 0.5]
            return after
        after["deleted"] = rng.random() < 0.1
        after["name"] = rng.choice(["drawer_1", "top", before["name"]])
        keep = [p for p in after["points"] if rng.random() < 0.85]
        for point in keep:
            if rng.random() < 0.2:
                point["x"] = round(rng.uniform(0, 100), 2)
        new = {"id": 1000 + self.at, "frame": 3, "x": rng.uniform(0, 100), "y": 60.5, "label": rng.choice([0, 1])}
        after["points"] = [*keep, new] if rng.random() < 0.7 else keep
        return after

    def _record(self, scope: str, action: str, before: Any, after: Any, target: int | None) -> None:
        self.at += 1
        self.states[scope] = after
        said = (self.at, "p", 1, scope, action, f"{action} {self.at}", None, "eve", float(self.at))
        self.events.append((*said, after, before, target))

    def store(self, connection: sqlite3.Connection) -> None:
        prompts, review = self.states["prompts"], self.states["review"]
        project = ("p", "Kitchen", "ready", 1.0, 2.0, "scan.r3d", "{}", "[]", "v", "geometric", "completion", "sift", "draft")
        names = (
            "id, name, status, created, updated, source_name, capture, notices, media_version, segmenter, generator, matcher"
        )
        connection.execute(f"INSERT INTO projects ({names}, review_state) VALUES ({','.join('?' * 13)})", project)
        item = (1, "p", prompts["name"], prompts["category"], prompts["colour"], self.at, prompts["deleted"])
        connection.execute("INSERT INTO objects VALUES (?, ?, ?, ?, ?, ?, ?)", item)
        for p in prompts["points"]:
            connection.execute(
                "INSERT INTO prompt_points VALUES (?, 1, ?, ?, ?, ?)", [p[k] for k in ("id", "frame", "x", "y", "label")]
            )
        connection.execute("INSERT INTO overrides VALUES (1, 'p', 1, ?)", [json.dumps(review["override"])])
        for v in review["verdicts"]:
            row = [v[k] for k in ("candidate", "verdict", "reason", "who", "at")]
            connection.execute(
                "INSERT INTO verdicts (object_id, candidate, verdict, reason, who, at) VALUES (1, ?, ?, ?, ?, ?)", row
            )
        for *said, after, before, target in self.events:
            row = [*said, json.dumps(before), json.dumps(after), target]
            connection.execute(f"INSERT INTO events ({EVENT}) VALUES ({','.join('?' * 12)})", row)


EVENT = "id, project_id, object_id, scope, action, text, frame, who, at, before, after, target"


def old_database(path: Path, seed: int) -> OldHistory:
    """Create a database of the old revision; return the edits stored in it."""
    engine = create_engine(f"sqlite:///{path}")
    migrate(engine, OLD)
    engine.dispose()
    old = OldHistory(seed)
    for _ in range(60):
        old.do(old.rng.choice(["prompts", "prompts", "review"]))
    with sqlite3.connect(path) as connection:
        old.store(connection)
    connection.close()
    return old


def go_down(path: Path) -> None:
    config = Config()
    config.set_main_option("script_location", str(shipped("alembic", "env.py")))
    config.set_main_option("path_separator", "os")
    with (engine := create_engine(f"sqlite:///{path}")).begin() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, OLD)
    engine.dispose()


def events(path: Path) -> list[Any]:
    with sqlite3.connect(path) as connection:
        rows = connection.execute(f"SELECT {EVENT} FROM events ORDER BY id").fetchall()
    connection.close()
    return [(*row[:9], json.loads(row[9]), json.loads(row[10]), row[11]) for row in rows]


def whole(session: Session, scope: history.Scope) -> Any:
    """The object's state as the old revision wrote it."""
    flat = history.snapshot(session, session.get_one(SceneObject, 1), scope)
    if scope == "prompts":
        points = [{"id": int(key.split()[1]), **value} for key, value in flat.items() if key.startswith("point ")]
        newer = ("front", "crop", "assignee", "locked_by")  # fields that did not exist at that revision
        fields = {key: value for key, value in flat.items() if " " not in key and key not in newer}
        return fields | {"points": points}
    corrected = {key.split()[1]: value for key, value in flat.items() if key.startswith("override ")}
    return {"override": corrected, "verdicts": [{"candidate": k.split()[1], **v} for k, v in flat.items() if k[0] == "v"]}


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
def test_an_old_history_migrates_to_undoable_differences_and_back(tmp_path: Path, seed: int) -> None:
    scopes: tuple[history.Scope, ...] = ("prompts", "review")
    path = tmp_path / f"{seed}.db"
    old = old_database(path, seed)
    stored = events(path)
    engine = open_engine(path)
    with writing(engine) as session:
        item = session.get_one(SceneObject, 1)
        for scope in scopes:
            steps = history.steps(session, "p", scope).get(1, history.Steps())
            assert steps == (bool(old.done[scope]), bool(old.undone[scope]))
            assert whole(session, scope) == old.states[scope]
            for number, before in zip(reversed(old.done[scope]), reversed(old.past[scope]), strict=True):
                assert history.undo(session, item, scope, who="eve").id == number
                assert whole(session, scope) == before
            for number in old.done[scope] + old.undone[scope][::-1]:
                redone = history.redo(session, item, scope, who="eve")
                assert (redone.id, whole(session, scope)) == (number, old.events[number - 1][9])
        session.rollback()
    engine.dispose()
    go_down(path)
    assert events(path) == stored


def test_current_results_stay_current_after_upgrade_and_downgrade(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    engine = create_engine(f"sqlite:///{path}")
    migrate(engine, OLD)
    engine.dispose()
    click = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}
    with sqlite3.connect(path) as connection:
        old = OldHistory(0)
        old.states["prompts"] |= {"deleted": False, "points": [{"id": 1, **click}]}
        old.states["review"] = {"override": {"hinge": "left"}, "verdicts": []}
        old.store(connection)
        old_key = _old_key(click)
        for version, key in ((1, "something else"), (2, old_key)):
            row = (version, "p", version, "v.zip", "00", 1, 1.0, "null", key)
            columns = "id, project_id, version, path, sha256, size, created, certificate, inputs"
            connection.execute(f"INSERT INTO bundles ({columns}) VALUES ({','.join('?' * 9)})", row)
    connection.close()
    engine = open_engine(path)
    with writing(engine) as session:
        project, bundles = session.get_one(Project, "p"), session.exec(select(Bundle).order_by("version")).all()
        assert [bundle.inputs == project.inputs for bundle in bundles] == [False, True]
        item, before = session.get_one(SceneObject, 1), project.inputs
        keys = (item.masks_key, item.inputs)
        with history.change(session, item, "prompts", "edit", "x", who="eve"):
            item.category = "oven"
        assert project.inputs != before
        history.undo(session, item, "prompts", who="eve")
        assert (project.inputs, item.masks_key, item.inputs) == (before, *keys)  # the migration computes the same keys
        session.rollback()
    engine.dispose()
    go_down(path)
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT inputs FROM bundles ORDER BY version").fetchall() == [("something else",), (old_key,)]
    connection.close()


def _old_key(click: dict[str, Any]) -> str:
    """The key of all inputs by the rule of revision 0010."""
    prompts = {"version": 1, "objects": [{"name": "drawer_1", "category": "drawer", "points": [click]}]}
    return content_key(prompts, {"version": 1, "objects": {"drawer_1": {"hinge": "left"}}}, "geometric")


def test_the_size_of_a_history_entry_does_not_grow_with_the_object(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    for k in range(12):
        click = {"frame": 3, "x": float(k), "y": 20.0, "label": 0}
        web.post(f"/api/projects/{project}/objects/{number}/points?infer=false", click, 201)
    with Session(web.context.engine) as session:
        clicks = session.exec(select(Event).where(Event.object_id == number, Event.action == "add point")).all()
        sizes = {len(json.dumps([event.before, event.after])) for event in clicks}
    assert len(clicks) == 12
    assert max(sizes) - min(sizes) <= 4  # only digits of the numbers differ


def test_entries_are_marked_undone_until_the_next_change(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    at = f"/api/projects/{project}/objects/{number}"

    def undone() -> list[str]:
        return [entry["text"] for entry in web.get(f"/api/projects/{project}/history") if entry["undone"]]

    web.patch(at, {"name": "top"})
    web.patch(at, {"category": "oven"})
    web.post(f"/api/projects/{project}/undo", {"object": number})
    web.post(f"/api/projects/{project}/undo", {"object": number})
    assert undone() == ["category of top → oven", "name of drawer_1 → top"]
    web.post(f"/api/projects/{project}/redo", {"object": number})
    assert undone() == ["category of top → oven"]
    web.patch(at, {"colour": 3})
    assert undone() == []
