"""history as differences with the standing of each change; stored sizes, and keys of masks and results

A downgrade restores whole states by reverting the differences from the current state.

Revision ID: 0011
Revises: 0010
"""

import hashlib
import json
from collections.abc import Iterator
from typing import Any

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString
FIELDS = ("name", "category", "colour", "deleted")
USUAL = {"generator": "completion", "matcher": "sift"}  # backends that were the default at this revision
State = dict[str, Any]


def upgrade() -> None:
    op.add_column("projects", sa.Column("inputs", TEXT(), nullable=False, server_default=""))
    op.add_column("projects", sa.Column("size_bytes", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("projects", sa.Column("sized", sa.Float(), nullable=False, server_default="0"))
    op.add_column("objects", sa.Column("masks_key", TEXT(), nullable=False, server_default=""))
    op.add_column("objects", sa.Column("inputs", TEXT(), nullable=False, server_default=""))
    op.add_column("events", sa.Column("standing", TEXT(), nullable=True))
    _difference_events()
    _note_standing()
    op.drop_index("ix_events_object", "events")
    op.create_index("ix_events_object", "events", ["project_id", "object_id", "at"])
    op.create_index("ix_events_standing", "events", ["project_id", "scope", "object_id", "standing"])
    op.create_index("ix_events_target", "events", ["target"])
    for project in _rows("SELECT * FROM projects"):
        old, new = _old_key(project), _note_keys(project)
        _run("UPDATE bundles SET inputs=:new WHERE project_id=:id AND inputs=:old", new=new, old=old, id=project["id"])


def downgrade() -> None:
    for project in _rows("SELECT * FROM projects"):
        key = {"old": _old_key(project), "new": project["inputs"], "id": project["id"]}
        _run("UPDATE bundles SET inputs=:old WHERE project_id=:id AND inputs=:new", **key)
    _whole_events()
    for name in ("ix_events_target", "ix_events_standing", "ix_events_object"):
        op.drop_index(name, "events")
    op.create_index("ix_events_object", "events", ["project_id", "object_id"])
    for table, columns in (
        ("events", ("standing",)),
        ("objects", ("inputs", "masks_key")),
        ("projects", ("sized", "size_bytes", "inputs")),
    ):
        for column in columns:
            op.drop_column(table, column)


def _difference_events() -> None:
    """Reduce each event to the replaced and the new values, instead of the whole states before and after."""
    for event in _changes():
        before, after = _flat(event["scope"], event["before"]), _flat(event["scope"], event["after"])
        _store(event, _without(before, after), _without(after, before))


def _note_standing() -> None:
    """Replay the undos and redos once, and store the resulting standing of each change."""
    done: dict[tuple[Any, ...], list[int]] = {}
    undone: dict[tuple[Any, ...], list[int]] = {}
    standing: dict[int, str] = {}
    wanted = "SELECT id, project_id, object_id, scope, action FROM events WHERE scope IN ('prompts', 'review') ORDER BY id"
    for number, *of, action in op.get_bind().execute(sa.text(wanted)):
        past, future = done.setdefault(tuple(of), []), undone.setdefault(tuple(of), [])
        if action == "undo":
            future.append(past.pop())
            standing[future[-1]] = "undone"
        elif action == "redo":
            past.append(future.pop())
            standing[past[-1]] = "done"
        else:
            standing |= dict.fromkeys(future, "gone") | {number: "done"}
            past.append(number)
            future.clear()
    for number, where in standing.items():
        _run("UPDATE events SET standing=:where WHERE id=:id", where=where, id=number)


def _whole_events() -> None:
    """Each object's whole states, from the current one back to its first."""
    states: dict[tuple[int, str], State] = {}
    for event in _changes(newest_first=True):
        of = (event["object_id"], event["scope"])
        after = states[of] if of in states else _state_now(*of)
        before = {key: value for key, value in after.items() if key not in (event["after"] or {})} | (event["before"] or {})
        states[of] = before
        _store(event, _whole(event["scope"], before), _whole(event["scope"], after))


def _state_now(object_id: int, scope: str) -> State:
    if scope == "prompts":
        (item,) = _rows("SELECT name, category, colour, deleted FROM objects WHERE id=:id", id=object_id)
        points = {f"point {point.pop('id')}": point for point in _points(object_id)}
        return {**item, "deleted": bool(item["deleted"])} | points
    said = _rows("SELECT candidate, verdict, reason, who, at FROM verdicts WHERE object_id=:id", id=object_id)
    corrected = {f"override {key}": value for key, value in _override(object_id).items()}
    return corrected | {f"verdict {verdict.pop('candidate')}": verdict for verdict in said}


def _flat(scope: str, whole: State | None) -> State:
    if whole is None:
        return {}
    if scope == "prompts":
        points = {f"point {p['id']}": {key: p[key] for key in ("frame", "x", "y", "label")} for p in whole["points"]}
        return {name: whole[name] for name in FIELDS} | points
    said = {f"verdict {v['candidate']}": {k: x for k, x in v.items() if k != "candidate"} for v in whole["verdicts"]}
    return {f"override {key}": value for key, value in whole["override"].items()} | said


def _whole(scope: str, flat: State) -> State:
    if scope == "prompts":
        numbers = sorted(int(key.removeprefix("point ")) for key in flat if key.startswith("point "))
        points = [{"id": number, **flat[f"point {number}"]} for number in numbers]
        return {name: flat[name] for name in FIELDS} | {"points": points}
    said = sorted((key.removeprefix("verdict "), value) for key, value in flat.items() if key.startswith("verdict "))
    corrected = {key.removeprefix("override "): value for key, value in flat.items() if key.startswith("override ")}
    return {"override": corrected, "verdicts": [{"candidate": candidate, **verdict} for candidate, verdict in said]}


def _without(state: State, other: State) -> State:
    return {key: value for key, value in state.items() if key not in other or other[key] != value}


def _note_keys(project: State) -> str:
    """Store what db/keys.py stores with every change; return the project's key."""
    given = []
    for item in _rows("SELECT * FROM objects WHERE project_id=:id ORDER BY id", id=project["id"]):
        clicks = [[p["frame"], p["x"], p["y"], p["label"]] for p in _points(item["id"])]
        on_it = any(label for *_, label in clicks)
        drawn = json.dumps([project["segmenter"], item["category"], clicks])
        masks = hashlib.sha256(drawn.encode()).hexdigest()[:20] if on_it else ""
        corrected = _entry(_override(item["id"]))
        parts = (item["name"], item["category"] if on_it else "", clicks if on_it else None, corrected)
        inputs = _key(*parts) if on_it or corrected else ""
        _run("UPDATE objects SET masks_key=:masks, inputs=:inputs WHERE id=:id", masks=masks, inputs=inputs, id=item["id"])
        if inputs and not item["deleted"]:
            given.append(inputs)
    key = _key(given, project["segmenter"], {seam: project[seam] for seam, name in USUAL.items() if project[seam] != name})
    _run("UPDATE projects SET inputs=:key WHERE id=:id", key=key, id=project["id"])
    return key


def _old_key(project: State) -> str:
    """The former key of a person's inputs: that of the two documents that a run reads."""
    objects, corrected = [], {}
    for item in _rows("SELECT * FROM objects WHERE project_id=:id AND NOT deleted ORDER BY id", id=project["id"]):
        clicks = [{key: p[key] for key in ("frame", "x", "y", "label")} for p in _points(item["id"])]
        if any(click["label"] == 1 for click in clicks):
            objects.append({"name": item["name"], "category": item["category"], "points": clicks})
        if entry := _entry(_override(item["id"])):
            corrected[item["name"]] = entry
    others = [f"{seam} {project[seam]}" for seam, name in USUAL.items() if project[seam] != name]
    return _key({"version": 1, "objects": objects}, {"version": 1, "objects": corrected}, project["segmenter"], *others)


def _entry(stored: State) -> State:
    data = {key: value for key, value in stored.items() if value not in (None, [], {})}
    limits = [data.pop("joint_lower", None), data.pop("joint_upper", None)]
    return data if limits == [None, None] else {**data, "joint_limits": limits}


def _key(*parts: Any) -> str:
    return hashlib.sha256(json.dumps(list(parts), sort_keys=True).encode()).hexdigest()[:32]


def _points(object_id: int) -> list[State]:
    return _rows("SELECT id, frame, x, y, label FROM prompt_points WHERE object_id=:id ORDER BY id", id=object_id)


def _override(object_id: int) -> State:
    found = _rows("SELECT data FROM overrides WHERE object_id=:id", id=object_id)
    stored: State = json.loads(found[0]["data"]) if found else {}
    return stored


def _changes(*, newest_first: bool = False) -> Iterator[State]:
    """The events of objects' states one by one: the whole states of a long history do not fit into memory together."""
    numbers = _rows("SELECT id FROM events WHERE scope IN ('prompts', 'review') ORDER BY id" + " DESC" * newest_first)
    for number in numbers:
        (event,) = _rows("SELECT id, object_id, scope, before, after FROM events WHERE id=:id", **number)
        yield event | {key: json.loads(event[key]) if event[key] else None for key in ("before", "after")}


def _store(event: State, before: State, after: State) -> None:
    texts = {"before": json.dumps(before), "after": json.dumps(after)}
    _run("UPDATE events SET before=:before, after=:after WHERE id=:id", **texts, id=event["id"])


def _rows(query: str, **values: Any) -> list[State]:
    return [dict(row) for row in op.get_bind().execute(sa.text(query), values).mappings()]


def _run(query: str, **values: Any) -> None:
    op.get_bind().execute(sa.text(query), values)
