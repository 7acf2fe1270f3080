"""Health checks for supervisors and load balancers without a session, and metrics for Prometheus as an admin."""

from fastapi import APIRouter
from fastapi.responses import Response

from app.deps import Ctx, OpenCtx
from app.metrics import CONTENT_TYPE
from app.services import health, metrics

router = APIRouter(include_in_schema=False)


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """Whether the process answers; waits for nothing. Restart the process when no answer comes."""
    return {"state": "ok"}


@router.get("/readyz")
def ready(context: OpenCtx) -> dict[str, str]:
    """Whether requests can be served; 503 with the reason while the database does not answer: send them elsewhere then."""
    health.require_ready(context)
    return {"state": "ready"}


@router.get("/metrics")
def read_metrics(context: Ctx) -> Response:
    """Metrics for Prometheus: requests, stages, the queue, seats, bytes; 403 unless an admin or a metrics token asks."""
    return Response(metrics.exposed(context), media_type=CONTENT_TYPE)
