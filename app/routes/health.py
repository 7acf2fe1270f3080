"""Health checks for supervisors and load balancers without a session, and metrics for Prometheus as an admin."""

from fastapi import APIRouter
from fastapi.responses import Response

from app.deps import Ctx, OpenCtx
from app.metrics import CONTENT_TYPE
from app.services import health, metrics

router = APIRouter(include_in_schema=False)


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """The process answers; waits for nothing. Begin it anew when this does not come."""
    return {"state": "ok"}


@router.get("/readyz")
def ready(context: OpenCtx) -> dict[str, str]:
    """Requests can be served; 503 with the reason while the database does not answer. Send them elsewhere meanwhile."""
    health.require_ready(context)
    return {"state": "ready"}


@router.get("/metrics")
def read_metrics(context: Ctx) -> Response:
    """Metrics for Prometheus: requests, stages, the queue, seats, bytes; 403 but for an admin, or a token made for it."""
    return Response(metrics.exposed(context), media_type=CONTENT_TYPE)
