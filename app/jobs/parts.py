"""The table of parts: objects of a stage of a running job, which any seat may compute; each is one's at a time.

A part only brings forward what the stage would compute itself: one that fails, or is never computed, is left to it, and nothing
here has to outlive the database's machine.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Engine
from sqlmodel import Session, col, delete, func, select, update

from app.db.engine import is_shared, now, reading, writing
from app.db.tables import Job, Part, Seat
from app.settings import Settings

TRIES = 2  # of a part whose process vanishes
LOG_KEPT = 64_000  # characters of what a process wrote, the last ones


@dataclass(frozen=True, slots=True, kw_only=True)
class Claimed:
    """Objects that are this process's to compute, by one process of the stage."""

    ids: tuple[int, ...]
    job_id: int
    project_id: str
    stage: str
    names: tuple[str, ...]
    holder: str


class PartRows:
    """Its rows, as of one process: what another does with a part that this one lost is not changed any more."""

    def __init__(self, engine: Engine, owner: str, settings: Settings) -> None:
        self._engine, self._owner, self._settings = engine, owner, settings

    def spare(self) -> int:
        """Seats that have no job of their own."""
        with reading(self._engine) as session:
            return self._spare(session)

    def begin(self, job_id: int, stage: str, names: Collection[str], holder: str, at_least: int) -> None:
        """Offer these objects."""
        with writing(self._engine, lasting=False) as session:
            for name in names:
                part = Part(job_id=job_id, stage=stage, name=name, holder=holder, at_least=at_least, state="waiting")
                session.add(part)

    def claim(self, side_by_side: int, job_id: int | None = None) -> Claimed | None:
        """Take some objects of a job, the oldest unless one is named, as many as keep all seats at it busy to the end.

        `side_by_side`: as many this process computes at once; no seat takes more than its share for that.
        """
        of = select(Part).join(Job).where(Job.state == "running").order_by(col(Part.job_id), col(Part.id))
        if job_id is not None:
            of = of.where(Part.job_id == job_id)
        with reading(self._engine) as session:
            if session.exec(of.where(self._waits(session)).limit(1)).first() is None:
                return None
        with writing(self._engine, lasting=False) as session:
            rows = session.exec(of.where(self._waits(session)).with_for_update(skip_locked=True, of=Part)).all()
            rows = [row for row in rows if row.job_id == rows[0].job_id]
            if not rows:
                return None
            fewest = max(rows[0].at_least, side_by_side)
            rows = rows[: fair_share(len(rows), 1 + max(self._spare(session), 0), fewest)]
            for row in rows:
                row.state, row.owner, row.heartbeat = "running", self._owner, now(session)
                row.attempts += 1
                session.add(row)
            job = session.get_one(Job, rows[0].job_id)
            return Claimed(
                ids=tuple(row.id or 0 for row in rows),
                job_id=job.id or 0,
                project_id=job.project_id,
                stage=rows[0].stage,
                names=tuple(row.name for row in rows),
                holder=rows[0].holder,
            )

    def beat(self, claimed: Claimed) -> bool:
        """Say that this process is at them; whether they are still wanted of it."""
        with writing(self._engine, lasting=False) as session:
            lives = update(Part).where(self._mine(claimed)).values(heartbeat=now(session))
            states = [state for (state,) in session.execute(lives.returning(col(Part.state)))]
            job = session.get(Job, claimed.job_id)
            return states == ["running"] * len(claimed.ids) and job is not None and job.state == "running"

    def done(self, claimed: Claimed, log: str, *, failed: bool) -> None:
        """They were computed; or some can not be, which is then the stage's own to say."""
        self._leave(claimed, log, 0, state="failed" if failed else "done")

    def give_back(self, claimed: Claimed, log: str, *, tried: bool) -> None:
        """Let others compute them."""
        self._leave(claimed, log, 0 if tried else 1, state="waiting")

    def is_open(self, job_id: int) -> bool:
        """Whether some are computed, or are to be, of a job that goes on."""
        of = select(Part.id).join(Job).where(Part.job_id == job_id, Job.state == "running").limit(1)
        with reading(self._engine) as session:
            return session.exec(of.where(self._waits(session) | self._is_at_work(session))).first() is not None

    def counted(self, job_id: int) -> Counter[str]:
        """How many are in each state."""
        with reading(self._engine) as session:
            return Counter(session.exec(select(Part.state).where(Part.job_id == job_id)))

    def take_logs(self, job_id: int) -> list[str]:
        """What their processes wrote, of those that ended since."""
        of = (col(Part.job_id) == job_id, col(Part.log) != "")
        with reading(self._engine) as session:
            if session.exec(select(Part.id).where(*of).limit(1)).first() is None:
                return []
        with writing(self._engine, lasting=False) as session:
            found = {row.id: row.log for row in session.exec(select(Part).where(*of).order_by(col(Part.id)))}
            session.execute(update(Part).where(col(Part.id).in_(found)).values(log=""))
        return list(found.values())

    def end(self, project_id: str) -> bool:
        """Have none of the project's parts any more; False while some are computed, which is to stop."""
        of = col(Part.job_id).in_(select(Job.id).where(Job.project_id == project_id))
        with reading(self._engine) as session:
            if session.exec(select(Part.id).where(of).limit(1)).first() is None:
                return True
        with writing(self._engine, lasting=False) as session:
            at_work = self._is_at_work(session)
            session.execute(delete(Part).where(of, ~func.coalesce(at_work, False)))
            session.execute(update(Part).where(of).values(state="stopping"))
            return session.exec(select(Part.id).where(of).limit(1)).first() is None

    def _leave(self, claimed: Claimed, log: str, untried: int, *, state: str) -> None:
        """What nobody wants any more is forgotten."""
        left = {"state": state, "owner": None, "attempts": col(Part.attempts) - untried}
        with writing(self._engine, lasting=False) as session:
            session.execute(delete(Part).where(self._mine(claimed), col(Part.state) == "stopping"))
            rows = session.execute(update(Part).where(self._mine(claimed)).values(left).returning(col(Part.id)))
            session.execute(update(Part).where(col(Part.id) == min(rows.scalars(), default=0)).values(log=log[-LOG_KEPT:]))

    def _spare(self, session: Session) -> int:
        running = session.exec(select(func.count()).where(col(Job.state).in_(("running", "cancelling")))).one()
        seats = self._settings.heavy_jobs
        if is_shared(self._engine):
            lives = Seat.seen >= now(session) - self._settings.beats_missed_s
            takes = select(func.coalesce(func.sum(Seat.jobs), 0)).where(lives, ~col(Seat.draining))
            seats = session.exec(takes).one()
        return int(seats) - running

    def _waits(self, session: Session) -> ColumnElement[bool]:
        """A part that may be taken, also from who was silent for so long that it is gone."""
        gone = (col(Part.state) == "running") & (col(Part.heartbeat) < self._silent_since(session))
        return ((col(Part.state) == "waiting") | gone) & (col(Part.attempts) < TRIES)

    def _is_at_work(self, session: Session) -> ColumnElement[bool]:
        """A part that somebody computes."""
        return col(Part.state).in_(("running", "stopping")) & (col(Part.heartbeat) >= self._silent_since(session))

    def _silent_since(self, session: Session) -> float:
        return now(session) - self._settings.beats_missed_s

    def _mine(self, claimed: Claimed) -> ColumnElement[bool]:
        return col(Part.id).in_(claimed.ids) & (col(Part.owner) == self._owner)


def fair_share(waiting: int, seats: int, fewest: int) -> int:
    """Half of a seat's share of what waits, so that none is left with much at the end; `fewest` where its share is so many."""
    return min(-(-waiting // seats), max(fewest, -(-waiting // (2 * seats))))
