"""Seats: the computing machines, for admins."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.routes.numbers import RowId
from app.services import seats

router = APIRouter(prefix="/api/seats", tags=["seats"])


@router.get("", operation_id="listSeats")
def list_seats(context: AdminCtx) -> schemas.Seats:
    """Each running seat, its current work, and the number of waiting jobs."""
    return seats.everyone(context)


@router.patch("/{seat}", operation_id="drainSeat")
def drain_seat(context: AdminCtx, seat: RowId, body: schemas.SeatIn) -> schemas.Seats:
    """Drain a seat: it finishes its work and takes no new jobs; or let it take jobs again."""
    return seats.drain(context, seat, body)
