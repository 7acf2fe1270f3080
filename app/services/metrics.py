"""Prometheus metrics of this server, and of the state shared by all servers."""

from collections.abc import Iterator

import psutil
from sqlmodel import col, func, select

from app.db.engine import reading
from app.db.tables import Job, Project
from app.files import free_bytes
from app.metrics import gauge
from app.services.context import Context
from r2c2r_core import __version__

_OPEN = ("queued", "running", "cancelling")


def exposed(context: Context) -> str:
    """All metrics in the text format; raises Forbidden except for an admin, or a token with the metrics scope."""
    if context.person.scope != "metrics":
        context.require("admin")
    counted = context.metrics
    return "\n".join([*counted.requests.lines(), *counted.stages.lines(), *_states(context), *_machine(context)]) + "\n"


def _states(context: Context) -> Iterator[str]:
    """Gauges of the database, equal at all servers that share it."""
    with reading(context.engine) as session:
        rows = session.exec(select(Job.state, func.count()).where(col(Job.state).in_(_OPEN)).group_by(Job.state))
        jobs = dict(rows.all())
        projects, size = session.exec(select(func.count(), func.coalesce(func.sum(Project.size_bytes), 0))).one()
    yield from gauge("r2c2r_jobs", "Jobs that are not ended", (((("state", s),), jobs.get(s, 0)) for s in _OPEN))
    yield from gauge("r2c2r_projects", "Projects", [((), projects)])
    yield from gauge("r2c2r_project_bytes", "Bytes of all projects, as last measured", [((), float(size))])


def _machine(context: Context) -> Iterator[str]:
    """Gauges of this server."""
    settings, memory = context.settings, psutil.Process().memory_info()
    yield from gauge("r2c2r_build_info", "The version that runs", [((("version", __version__),), 1)])
    seats = settings.heavy_jobs if settings.run_jobs else 0
    yield from gauge("r2c2r_seats", "Heavy jobs that may run here at a time", [((), seats)])
    yield from gauge("r2c2r_seats_busy", "Heavy jobs that run here", [((), context.runner.busy)])
    yield from gauge("r2c2r_live_segmenters", "Projects that are segmented live here", [((), context.live.running)])
    yield from gauge("r2c2r_tabs", "Connected browser tabs", [((), context.hub.tabs)])
    yield from gauge("r2c2r_free_bytes", "Free on the disk of the data folder", [((), free_bytes(settings.data_dir))])
    yield from gauge("process_resident_memory_bytes", "Resident memory of the server", [((), memory.rss)])
