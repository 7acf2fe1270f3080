"""Proposed objects: confirmed ones become ordinary objects, dismissals are stored as events."""

import time
from dataclasses import dataclass
from typing import Any, Literal

from sqlmodel import Session, col, func, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Event
from app.errors import NotFound
from app.jobs.mask_wire import bits_mask
from app.jobs.proposal_wire import read_proposals
from app.services import masks, prompts
from app.services.context import Context
from r2c2r_core.segment.contradictions import Params
from r2c2r_core.segment.proposals.propose import covered_share, is_taken
from r2c2r_core.tuning import tuned

_SCOPE = "proposals"


def current(context: Context, project_id: str) -> schemas.Proposals:
    """The current proposals."""
    found = _look(context, project_id)
    left = _without_covered(context, project_id, found)
    return schemas.Proposals(
        state=found.state,
        fraction=found.fraction,
        items=[_shape(line) for line in left if line["id"] not in found.dismissed],
        dismissed=sum(line["id"] in found.dismissed for line in left),
    )


def confirm(context: Context, project_id: str, ids: list[str], category: str | None = None) -> list[schemas.SceneObject]:
    """Create objects from proposals, each with its click, and its own or the given category."""
    wanted = _wanted(context, project_id, ids)
    bodies = [
        schemas.ObjectIn(
            category=category or item.category, points=[schemas.PointIn(frame=item.frame, x=item.x, y=item.y, label=1)]
        )
        for item in wanted
    ]
    made = prompts.create_all(context, project_id, bodies, infer=True, what="confirmed proposal")
    _tell(context, project_id)
    return made


def dismiss(context: Context, project_id: str, ids: list[str]) -> schemas.Proposals:
    """Dismiss proposals."""
    wanted = _wanted(context, project_id, ids)
    with writing(context.engine) as session:
        for item in wanted:
            text = f"dismissed a proposed {item.category}, frame {item.frame}"
            session.add(_event(context, project_id, "dismiss", text, item.frame, {"proposal": item.id}))
    _tell(context, project_id)
    return current(context, project_id)


def restore(context: Context, project_id: str) -> schemas.Proposals:
    """Restore all dismissed proposals."""
    with writing(context.engine) as session:
        queries.project_row(session, project_id)
        if _dismissed(session, project_id):
            session.add(_event(context, project_id, "restore", "brought dismissed proposals back", None, None))
    _tell(context, project_id)
    return current(context, project_id)


@dataclass(frozen=True, slots=True)
class _Found:
    """The segmenter's proposals without confirmed ones."""

    state: Literal["none", "running", "done"]
    fraction: float
    lines: list[dict[str, Any]]
    dismissed: set[str]
    names: dict[int | None, str]  # of the project's objects


def _look(context: Context, project_id: str) -> _Found:
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        dismissed = _dismissed(session, project_id)
        there, by_object = queries.live_objects(session, project_id), queries.clicks_by_object(session, project_id)
    clicks = {(c.frame, c.x, c.y) for item in there for c in by_object.get(item.id or 0, []) if c.label}
    at_work = context.live.proposing(project_id)
    fraction, lines = at_work or read_proposals(context.files(project).proposals)
    left = [line for line in lines if (line["frame"], line["x"], line["y"]) not in clicks]
    names = {item.id: item.name for item in there}
    return _Found("running" if at_work is not None else "done" if fraction >= 1.0 else "none", fraction, left, dismissed, names)


def _wanted(context: Context, project_id: str, ids: list[str]) -> list[schemas.Proposal]:
    """The proposals with these ids; raises NotFound for one that is no longer open."""
    found = _look(context, project_id)
    items = {line["id"]: _shape(line) for line in found.lines if line["id"] not in found.dismissed}
    for proposal in ids:
        if proposal not in items:
            raise NotFound(f"no proposal {proposal}", hint="it may have been confirmed or dismissed in the meantime")
    return [items[proposal] for proposal in dict.fromkeys(ids)]


def _event(context: Context, project_id: str, action: str, text: str, frame: int | None, after: dict[str, Any] | None) -> Event:
    event = Event(project_id=project_id, scope=_SCOPE, action=action, text=text, who=context.who, at=time.time())
    event.frame, event.after = frame, after
    return event


def _dismissed(session: Session, project_id: str) -> set[str]:
    """Ids dismissed since the last restore."""
    mine = (Event.project_id == project_id, Event.scope == _SCOPE)
    restored = select(func.coalesce(func.max(Event.id), 0)).where(*mine, Event.action == "restore").scalar_subquery()
    proposal = col(Event.after)["proposal"].as_string()
    return set(session.exec(select(proposal).where(*mine, Event.action != "restore", col(Event.id) > restored)))


def _without_covered(context: Context, project_id: str, found: _Found) -> list[dict[str, Any]]:
    """The proposals not covered by an object's mask, with a doubt for partly covered ones."""
    shown = masks.on_frames(context, project_id, {line["frame"] for line in found.lines})
    left = []
    for line in found.lines:
        near = {one["object"]: one["mask"] for one in shown[line["frame"]] if _may_cover(one["mask"], line["mask"])}
        outline = bits_mask(line["mask"]) if near else None
        shares = {} if outline is None else {number: covered_share(outline, bits_mask(mask)) for number, mask in near.items()}
        if not any(is_taken(share) for share in shares.values()):
            most = tuned(Params).overlap
            partly = [
                f"shares {100 * share:.0f} % with {found.names.get(number)}" for number, share in shares.items() if share > most
            ]
            left.append({**line, "doubts": [*line.get("doubts", ()), *partly]})  # missing in files of older versions
    return left


def _may_cover(mask: dict[str, Any], outline: dict[str, Any]) -> bool:
    """Whether their bounding boxes overlap, to avoid unpacking most masks."""
    return (
        (mask["width"], mask["height"]) == (outline["width"], outline["height"])
        and mask["left"] < outline["left"] + outline["box_width"]
        and outline["left"] < mask["left"] + mask["box_width"]
        and mask["top"] < outline["top"] + outline["box_height"]
        and outline["top"] < mask["top"] + mask["box_height"]
    )


def _shape(line: dict[str, Any]) -> schemas.Proposal:
    return schemas.Proposal(**{"doubts": [], **{key: value for key, value in line.items() if key != "mask"}})


def _tell(context: Context, project_id: str) -> None:
    at_work = context.live.proposing(project_id)
    context.hub.publish("proposals", project_id, fraction=at_work[0] if at_work else 1.0, changed=True)
