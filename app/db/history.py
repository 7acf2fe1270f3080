"""Every change is an event with what was before and after it, so anything can be undone, also after a restart.

An object's state has two scopes that are undone apart: `prompts` (name, category, colour, clicks, whether it is there) and
`review` (verdicts, corrections). Undo writes the older state back and is itself an event; nothing is ever removed.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import func
from sqlmodel import Session, col, select

from app.db.tables import Event, Override, Point, Project, SceneObject, Verdict
from app.errors import Conflict

Scope = Literal["prompts", "review"]
State = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Stacks:
    """What can be undone (oldest first) and redone (next last)."""

    done: tuple[Event, ...]
    undone: tuple[Event, ...]


@contextmanager
def change(
    session: Session, item: SceneObject, scope: Scope, action: str, text: str, *, who: str, frame: int | None = None
) -> Iterator[None]:
    """Record what the block does to the object; nothing is recorded when nothing changes."""
    before = snapshot(session, item, scope)
    yield
    session.flush()
    after = snapshot(session, item, scope)
    if after != before:
        _record(session, item, scope, action, text, who=who, frame=frame, before=before, after=after)


def undo(session: Session, item: SceneObject, scope: Scope, *, who: str) -> Event:
    """Take back the object's last change; returns that change. Raises Conflict when there is none."""
    stacks = stacks_of(session, item.project_id, item.id, scope)
    if not stacks.done:
        raise Conflict(f"nothing to undo on {item.name}")
    return _step(session, item, scope, stacks.done[-1], "undo", who)


def redo(session: Session, item: SceneObject, scope: Scope, *, who: str) -> Event:
    """Do again what was undone last; returns that change. Raises Conflict when there is none."""
    stacks = stacks_of(session, item.project_id, item.id, scope)
    if not stacks.undone:
        raise Conflict(f"nothing to redo on {item.name}")
    return _step(session, item, scope, stacks.undone[-1], "redo", who)


def stacks_of(session: Session, project_id: str, object_id: int | None, scope: Scope) -> Stacks:
    """What can be undone and redone on one object, read from its events."""
    return all_stacks(session, project_id, scope, object_id).get(object_id, Stacks((), ()))


def all_stacks(session: Session, project_id: str, scope: Scope, object_id: int | None = None) -> dict[int | None, Stacks]:
    """What can be undone and redone, by object."""
    query = select(Event).where(Event.project_id == project_id, Event.scope == scope)
    if object_id is not None:
        query = query.where(Event.object_id == object_id)
    done: dict[int | None, list[Event]] = {}
    undone: dict[int | None, list[Event]] = {}
    for event in session.exec(query.order_by(col(Event.id))):
        past, future = done.setdefault(event.object_id, []), undone.setdefault(event.object_id, [])
        if event.action == "undo":
            future.append(past.pop())
        elif event.action == "redo":
            past.append(future.pop())
        else:
            past.append(event)
            future.clear()
    return {key: Stacks(tuple(done[key]), tuple(undone[key])) for key in done}


def last_change(session: Session, project_id: str, scope: Scope, direction: Literal["undo", "redo"]) -> int | None:
    """The object that an undo (or redo) of the whole project is about."""
    best: tuple[int, int] | None = None
    for object_id, stacks in all_stacks(session, project_id, scope).items():
        if object_id is None:
            continue
        if direction == "undo" and stacks.done:
            when = stacks.done[-1].id or 0
        elif direction == "redo" and stacks.undone:
            when = _undone_at(session, stacks.undone[-1])
        else:
            continue
        best = max(best, (when, object_id)) if best else (when, object_id)
    return best[1] if best else None


def version_of(session: Session, item: SceneObject, scope: Scope) -> int:
    """A number that grows with every change of the object in this scope; 0 before the first."""
    query = select(func.max(Event.id)).where(
        Event.project_id == item.project_id, Event.object_id == item.id, Event.scope == scope
    )
    return session.exec(query).one() or 0


def snapshot(session: Session, item: SceneObject, scope: Scope) -> State:
    """The object's state in one scope, as JSON."""
    if scope == "prompts":
        points = session.exec(select(Point).where(Point.object_id == item.id).order_by(col(Point.id)))
        return {
            "name": item.name,
            "category": item.category,
            "colour": item.colour,
            "deleted": item.deleted,
            "points": [p.model_dump(exclude={"object_id"}) for p in points],
        }
    override = _override(session, item)
    verdicts = session.exec(select(Verdict).where(Verdict.object_id == item.id).order_by(col(Verdict.candidate)))
    return {
        "override": override.data if override else {},
        "verdicts": [v.model_dump(exclude={"id", "object_id"}) for v in verdicts],
    }


def restore(session: Session, item: SceneObject, scope: Scope, state: State) -> None:
    """Write a snapshot back; ids of clicks stay what they were."""
    if scope == "prompts":
        _refuse_taken_name(session, item, state)
        for name in ("name", "category", "colour", "deleted"):
            setattr(item, name, state[name])
        for point in session.exec(select(Point).where(Point.object_id == item.id)):
            session.delete(point)
        session.flush()
        session.add_all(Point(object_id=item.id or 0, **point) for point in state["points"])
    else:
        set_override(session, item, state["override"])
        for verdict in session.exec(select(Verdict).where(Verdict.object_id == item.id)):
            session.delete(verdict)
        session.flush()
        session.add_all(Verdict(object_id=item.id or 0, **verdict) for verdict in state["verdicts"])
    session.flush()


def require_open(project: Project) -> None:
    """Raise Conflict when the project was approved: what a reviewer signed stays what it was."""
    if project.review_state == "approved":
        raise Conflict(f"{project.name} is approved", hint="a reviewer can reopen it on the review page")


def set_override(session: Session, item: SceneObject, data: dict[str, Any]) -> None:
    """Store what was corrected about the object."""
    found = _override(session, item) or Override(project_id=item.project_id, object_id=item.id)
    found.data = dict(data)
    session.add(found)


def override_data(session: Session, item: SceneObject) -> dict[str, Any]:
    """What was corrected about the object."""
    found = _override(session, item)
    return dict(found.data) if found else {}


def _step(session: Session, item: SceneObject, scope: Scope, target: Event, action: str, who: str) -> Event:
    before = snapshot(session, item, scope)
    restore(session, item, scope, (target.before if action == "undo" else target.after) or {})
    after = snapshot(session, item, scope)
    text = f"{'undid' if action == 'undo' else 'redid'}: {target.text}"
    _record(session, item, scope, action, text, who=who, frame=target.frame, before=before, after=after, target=target.id)
    return target


def _record(
    session: Session,
    item: SceneObject,
    scope: Scope,
    action: str,
    text: str,
    *,
    who: str,
    frame: int | None,
    before: State,
    after: State,
    target: int | None = None,
) -> None:
    project = session.get(Project, item.project_id)
    if project is not None:
        require_open(project)
    now = time.time()
    item.version += 1
    session.add(item)
    event = Event(project_id=item.project_id, object_id=item.id, scope=scope, action=action, text=text, who=who, at=now)
    event.frame, event.before, event.after, event.target = frame, before, after, target
    session.add(event)
    if project is not None:
        project.updated = now
        session.add(project)
    session.flush()


def _override(session: Session, item: SceneObject) -> Override | None:
    return session.exec(select(Override).where(Override.object_id == item.id)).first()


def _undone_at(session: Session, event: Event) -> int:
    """When the change was last undone, as an event number."""
    query = select(Event.id).where(Event.project_id == event.project_id, Event.target == event.id, Event.action == "undo")
    return session.exec(query.order_by(col(Event.id).desc())).first() or 0


def _refuse_taken_name(session: Session, item: SceneObject, state: State) -> None:
    if state["deleted"]:
        return
    others = select(SceneObject).where(
        SceneObject.project_id == item.project_id, SceneObject.id != item.id, col(SceneObject.deleted).is_(False)
    )
    if any(other.name.casefold() == state["name"].casefold() for other in session.exec(others)):
        raise Conflict(f"another object is called '{state['name']}' by now", hint="rename that one first")
