"""Seats: the computing machines."""

from app.schemas.base import Shape


class SeatJob(Shape):
    """A job that runs at a seat."""

    id: int
    project_id: str
    project_name: str
    kind: str
    stage: str
    progress: float
    objects: list[str]  # those of another seat's job that this one computes; none: the job is its own


class Seat(Shape):
    """One process that takes jobs, while it lives."""

    id: int
    host: str
    process: int
    here: bool  # it is the server that answers
    version: str
    jobs_at_a_time: int
    began: float
    silent_s: float  # since its last sign of life
    draining: bool  # it takes no further job, and ends if it serves nothing
    jobs: list[SeatJob]


class Seats(Shape):
    """All of them, and what waits for one."""

    waiting: int
    shared: bool  # false: the rows are in a file, and the server that answers is all there is
    seats: list[Seat]


class SeatIn(Shape):
    """A requested change of a seat."""

    draining: bool
