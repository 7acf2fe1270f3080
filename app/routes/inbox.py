"""Collaboration: assignment, inbox and news."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.services import assigning, inbox, news

router = APIRouter(prefix="/api", tags=["people"])


@router.get("/inbox", operation_id="getInbox")
def get_inbox(context: Ctx) -> schemas.Inbox:
    """Your inbox: projects sent back, projects assigned, open comments that name you."""
    return inbox.inbox(context)


@router.get("/projects/{project}/people", operation_id="listNames")
def list_names(context: Ctx, project: str) -> list[str]:
    """Everybody with an account who sees the project: the people to mention in comments or to assign."""
    return assigning.names(context, project)


@router.put("/projects/{project}/assignee", operation_id="assignProject")
def assign_project(context: Ctx, project: str, body: schemas.AssigneeIn) -> schemas.Project:
    """Assign the project to somebody, or to nobody."""
    return assigning.assign(context, project, body)


@router.get("/projects/{project}/news", operation_id="getNews")
def get_news(context: Ctx, project: str) -> schemas.News:
    """Changes by others since your last visit."""
    return news.news(context, project)


@router.put("/projects/{project}/news", operation_id="markSeen")
def mark_seen(context: Ctx, project: str, body: schemas.SeenIn) -> schemas.News:
    """Mark the changes as read up to an event."""
    return news.mark_seen(context, project, body)
