"""Event history with old and new values of every change, for undo and redo that survive a restart.

An object's state has two scopes with separate undo: `prompts` (name, category, colour, clicks, assignee, lock, deletion) and
`review` (verdicts, corrections). A state is flat: a key for each field, click, correction and verdict. An event stores only
the differing keys, so the history grows with the changes, not with the state. Undo restores an event's old values and is
itself an event; nothing is ever removed.

There are an undo stack and a redo stack. Events are marked as `done`, `undone`, or `gone` once another change was made
instead; both stacks are ordered by event number.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal, NamedTuple

import sqlalchemy
from sqlalchemy import bindparam, case, func, update
from sqlalchemy.orm import aliased
from sqlmodel import Session, col, delete, select

from app.db.keys import note_object, note_project
from app.db.queries import Click, clicks_of
from app.db.tables import Event, Override, Point, Project, SceneObject, Verdict
from app.errors import Conflict

Scope = Literal["prompts", "review"]
State = dict[str, Any]

_FIELDS = ("name", "category", "colour", "deleted", "front", "crop", "assignee", "locked_by")
_POINT, _FRAME, _CORRECTION, _VERDICT = "point ", "frame ", "override ", "verdict "  # then id, frame, field, candidate


class Steps(NamedTuple):
    """Availability of undo and redo."""

    undo: bool = False
    redo: bool = False


@contextmanager
def change(
    session: Session, item: SceneObject, scope: Scope, action: str, text: str, *, who: str, frame: int | None = None
) -> Iterator[None]:
    """Context that records the block's changes of the object; nothing is recorded without a change."""
    before = snapshot(session, item, scope)
    yield
    session.flush()
    after = snapshot(session, item, scope)
    if after != before:
        _forget_undone(session, item, scope)
        event = _record(session, item, scope, action, text, who=who, frame=frame, state=after)
        event.before, event.after, event.standing = _without(before, after), _without(after, before), "done"


def undo(session: Session, item: SceneObject, scope: Scope, *, who: str) -> Event:
    """Undo the object's last change and return it. Raises Conflict when there is none."""
    target = last_done(session, item, scope)
    if target is None:
        raise Conflict(f"nothing to undo on {item.name}")
    return _step(session, item, scope, target, "undo", who)


def redo(session: Session, item: SceneObject, scope: Scope, *, who: str) -> Event:
    """Redo the last undone change and return it. Raises Conflict when there is none."""
    target = session.exec(_standing(item, scope, "undone").order_by(col(Event.id))).first()
    if target is None:
        raise Conflict(f"nothing to redo on {item.name}")
    return _step(session, item, scope, target, "redo", who)


def last_done(session: Session, item: SceneObject, scope: Scope) -> Event | None:
    """The object's last change that is not undone."""
    return session.exec(_standing(item, scope, "done").order_by(col(Event.id).desc())).first()


def steps(session: Session, project_id: str, scope: Scope, object_id: int | None = None) -> dict[int | None, Steps]:
    """Availability of undo and redo by object, or of one object."""
    query = select(Event.object_id, Event.standing).where(Event.project_id == project_id, Event.scope == scope)
    if object_id is not None:
        query = query.where(Event.object_id == object_id)
    standing = set(session.exec(query.where(col(Event.standing).in_(("done", "undone"))).distinct()))
    return {key: Steps((key, "done") in standing, (key, "undone") in standing) for key, _ in standing}


def steps_and_saved(session: Session, item: SceneObject, scope: Scope) -> tuple[Steps, float]:
    """An object's undo and redo availability, and the time of its last change in any scope, in one query."""
    found = session.execute(_STEPS_AND_SAVED, {"project": item.project_id, "object": item.id, "of": scope}).one()
    return Steps(bool(found[0]), bool(found[1])), found[2] or 0.0


def _any_of_scope(standing: str) -> Any:
    """Whether any event of the scope has this standing, as a number, since Postgres has no max() of booleans."""
    return func.max(case(((col(Event.scope) == bindparam("of")) & (col(Event.standing) == standing), 1), else_=0))


_STEPS_AND_SAVED = sqlalchemy.select(
    _any_of_scope("done"),
    _any_of_scope("undone"),
    func.max(col(Event.at)),
).where(col(Event.project_id) == bindparam("project"), col(Event.object_id) == bindparam("object"))


def last_change(session: Session, project_id: str, scope: Scope, direction: Literal["undo", "redo"], who: str) -> int | None:
    """The object of this person's newest change (or undo) in the project, without objects that others changed since."""
    mine = (Event.project_id == project_id, Event.scope == scope, Event.who == who)
    query = select(Event.object_id).order_by(col(Event.id).desc())
    if direction == "undo":
        later = aliased(Event)
        same = (later.object_id == Event.object_id, later.scope == scope, later.standing == "done")
        newest = ~select(later.id).where(*same, col(later.id) > col(Event.id)).exists()
        return session.exec(query.where(*mine, Event.standing == "done", newest)).first()
    undone = aliased(Event)  # the target of an undo that was not redone since
    query = query.join(undone, col(undone.id) == Event.target).where(*mine, Event.action == "undo")
    return session.exec(query.where(undone.standing == "undone")).first()


def version_of(session: Session, item: SceneObject, scope: Scope) -> int:
    """Version of the object in this scope, increased by every change; 0 before the first."""
    return versions(session, item.project_id, scope, item.id).get(item.id, 0)


def versions(session: Session, project_id: str, scope: Scope, object_id: int | None = None) -> dict[int | None, int]:
    """`version_of`, by object; of one, where one is named."""
    query = select(Event.object_id, func.max(Event.id)).where(Event.project_id == project_id, Event.scope == scope)
    if object_id is not None:
        query = query.where(Event.object_id == object_id)
    return {number: newest or 0 for number, newest in session.exec(query.group_by(col(Event.object_id)))}


def snapshot(session: Session, item: SceneObject, scope: Scope) -> State:
    """The object's state in one scope, flat, as JSON."""
    if scope == "prompts":
        clicks = clicks_of(session, item.id)
        points = {f"{_POINT}{c.id}": {"frame": c.frame, "x": c.x, "y": c.y, "label": c.label} for c in clicks}
        frames = {f"{_FRAME}{number}": said for number, said in item.frames.items()}
        return {**{name: getattr(item, name) for name in _FIELDS}, **points, **frames}
    said = session.exec(select(Verdict).where(Verdict.object_id == item.id).order_by(col(Verdict.candidate)))
    corrected = {f"{_CORRECTION}{key}": value for key, value in override_data(session, item).items()}
    return corrected | {f"{_VERDICT}{v.candidate}": v.model_dump(include={"verdict", "reason", "who", "at"}) for v in said}


def require_open(project: Project) -> None:
    """Raise Conflict when the project is approved, as approved content must not change."""
    if project.review_state == "approved":
        raise Conflict(f"{project.name} is approved", hint="a reviewer can reopen it on the review page")


def set_override(session: Session, item: SceneObject, data: dict[str, Any]) -> None:
    """Store the object's corrections."""
    found = _override(session, item) or Override(project_id=item.project_id, object_id=item.id)
    found.data = dict(data)
    session.add(found)


def override_data(session: Session, item: SceneObject) -> dict[str, Any]:
    """The object's stored corrections."""
    found = _override(session, item)
    return dict(found.data) if found else {}


def _step(session: Session, item: SceneObject, scope: Scope, target: Event, action: str, who: str) -> Event:
    before, after = target.before or {}, target.after or {}
    there, wanted = (after, before) if action == "undo" else (before, after)
    _replace(session, item, scope, there, wanted)
    text = f"{'undid' if action == 'undo' else 'redid'}: {target.text}"
    event = _record(session, item, scope, action, text, who=who, frame=target.frame)
    event.before, event.after, event.target = there, wanted, target.id
    target.standing = "undone" if action == "undo" else "done"
    session.add_all([event, target])
    session.flush()
    return target


def _replace(session: Session, item: SceneObject, scope: Scope, there: State, wanted: State) -> None:
    """Replace the current state by the wanted one, keeping ids of clicks."""
    if scope == "prompts":
        _refuse_taken_name(session, item, wanted)
        for name in _FIELDS:
            setattr(item, name, wanted.get(name, getattr(item, name)))
        kept_frames = {number: said for number, said in item.frames.items() if number not in _named(there, _FRAME)}
        item.frames = kept_frames | _named(wanted, _FRAME)
        session.exec(delete(Point).where(col(Point.id).in_([int(key) for key in _named(there, _POINT)])))
        points = _named(wanted, _POINT).items()
        session.add_all(Point(id=int(key), object_id=item.id or 0, **point) for key, point in points)
    else:
        kept = {key: value for key, value in override_data(session, item).items() if key not in _named(there, _CORRECTION)}
        set_override(session, item, kept | _named(wanted, _CORRECTION))
        gone = col(Verdict.candidate).in_(list(_named(there, _VERDICT)))
        session.exec(delete(Verdict).where(col(Verdict.object_id) == item.id, gone))
        said = _named(wanted, _VERDICT).items()
        session.add_all(Verdict(object_id=item.id or 0, candidate=candidate, **verdict) for candidate, verdict in said)
    session.flush()


def _record(
    session: Session,
    item: SceneObject,
    scope: Scope,
    action: str,
    text: str,
    *,
    who: str,
    frame: int | None,
    state: State | None = None,
) -> Event:
    """Record an event, and update the object's version and keys, and the project's key.

    `state` is the object's state in that scope, if it was just read.
    """
    project = session.get_one(Project, item.project_id)
    require_open(project)
    read = state if state is not None else snapshot(session, item, scope)
    clicks = _clicks_in(read) if scope == "prompts" else clicks_of(session, item.id)
    override = _named(read, _CORRECTION) if scope == "review" else override_data(session, item)
    item.version += 1  # after the queries, which flush pending changes: each row is written once
    note_object(session, item, project.segmenter, clicks, override)
    note_project(session, project)
    now = project.updated = time.time()
    event = Event(project_id=item.project_id, object_id=item.id, scope=scope, action=action, text=text, who=who, at=now)
    event.frame = frame
    session.add(event)
    return event


def _without(state: State, other: State) -> State:
    """The entries of a state that the other lacks or that differ there."""
    return {key: value for key, value in state.items() if key not in other or other[key] != value}


def _clicks_in(state: State) -> list[Click]:
    """The clicks in a state, as `clicks_of`."""
    return [Click(id=int(number), **click) for number, click in _named(state, _POINT).items()]


def _named(state: State, kind: str) -> State:
    """The state's entries with a key prefix, keyed by the rest."""
    return {key.removeprefix(kind): value for key, value in state.items() if key.startswith(kind)}


def _standing(item: SceneObject, scope: Scope, standing: str) -> Any:
    mine = (Event.project_id == item.project_id, Event.object_id == item.id, Event.scope == scope)
    return select(Event).where(*mine, Event.standing == standing)


def _forget_undone(session: Session, item: SceneObject, scope: Scope) -> None:
    """Clear the redo stack after another change."""
    session.execute(_FORGET_UNDONE, {"project": item.project_id, "object": item.id, "of": scope})


_FORGET_UNDONE = (
    update(Event)
    .where(col(Event.project_id) == bindparam("project"), col(Event.object_id) == bindparam("object"))
    .where(col(Event.scope) == bindparam("of"), col(Event.standing) == "undone")
    .values(standing="gone")
)


def _override(session: Session, item: SceneObject) -> Override | None:
    return session.execute(_OVERRIDE, {"object": item.id}).scalars().first()


_OVERRIDE = select(Override).where(col(Override.object_id) == bindparam("object"))


def _refuse_taken_name(session: Session, item: SceneObject, wanted: State) -> None:
    if wanted.get("deleted", item.deleted):
        return
    name = wanted.get("name", item.name)
    others = select(SceneObject.name).where(
        SceneObject.project_id == item.project_id, SceneObject.id != item.id, col(SceneObject.deleted).is_(False)
    )
    if any(other.casefold() == name.casefold() for other in session.exec(others)):
        raise Conflict(f"another object is now called '{name}'", hint="rename that one first")
