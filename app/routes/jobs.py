"""Heavy work: start, watch, cancel, read the log."""

from fastapi import APIRouter
from fastapi.responses import PlainTextResponse

from app import schemas
from app.deps import Ctx
from app.routes.numbers import Count, RowId
from app.services import jobs

router = APIRouter(prefix="/api", tags=["jobs"])


@router.post("/projects/{project}/run", operation_id="runProject", status_code=202)
def run_project(context: Ctx, project: str, body: schemas.RunRequest) -> schemas.Job:
    """Reconstruct from the clicks and corrections as they are now; finished stages are used again."""
    return jobs.run(context, project, body)


@router.get("/jobs", operation_id="listJobs")
def list_jobs(context: Ctx, project: str | None = None, limit: Count = 50) -> list[schemas.Job]:
    """Jobs, newest first."""
    return jobs.list_jobs(context, project, limit)


@router.get("/jobs/{job}", operation_id="getJob")
def get_job(context: Ctx, job: RowId) -> schemas.Job:
    """One job."""
    return jobs.get_job(context, job)


@router.post("/jobs/{job}/cancel", operation_id="cancelJob")
def cancel_job(context: Ctx, job: RowId) -> schemas.Job:
    """Ask the job to stop; finished stages are kept. Idempotent."""
    return jobs.cancel(context, job)


@router.post("/jobs/{job}/retry", operation_id="retryJob", status_code=202)
def retry_job(context: Ctx, job: RowId) -> schemas.Job:
    """Queue a failed or cancelled job again."""
    return jobs.retry(context, job)


@router.get("/jobs/{job}/events", operation_id="getJobEvents")
def get_job_events(context: Ctx, job: RowId, after: Count = 0) -> list[schemas.JobEvent]:
    """The job's history after an event."""
    return jobs.events(context, job, after)


@router.get("/jobs/{job}/log", operation_id="getJobLog", response_class=PlainTextResponse)
def get_job_log(context: Ctx, job: RowId, tail: Count = 100_000) -> PlainTextResponse:
    """The end of the job's log."""
    return PlainTextResponse(jobs.log(context, job, tail))
