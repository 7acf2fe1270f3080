"""Review states (draft → ready → in review → changes requested → approved): transitions, roles and conditions."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.computing import computing_s
from app.db.engine import reading, writing
from app.db.tables import Comment, Event, Project, Verdict
from app.errors import Conflict
from app.services import masks, projects, scenes
from app.services.context import Context

_log = logging.getLogger(__name__)

SCOPE = "state"
NAMED = 6  # joints, in the note about defaults
LEAST_FRAMES = 3  # with fewer views, an object's shape is undetermined

Check = Callable[[Context, Session, Project], list[str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition:
    """One permitted transition."""

    text: str
    role: Literal["annotator", "reviewer"]
    check: Check | None = None
    notes: Callable[[Context, Project], list[str]] | None = None
    says_why: bool = False


def status(context: Context, project_id: str) -> schemas.ReviewStatus:
    """The project's review state and possible transitions."""
    with reading(context.engine) as session:
        return _status(context, session, queries.project_row(session, project_id))


def step(context: Context, project_id: str, body: schemas.ReviewStep) -> schemas.ReviewStatus:
    """Make a transition, if permitted; unmet conditions, and refusals, need a written reason."""
    reason = body.reason
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        if project.review_state != body.from_state:
            current = _status(context, session, project).model_dump()
            raise Conflict(f"{project.name} is {project.review_state} by now", hint="look again", current=current)
        transition = TRANSITIONS.get((body.from_state, body.to))
        if transition is None:
            legal = ", ".join(to for came, to in TRANSITIONS if came == body.from_state)
            raise Conflict(f"a project that is {body.from_state} cannot become {body.to}", hint=f"it can become: {legal}")
        context.require(transition.role)
        unmet = transition.check(context, session, project) if transition.check else []
        if unmet and not reason:
            raise Conflict(f"not {body.to} yet: {'; '.join(unmet)}", hint="correct that, or give a reason")
        if transition.says_why and not reason:
            raise Conflict(f"no reason is given why it should be {body.to}", hint="write what has to change")
        _record(context, session, project, body.to, reason, unmet)
    projects.tell(context, project_id)
    context.hub.publish("review", project_id, object=None)
    return status(context, project_id)


def figures(context: Context, project_id: str) -> schemas.Figures:
    """Effort spent on the project so far."""
    with reading(context.engine) as session:
        return _figures(session, queries.project_row(session, project_id))


def _ready_to_review(context: Context, session: Session, project: Project) -> list[str]:
    """Unmet conditions for review: every object has prompts and is seen in a few frames."""
    items = queries.live_objects(session, project.id)
    if not items:
        return ["no object was clicked yet"]
    unclicked, unseen = [], []
    for item in items:
        frames = masks.state_of(context, project, item).frames
        if not item.masks_key:
            unclicked.append(item.name)
        elif frames < LEAST_FRAMES:
            unseen.append(f"{item.name} ({frames})")
    said = [f"without a click: {', '.join(unclicked)}"] if unclicked else []
    return said + ([f"seen in fewer than {LEAST_FRAMES} frames: {', '.join(unseen)}"] if unseen else [])


def _approvable(context: Context, session: Session, project: Project) -> list[str]:
    """Unmet conditions for approval: a current, passed bundle, a verdict on every object, no open comments."""
    bundle = queries.newest_bundle(session, project.id)
    if bundle is None:
        return ["there is no bundle"]
    unmet = []
    if bundle.inputs != project.inputs:
        unmet.append("something was changed since the bundle was made")
    if not (bundle.certificate or {}).get("passed"):
        unmet.append("the certificate did not pass")
    items = queries.live_objects(session, project.id)
    accepted = select(Verdict.object_id).where(
        Verdict.verdict == "accepted", col(Verdict.object_id).in_([item.id for item in items])
    )
    left = len(items) - len(set(session.exec(accepted)))
    if left:
        unmet.append(f"{left} of {len(items)} objects not accepted")
    open_comments = select(func.count()).where(Comment.project_id == project.id, col(Comment.resolved_at).is_(None))
    count = session.exec(open_comments).one()
    return unmet + ([f"{count} open comment{'s' if count > 1 else ''}"] if count else [])


def _by_default(context: Context, project: Project) -> list[str]:
    """Joints of the newest scene with default values not derived from the recording."""
    scene = scenes.fitted(context.files(project))
    joints = [joint for item in scene["objects"] for joint in item["joints"]] if scene else []
    guessed = [joint["name"] for joint in joints if "default" in scenes.sources_of(joint).values()]
    if not guessed:
        return []
    more = f" and {len(guessed) - NAMED} more" if len(guessed) > NAMED else ""
    return [f"{len(guessed)} of {len(joints)} joints hold a default: {', '.join(guessed[:NAMED])}{more}"]


TRANSITIONS: dict[tuple[str, str], Transition] = {
    ("draft", "ready"): Transition(text="Send to review", role="annotator", check=_ready_to_review),
    ("ready", "draft"): Transition(text="Take back", role="annotator"),
    ("ready", "in review"): Transition(text="Start the review", role="reviewer"),
    ("in review", "changes requested"): Transition(text="Request changes", role="reviewer", says_why=True),
    ("in review", "approved"): Transition(text="Approve", role="reviewer", check=_approvable, notes=_by_default),
    ("changes requested", "ready"): Transition(text="Send to review again", role="annotator", check=_ready_to_review),
    ("approved", "changes requested"): Transition(text="Reopen", role="reviewer", says_why=True),
}


def _status(context: Context, session: Session, project: Project) -> schemas.ReviewStatus:
    query = select(Event).where(Event.project_id == project.id, Event.scope == SCOPE).order_by(col(Event.id).desc())
    last = session.exec(query).first()
    moves = [
        schemas.ReviewMove(
            to=to,  # type: ignore[arg-type]  # the table has no other values
            text=transition.text,
            role=transition.role,
            unmet=transition.check(context, session, project) if transition.check else [],
            notes=transition.notes(context, project) if transition.notes else [],
            needs_reason=transition.says_why,
        )
        for (came, to), transition in TRANSITIONS.items()
        if came == project.review_state
    ]
    return schemas.ReviewStatus(
        state=project.review_state,  # type: ignore[arg-type]  # the column has no other values
        who=last.who if last else "",
        at=last.at if last else None,
        reason=str((last.after or {}).get("reason", "")) if last else "",
        moves=moves,
    )


def _record(context: Context, session: Session, project: Project, to: str, reason: str, unmet: list[str]) -> None:
    now = time.time()
    text = f"{project.review_state} → {to}" + (f": {reason}" if reason else "")
    event = Event(project_id=project.id, scope=SCOPE, action=to, text=text, who=context.who, at=now)
    event.before = {"review_state": project.review_state}
    event.after = {"review_state": to, "reason": reason, "unmet": unmet}
    project.review_state, project.updated = to, now
    session.add_all([project, event])
    session.flush()
    if to == "approved":
        cost = _figures(session, project)
        event.after = {**event.after, "figures": cost.model_dump()}
        session.add(event)
        per_object = f"{cost.clicks_per_object:.2f}" if cost.clicks_per_object is not None else "no"
        _log.warning("%s approved %.0f s after upload, %s clicks an object", project.id, now - project.created, per_object)


def _figures(session: Session, project: Project) -> schemas.Figures:
    items = queries.live_objects(session, project.id)
    clicks = _events(session, project.id, "prompts", without=("import", "assign", "lock"))
    clicks += _events(session, project.id, "proposals", without=("restore",))
    accepted = select(Verdict.object_id).where(
        col(Verdict.object_id).in_([item.id for item in items]), Verdict.verdict == "accepted"
    )
    said = set(session.exec(accepted))
    corrected = queries.overrides_by_object(session, project.id)
    named = [bool(corrected.get(item.id or 0, {}).get("candidate")) for item in items if item.id in said]
    approved = session.exec(
        select(func.min(Event.at)).where(Event.project_id == project.id, Event.scope == SCOPE, Event.action == "approved")
    ).one()
    return schemas.Figures(
        objects=len(items),
        clicks=clicks,
        clicks_per_object=clicks / len(items) if items else None,
        verdicts=_events(session, project.id, "review"),
        automatic_kept=named.count(False) / len(named) if named else None,
        upload_to_approval_s=approved - project.created if approved is not None else None,
        computing_s=computing_s(session, project.id, time.time()),
        age_s=time.time() - project.created,
    )


def _events(session: Session, project_id: str, scope: str, without: tuple[str, ...] = ()) -> int:
    query = select(func.count()).where(Event.project_id == project_id, Event.scope == scope, col(Event.action).not_in(without))
    return session.exec(query).one()
