"""Seats: processes that take jobs from one database, i.e. servers, and `r2c2r work` on compute-only machines."""

import hashlib
import sys
from functools import cache
from pathlib import Path

from sqlalchemy import Engine
from sqlmodel import Session, col, delete, select, update

import app
import r2c2r_core
from app.db.engine import now, reading, writing
from app.db.tables import Seat
from app.settings import Settings
from r2c2r_core.errors import EnvironmentProblem


class OwnSeat:
    """The seat of this process, identified by the owner name of its jobs."""

    def __init__(self, engine: Engine, owner: str, settings: Settings) -> None:
        self._engine, self._owner, self._settings = engine, owner, settings

    def join(self) -> None:
        """Register the seat; raises EnvironmentProblem beside seats of another version, whose results would share keys."""
        with writing(self._engine) as session:
            session.exec(delete(Seat).where(col(Seat.seen) < now(session) - self._settings.beats_missed_s))
            for other in session.exec(select(Seat).where(Seat.version != version())):
                raise EnvironmentProblem(
                    f"this is r2c2r {version()}, and the seat {other.owner} is {other.version}",
                    hint="install the same version on both machines; one that stopped is forgotten after a minute",
                )
            self._add(session)

    def beat(self) -> bool:
        """Send a heartbeat; returns whether the seat is draining."""
        with writing(self._engine, lasting=False) as session:
            lives = update(Seat).where(col(Seat.owner) == self._owner).values(seen=now(session))
            draining = session.execute(lives.returning(col(Seat.draining))).scalar()
            if draining is None:  # it was silent for so long that others removed it
                self._add(session)
        return bool(draining)

    def leave(self) -> None:
        """Remove the seat."""
        with writing(self._engine) as session:
            session.exec(delete(Seat).where(col(Seat.owner) == self._owner))

    def _add(self, session: Session) -> None:
        began = now(session)
        session.add(Seat(owner=self._owner, version=version(), jobs=self._settings.heavy_jobs, began=began, seen=began))


def living(engine: Engine, settings: Settings) -> list[Seat]:
    """All seats with a recent heartbeat, oldest first."""
    with reading(engine) as session:
        since = now(session) - settings.beats_missed_s
        return list(session.exec(select(Seat).where(col(Seat.seen) >= since).order_by(col(Seat.id))))


@cache
def version() -> str:
    """Version, digest of the computing code and Python version; seats with equal values compute the same results."""
    digest = hashlib.sha256()
    for package in (r2c2r_core, app):
        root = Path(package.__file__ or "").parent
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return f"{r2c2r_core.__version__} {digest.hexdigest()[:12]} Python {sys.version_info.major}.{sys.version_info.minor}"
