"""Effort per object and user: clicks, verdicts, corrections, comments and minutes, from the event history."""

from dataclasses import dataclass

from sqlmodel import col, select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import Event
from app.services import honeypots, spreadsheets
from app.services.context import Context

IDLE_S = 120.0  # a longer pause between changes does not count as work
_HEAD = ["project", "person", "object", "category", "clicks", "verdicts and corrections", "comments", "minutes"]
_TRUTH = ["true object", "mask IoU", "same category"]  # of a honeypot
_COUNTED = {"prompts": "clicks", "proposals": "clicks", "review": "verdicts", "comments": "comments"}
_NO_CLICKS = {"prompts/import", "prompts/assign", "prompts/lock", "proposals/restore"}  # actions without clicks


@dataclass(slots=True)
class _Cost:
    clicks: int = 0
    verdicts: int = 0
    comments: int = 0
    seconds: float = 0.0


def table(context: Context, project_id: str) -> str:
    """CSV with a line per user and object; project-level effort has an empty name."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = {item.id: item for item in queries.live_objects(session, project_id, deleted=True)}
        done = col(Event.scope) + "/" + col(Event.action)  # select() types four columns at most
        told = select(Event.who, Event.object_id, done, Event.at).where(Event.project_id == project_id)
        events = session.exec(told.order_by(col(Event.at), col(Event.id))).all()
    costs: dict[tuple[str, int | None], _Cost] = {}
    last: dict[str, float] = {}
    for who, number, what, at in events:
        cost = costs.setdefault((who, number), _Cost())
        kind = None if what in _NO_CLICKS else _COUNTED.get(what.partition("/")[0])
        if kind:
            setattr(cost, kind, getattr(cost, kind) + 1)
        since = at - last.get(who, at)
        cost.seconds += since if since <= IDLE_S else 0.0
        last[who] = at
    truth = honeypots.score(context, project_id).objects if project.honeypot and context.person.may("admin") else []
    true_of: dict[int | None, schemas.TrueObject] = {one.object: one for one in truth if one.object is not None}
    rows = []
    for (who, number), cost in sorted(costs.items(), key=lambda one: (one[0][0], one[0][1] or 0)):
        item = items.get(number)
        figures = [str(cost.clicks), str(cost.verdicts), str(cost.comments), f"{cost.seconds / 60:.1f}"]
        rows.append([project.name, who, item.name if item else "", item.category if item else "", *figures])
        rows[-1] += _really(true_of.get(number)) if truth else []
    rows += [[project.name, "", "", "", "", "", "", "", *_really(one)] for one in truth if one.object is None]
    return spreadsheets.written([*_HEAD, *_TRUTH] if truth else _HEAD, rows)


def _really(one: schemas.TrueObject | None) -> list[str]:
    """Ground-truth columns of a honeypot's object; empty for others."""
    if one is None:
        return ["", "", ""]
    same = "" if one.same_category is None else "yes" if one.same_category else "no"
    return [one.name, "" if one.iou is None else f"{one.iou:.3f}", same]
