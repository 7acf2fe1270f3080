"""Honeypots: sample kitchens inserted into a user's queue, scored against ground truth. Admins only."""

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import Project
from app.errors import Conflict, NotFound
from app.jobs.mask_wire import mask_bits
from app.services import accounts, audit, copies, opinions
from app.services.context import Context
from app.services.overlap import Bits, Overlaps, spread
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX, read_mask
from r2c2r_core.geometry.masks import pack_mask

MOST_FRAMES = 30  # each has a mask image per object
FOUND_IOU = 0.5
TRUTH, MASKS = "truth.json", "truth_masks"
SOURCE_NAME = "scan.r3d"  # like an uploaded recording


def listed(context: Context) -> list[schemas.Honeypot]:
    """All honeypots, newest first."""
    with reading(context.engine) as session:
        of = select(Project).where(col(Project.honeypot).is_(True), col(Project.trashed).is_(None))
        return [_shape(session, row) for row in session.exec(of.order_by(col(Project.created).desc(), col(Project.id)))]


def slip(context: Context, project_id: str, body: schemas.HoneypotIn) -> schemas.Honeypot:
    """Create a project from a sample kitchen's recording, assigned to a user without access to its ground truth."""
    context.store.fetch(project_id, recording=True)
    with reading(context.engine) as session:
        sample = queries.project_row(session, project_id)
        if not (context.files(sample).source / TRUTH).is_file():
            raise Conflict(f"the truth of {sample.name} is not known", hint="choose a sample kitchen")
        person = accounts.row(session, body.person.lower())

    def mark(session: Session, row: Project) -> None:
        row.source_name, row.honeypot, row.tags = SOURCE_NAME, True, []
        row.assignee_id, row.members_only = person.id, False  # visible to all users of the sample
        session.add(row)
        audit.note(session, "honeypot", account=person.name, who=context.who, detail=body.name)

    made = copies.duplicate(context, project_id, recording_only=True, name=body.name, file_name=SOURCE_NAME, mark=mark)
    with reading(context.engine) as session:
        return _shape(session, queries.project_row(session, made.id))


def score(context: Context, project_id: str) -> schemas.HoneypotScore:
    """The user's current score; it reads many pictures, so call it behind the gate of looks."""
    context.store.fetch(project_id, recording=True)
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        if not project.honeypot:
            raise NotFound(f"{project.name} is no honeypot", hint="put a sample kitchen into somebody's queue first")
        side = opinions.side(context, session, project)
        folder = context.files(project).source
    overlaps, drawn = Overlaps(), set[Hashable]()
    seen = set[Hashable]()
    for frame in spread(_frames(folder), MOST_FRAMES):
        truth, made = _truth_on(folder, frame, context.settings.preview_width), side.on(frame)
        overlaps.add(truth, made)
        seen |= truth.keys()
        drawn |= made.keys()
    pairs = {pair.first: pair for pair in overlaps.matched(FOUND_IOU)}
    objects = []
    for entry in json.loads((folder / TRUTH).read_bytes())["objects"]:
        if entry["name"] in seen:
            pair = pairs.get(entry["name"])
            made_of = side.objects[pair.second] if pair else None
            objects.append(_true(entry, made_of, pair.iou if pair else None))
    return schemas.HoneypotScore(
        found=len(pairs),
        extra=len(drawn) - len(pairs),
        mean_iou=sum(pair.iou for pair in pairs.values()) / len(pairs) if pairs else None,
        same_category=sum(bool(one.same_category) for one in objects),
        objects=objects,
    )


def _true(entry: dict[str, Any], made: schemas.AgreedObject | None, iou: float | None) -> schemas.TrueObject:
    return schemas.TrueObject(
        name=entry["name"],
        category=entry["category"],
        object=made.object if made else None,
        iou=iou,
        same_category=opinions.same_category(entry["category"], made.category) if made else None,
    )


def _frames(folder: Path) -> set[int]:
    return {int(path.stem) for path in (folder / MASKS).glob("*/*.png")}


def _truth_on(folder: Path, frame: int, width: int) -> dict[Hashable, Bits]:
    """Ground-truth masks of a frame, by object, without those too small to be required."""
    found = {path.parent.name: read_mask(path) for path in (folder / MASKS).glob(f"*/{frame:06d}.png")}
    large = {name: mask for name, mask in found.items() if np.count_nonzero(mask) >= MIN_TRUTH_PX}
    return {name: mask_bits(pack_mask(mask), width) for name, mask in large.items()}


def _shape(session: Session, row: Project) -> schemas.Honeypot:
    return schemas.Honeypot(
        project=row.id,
        name=row.name,
        person=queries.account_name(session, row.assignee_id),
        review_state=row.review_state,  # type: ignore[arg-type]  # the column has no other values
        made=row.created,
    )
