"""Table of parts: objects of a running job's stage that any seat may compute, each claimed by one seat at a time.

A part only precomputes what the stage would compute itself: one that fails, or is never computed, is left to the stage, so
the table need not survive a crash of the database's machine.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Engine
from sqlmodel import Session, col, delete, func, select, update

from app.db.engine import is_shared, now, reading, writing
from app.db.tables import Job, Part, Seat
from app.settings import Settings

TRIES = 2  # for a part whose process vanishes
LOG_KEPT = 64_000  # last characters kept of a process's output


@dataclass(frozen=True, slots=True, kw_only=True)
class Claimed:
    """Objects claimed by this process, to be computed by one process of the stage."""

    ids: tuple[int, ...]
    job_id: int
    project_id: str
    stage: str
    names: tuple[str, ...]
    holder: str


class PartRows:
    """The table as used by one process, which does not change parts that it has lost to another."""

    def __init__(self, engine: Engine, owner: str, settings: Settings) -> None:
        self._engine, self._owner, self._settings = engine, owner, settings

    def spare(self) -> int:
        """Number of seats without a job of their own."""
        with reading(self._engine) as session:
            return self._spare(session)

    def begin(self, job_id: int, stage: str, names: Collection[str], holder: str, at_least: int) -> None:
        """Offer these objects for computation."""
        with writing(self._engine, lasting=False) as session:
            for name in names:
                part = Part(job_id=job_id, stage=stage, name=name, holder=holder, at_least=at_least, state="waiting")
                session.add(part)

    def claim(self, side_by_side: int, job_id: int | None = None) -> Claimed | None:
        """Claim some objects of a job, by default the oldest, so many that all seats stay busy to the end.

        `side_by_side`: number of objects that this process computes in parallel, within its fair share.
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
        """Renew the heartbeat of the claimed parts; returns whether they are still wanted."""
        with writing(self._engine, lasting=False) as session:
            lives = update(Part).where(self._mine(claimed)).values(heartbeat=now(session))
            states = [state for (state,) in session.execute(lives.returning(col(Part.state)))]
            job = session.get(Job, claimed.job_id)
            return states == ["running"] * len(claimed.ids) and job is not None and job.state == "running"

    def done(self, claimed: Claimed, log: str, *, failed: bool) -> None:
        """Mark the parts as done, or failed if some cannot be computed, which the stage then reports itself."""
        self._leave(claimed, log, 0, state="failed" if failed else "done")

    def give_back(self, claimed: Claimed, log: str, *, tried: bool) -> None:
        """Release the parts for others."""
        self._leave(claimed, log, 0 if tried else 1, state="waiting")

    def is_open(self, job_id: int) -> bool:
        """Whether a running job has parts waiting or in progress."""
        of = select(Part.id).join(Job).where(Part.job_id == job_id, Job.state == "running").limit(1)
        with reading(self._engine) as session:
            return session.exec(of.where(self._waits(session) | self._is_at_work(session))).first() is not None

    def counted(self, job_id: int) -> Counter[str]:
        """Number of parts in each state."""
        with reading(self._engine) as session:
            return Counter(session.exec(select(Part.state).where(Part.job_id == job_id)))

    def take_logs(self, job_id: int) -> list[str]:
        """Output of processes that have ended since the last call."""
        of = (col(Part.job_id) == job_id, col(Part.log) != "")
        with reading(self._engine) as session:
            if session.exec(select(Part.id).where(*of).limit(1)).first() is None:
                return []
        with writing(self._engine, lasting=False) as session:
            found = {row.id: row.log for row in session.exec(select(Part).where(*of).order_by(col(Part.id)))}
            session.execute(update(Part).where(col(Part.id).in_(found)).values(log=""))
        return list(found.values())

    def end(self, project_id: str) -> bool:
        """Remove all of the project's parts; False while some are still being stopped."""
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
        """Release claimed parts in a state, and delete unwanted ones."""
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
        """Condition on parts that may be claimed, including those of owners without heartbeat."""
        gone = (col(Part.state) == "running") & (col(Part.heartbeat) < self._silent_since(session))
        return ((col(Part.state) == "waiting") | gone) & (col(Part.attempts) < TRIES)

    def _is_at_work(self, session: Session) -> ColumnElement[bool]:
        """Condition on parts in progress."""
        return col(Part.state).in_(("running", "stopping")) & (col(Part.heartbeat) >= self._silent_since(session))

    def _silent_since(self, session: Session) -> float:
        return now(session) - self._settings.beats_missed_s

    def _mine(self, claimed: Claimed) -> ColumnElement[bool]:
        return col(Part.id).in_(claimed.ids) & (col(Part.owner) == self._owner)


def fair_share(waiting: int, seats: int, fewest: int) -> int:
    """Half of a seat's share of the waiting parts, to balance the end; at least `fewest` where its share allows."""
    return min(-(-waiting // seats), max(fewest, -(-waiting // (2 * seats))))
