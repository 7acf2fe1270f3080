"""`r2c2r work`: a machine that computes jobs from a shared database without serving."""

import contextlib
import logging
import signal
import sys
import threading
from pathlib import Path

from sqlalchemy import make_url

from app.db import postgres
from app.db.channel import Channel, join_hubs
from app.db.engine import opened
from app.files import only_server
from app.hub import Hub
from app.jobs.far import LiveSeat
from app.jobs.outcomes import FINISHERS, job_ended
from app.jobs.plans import Commands, commands_of
from app.jobs.rows import JobRows
from app.jobs.runner import Runner
from app.logs import log_as
from app.metrics import Metrics
from app.settings import DATABASE, Settings
from app.store.opening import open_store
from app.store.usable import require_store
from app.traces import open_traces
from r2c2r_core.disk import keep_private, resolved
from r2c2r_core.errors import EnvironmentProblem, R2C2RError

_log = logging.getLogger(__name__)
TIDY_S = 5.0


def work(*, data_dir: Path, heavy_jobs: int = 1, workers: int = 0, live: bool = False) -> None:
    """Take jobs until stopped, or drained and done; raises EnvironmentProblem where the database is a file.

    With `live` it also computes live masks for servers.
    """
    settings = Settings(data_dir=resolved(data_dir), heavy_jobs=heavy_jobs, workers=workers)
    if not settings.postgres:
        hint = "R2C2R_DATABASE=postgresql+psycopg://USER@HOST/NAME, as for r2c2r serve; r2c2r db move copies the rows there"
        raise EnvironmentProblem("the database is in a file (SQLite), which only one machine can use", hint=hint)
    if settings.log:
        log_as(settings.log)
    require_store(settings)
    keep_private(settings.data_dir, DATABASE)
    stopping = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopping.set())
    # a cache belongs to one process; without a store all machines share the folder, where files are written atomically
    with only_server(settings.data_dir) if settings.store else contextlib.nullcontext():
        run_jobs(settings, commands_of(settings), stopping, live=live)


def run_jobs(settings: Settings, commands: Commands, stopping: threading.Event, *, live: bool = False) -> None:
    """Take jobs until `stopping` is set, or the seat is drained and done."""
    with opened(settings.rows) as engine:
        store = open_store(settings)
        hub, traces = Hub(), open_traces(settings.traces)
        rows = JobRows(engine, hub, settings, store, FINISHERS, job_ended)
        runner = Runner(rows, settings, commands, Metrics().stages, traces)
        channel = Channel(engine, rows.owner, settings.beat_s)
        join_hubs(channel, hub)
        segmenters = LiveSeat(channel, store, settings, commands) if live else None
        runner.start()
        channel.start()
        of = postgres.shown(make_url(settings.postgres))
        sys.stdout.write(f"r2c2r: seat {rows.owner} takes jobs of {of}, {settings.heavy_jobs} at a time\n")
        sys.stdout.flush()
        try:
            while not stopping.wait(min(TIDY_S, settings.beat_s)) and not (runner.draining and not runner.projects):
                try:
                    store.tidy(runner.projects | (segmenters.projects if segmenters else frozenset()))
                except R2C2RError as error:  # the store is unavailable: try again
                    _log.warning("tidying: %s", error)
                except Exception:  # a seat must not stop because its cache could not be tidied
                    _log.exception("tidying")
        finally:
            runner.stop()
            if segmenters is not None:
                segmenters.stop()
            channel.stop()
