"""Control messages between servers that share a database: access changes and shutdowns."""

from typing import Any

from app.db.channel import Channel
from app.services.context import Context


def sees_changed(context: Context) -> None:
    """Reload access rights at every server."""
    context.access.look_again()
    context.hub.carry("sees", {})


def shut(context: Context, project_id: str) -> None:
    """Stop the project's live segmenter and 3D views at every server."""
    _shut(context, project_id)
    context.hub.carry("shut", {"project": project_id})


def stop_segmenting(context: Context, project_id: str) -> None:
    """Stop the project's live segmenter at every server."""
    context.live.close(project_id)
    context.hub.carry("stop-segmenting", {"project": project_id})


def show_out(context: Context, project_id: str, why: str) -> None:
    """Close pages and 3D views of users who may not see the project any more, at every server."""
    _show_out(context, project_id, why)
    context.hub.carry("show-out", {"project": project_id, "why": why})


def hear_others(context: Context, channel: Channel) -> None:
    """Handle these messages from other servers."""

    def look_again(_sender: str, _said: dict[str, Any]) -> None:
        context.access.look_again()
        context.people.look_again()

    channel.hears |= {
        "sees": look_again,
        "shut": lambda _, said: _shut(context, said["project"]),
        "stop-segmenting": lambda _, said: context.live.close(said["project"]),
        "show-out": lambda _, said: _show_out(context, said["project"], said["why"]),
    }


def _shut(context: Context, project_id: str) -> None:
    context.live.close(project_id)
    context.viewer.close(project_id)


def _show_out(context: Context, project_id: str, why: str) -> None:
    context.viewer.close(project_id, lambda session: not _sees(context, session, project_id))
    context.hub.show_out(project_id, why)


def _sees(context: Context, session_id: str, project_id: str) -> bool:
    person = context.people.look_up(session_id)
    return person is not None and context.access.sees(person, project_id)
