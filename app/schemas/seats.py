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
    objects: list[str]  # of another seat's job, computed here; empty for its own job


class Seat(Shape):
    """One running process that takes jobs."""

    id: int
    host: str
    process: int
    here: bool  # it is the responding server
    version: str
    jobs_at_a_time: int
    began: float
    silent_s: float  # since its last heartbeat
    draining: bool  # it takes no further jobs, and exits afterwards if it is not a server
    jobs: list[SeatJob]


class Seats(Shape):
    """All seats, and the number of waiting jobs."""

    waiting: int
    shared: bool  # false: the database is a file, and the responding server is the only seat
    seats: list[Seat]


class SeatIn(Shape):
    """A requested change of a seat."""

    draining: bool
