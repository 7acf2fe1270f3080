"""Second opinions: independently annotated copies of a recording, and their agreement."""

import time
from collections import Counter
from collections.abc import Hashable
from typing import Any, NamedTuple

from sqlalchemy import or_
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import Event, Project
from app.errors import NotFound
from app.jobs.mask_store import Masks
from app.services import accounts, assigning, copies, masks, project_shapes, spreadsheets
from app.services.context import Context
from app.services.overlap import Overlaps, Pair, spread

MOST_FRAMES = 200  # spread over the recording
LONGEST_TITLE = 120
LEAST_IOU = 0.1  # minimum overlap of two annotations of one object
_HEAD = ["first object", "first category", "second object", "second category", "mask IoU", "frames of both", "same category"]


def listed(context: Context, project_id: str) -> list[schemas.Opinion]:
    """Other projects related to this one as second opinions, oldest first."""
    with reading(context.engine) as session:
        rows = _others(context, session, queries.project_row(session, project_id))
        return [_shape(session, row) for row in rows]


def ask(context: Context, project_id: str, body: schemas.OpinionIn) -> schemas.Project:
    """Create a copy of the recording without user input, assigned to a user."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        root, title = project.opinion_of or project.id, project.name
        name = assigning.require_name(context, session, project_id, body.name) if body.name else None
    called = f"{title} ({f'opinion of {name}' if name else 'second opinion'})"[:LONGEST_TITLE]

    def mark(session: Session, row: Project) -> None:
        row.opinion_of = root
        row.assignee_id = accounts.row(session, name).id if name else None
        text = f"made as a second opinion of {title}" + (f", assigned to {name}" if name else "")
        event = Event(project_id=row.id, scope="project", action="opinion", text=text, who=context.who, at=time.time())
        row.updated = event.at
        session.add_all([row, event])

    return copies.duplicate(context, project_id, recording_only=True, name=called, mark=mark)


def agreement(context: Context, project_id: str, other_id: str) -> schemas.Agreement:
    """Agreement of two annotations of one recording; it reads all masks, so call it behind the gate of looks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        others = {row.id: row for row in _others(context, session, project)}
        if other_id not in others:
            raise NotFound("that is no second opinion of this project", hint="choose one of the overview")
        sides = [side(context, session, row) for row in (project, others[other_id])]
        shown = [_shape(session, row) for row in (project, others[other_id])]
    first, second = sides
    frames = spread(first.frames | second.frames, MOST_FRAMES)
    overlaps, seen = Overlaps(), (Counter[Hashable](), Counter[Hashable]())
    for frame in frames:
        on_frame = first.on(frame), second.on(frame)
        overlaps.add(*on_frame)
        for counter, there in zip(seen, on_frame, strict=True):
            counter.update(there.keys())
    return _agreement(shown, sides, seen, overlaps.matched(LEAST_IOU), len(frames))


def table(context: Context, project_id: str, other_id: str) -> str:
    """The same as CSV, one line per object."""
    found = agreement(context, project_id, other_id)
    rows = []
    for line in found.objects:
        named = [said for one in (line.first, line.second) for said in ((one.name, one.category) if one else ("", ""))]
        iou = "" if line.iou is None else f"{line.iou:.3f}"
        alike = "" if line.same_category is None else "yes" if line.same_category else "no"
        rows.append([*named, iou, str(line.frames), alike])
    return spreadsheets.written(_HEAD, rows)


class Side(NamedTuple):
    """One of two compared projects: objects with available masks."""

    objects: dict[Hashable, schemas.AgreedObject]
    masks: dict[Hashable, Masks]

    @property
    def frames(self) -> set[int]:
        """Frames in which any object has a mask."""
        return {int(frame) for found in self.masks.values() for frame in found.seen()[:, 0]}

    def on(self, frame: int) -> dict[Hashable, dict[str, Any]]:
        """Masks of one frame, by object."""
        entries = ((number, found.entry(frame)) for number, found in self.masks.items())
        return {number: entry["mask"] for number, entry in entries if entry is not None}


def side(context: Context, session: Session, project: Project) -> Side:
    """A project as one side of a comparison."""
    items = {item.id: item for item in queries.live_objects(session, project.id)}
    places = masks.Places.of(context.files(project))
    found = {number: masks.found_of(context, project, item, places) for number, item in items.items()}
    return Side(
        {
            number: schemas.AgreedObject(object=number or 0, name=item.name, category=item.category, frames=0)
            for number, item in items.items()
        },
        {number: one.masks for number, one in found.items() if one is not None and len(one.masks)},
    )


def _agreement(
    shown: list[schemas.Opinion],
    sides: list[Side],
    seen: tuple[Counter[Hashable], Counter[Hashable]],
    pairs: list[Pair],
    frames: int,
) -> schemas.Agreement:
    objects = [
        {number: one.model_copy(update={"frames": counted[number]}) for number, one in side.objects.items()}
        for side, counted in zip(sides, seen, strict=True)
    ]
    both = [_agreed(objects[0][pair.first], objects[1][pair.second], pair) for pair in reversed(pairs)]
    taken = {pair.first for pair in pairs}, {pair.second for pair in pairs}
    alone = [
        [one for number, one in side.items() if number not in matched and number in counted]
        for side, matched, counted in zip(objects, taken, seen, strict=True)
    ]
    only = [_agreed(one, None, None) for one in alone[0]] + [_agreed(None, one, None) for one in alone[1]]
    return schemas.Agreement(
        first=shown[0],
        second=shown[1],
        frames=frames,
        both=len(pairs),
        only_first=len(alone[0]),
        only_second=len(alone[1]),
        mean_iou=sum(pair.iou for pair in pairs) / len(pairs) if pairs else None,
        same_category=sum(bool(line.same_category) for line in both),
        objects=[*only, *both],
        unmasked=[one for side, counted in zip(objects, seen, strict=True) for n, one in side.items() if n not in counted],
    )


def _agreed(first: schemas.AgreedObject | None, second: schemas.AgreedObject | None, pair: Pair | None) -> schemas.Agreed:
    same = same_category(first.category, second.category) if first and second else None
    iou, frames = (pair.iou, pair.frames) if pair else (None, 0)
    return schemas.Agreed(first=first, second=second, iou=iou, frames=frames, same_category=same)


def same_category(first: str, second: str) -> bool:
    """Whether two words name the same category."""
    return _meant(first) == _meant(second)


def _meant(category: str) -> str:
    """The category named by a word; an unknown word is its own category."""
    from r2c2r_core.kitchen.names import named

    found = named(category)
    return category.casefold() if found.notice else found.category.name


def _others(context: Context, session: Session, project: Project) -> list[Project]:
    root = project.opinion_of or project.id
    of_recording = or_(col(Project.id) == root, col(Project.opinion_of) == root)
    hidden = context.access.hidden(context.person)
    shown = select(Project).where(of_recording, Project.id != project.id, col(Project.id).not_in(hidden))
    return list(session.exec(shown.order_by(col(Project.created), col(Project.id))))


def _shape(session: Session, row: Project) -> schemas.Opinion:
    return schemas.Opinion(
        project=row.id,
        name=row.name,
        assignee=queries.account_name(session, row.assignee_id),
        review_state=row.review_state,  # type: ignore[arg-type]  # the column has no other values
        objects=project_shapes.counts_of(session, row.id).objects,
        updated=row.updated,
    )
