"""Seats: the computing machines, for admins."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.routes.numbers import RowId
from app.services import seats

router = APIRouter(prefix="/api/seats", tags=["seats"])


@router.get("", operation_id="listSeats")
def list_seats(context: AdminCtx) -> schemas.Seats:
    """Each seat that lives, what it does, and how many jobs wait."""
    return seats.everyone(context)


@router.patch("/{seat}", operation_id="drainSeat")
def drain_seat(context: AdminCtx, seat: RowId, body: schemas.SeatIn) -> schemas.Seats:
    """Let a seat end what it does and take nothing more, or take jobs again."""
    return seats.drain(context, seat, body)
