"""Assembly of the web app. Importing this module creates nothing."""

import asyncio
import errno
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from typing import Any

import anyio
from fastapi import APIRouter, FastAPI, Request, WebSocket
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from opentelemetry.trace import TracerProvider
from starlette.exceptions import HTTPException

from app import errors, schemas
from app.db.channel import Channel, join_hubs
from app.db.engine import open_engine
from app.db.queries import READS_RECORDING
from app.gates import Gates
from app.hub import Hub
from app.jobs.far import FarWorkers
from app.jobs.live import LiveSegmenters
from app.jobs.outcomes import FINISHERS, job_ended
from app.jobs.plans import Commands, commands_of
from app.jobs.rows import JobRows
from app.jobs.runner import Runner
from app.metrics import Metrics
from app.privacy import without_places
from app.process import Workers
from app.routes import (
    elevations,
    health,
    honeypots,
    inbox,
    jobs,
    lengths,
    live,
    media,
    members,
    opinions,
    pages,
    people,
    projects,
    prompts,
    proposals,
    providers,
    reviews,
    scenes,
    seats,
    states,
    system,
    templates,
    tokens,
    trash,
    unknown,
    uploads,
    variants,
    viewer,
    webhooks,
)
from app.routes.addresses import Addresses
from app.routes.fetched import Fetched
from app.routes.measured import Measured
from app.routes.members import MembersOnly
from app.routes.once import Once
from app.routes.packed import Packed
from app.routes.static import PageFiles
from app.security import BehindProxies, Guard, Person
from app.services import leftovers, masks, sending, sizes
from app.services.access import Access
from app.services.at_work import AtWork
from app.services.context import Context
from app.services.crossing import hear_others
from app.services.descriptions import Descriptions
from app.services.oidc import Provider
from app.services.people import People
from app.services.posting import Posting
from app.services.prompts import segment_again, tell_object
from app.services.uploads import forget_stopped
from app.settings import MEBIBYTE, Settings, shipped
from app.store.opening import open_store
from app.traces import of_requests, open_traces
from app.viewer.client import Viewer
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

TIDY_S = 30.0
MOST_BODY_BYTES = 16 * MEBIBYTE  # of bodies read at once; routes that store a stream count its bytes themselves
ROUTERS = (
    health,
    system,
    people,
    tokens,
    webhooks,
    projects,
    templates,
    members,
    uploads,
    prompts,
    elevations,
    proposals,
    jobs,
    seats,
    reviews,
    states,
    honeypots,
    opinions,
    lengths,
    inbox,
    scenes,
    variants,
    media,
    viewer,
    live,
    trash,
    unknown,
    providers,
    pages,
)
STATUS_KINDS = {404: "not-found", 405: "method-not-allowed", 413: "too-large", 422: "invalid"}


def create_app(
    settings: Settings,
    *,
    commands: Commands | None = None,
    viewer_client: Viewer | None = None,
    traces: TracerProvider | None = None,
) -> FastAPI:
    """The app; the optional arguments replace the real processes and the trace collector in tests."""
    static, metrics, traces = shipped("static", "index.html"), Metrics(), traces or open_traces(settings.traces)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        chosen = commands or commands_of(settings)
        context = await anyio.to_thread.run_sync(_open, settings, chosen, viewer_client, metrics, traces)
        app.state.context = context
        tidying = asyncio.create_task(_tidy(context))
        try:
            yield
        finally:
            tidying.cancel()
            with anyio.CancelScope(shield=True):
                await anyio.to_thread.run_sync(_close, context, limiter=anyio.CapacityLimiter(1))

    app = FastAPI(
        title="r2c2r",
        version="1",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url="/api/openapi.json",
        max_body_size=MOST_BODY_BYTES,
        telemetry=of_requests(traces),
    )
    app.mount("/static", PageFiles(static), name="static")  # first, as pages ask for a hundred of them
    app.router.routes.extend(_api().routes)
    _add_error_handlers(app)
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    if settings.store:
        app.add_middleware(Fetched, context_of=lambda: app.state.context)
    app.add_middleware(Addresses)
    app.add_middleware(Once, context_of=lambda: app.state.context)
    app.add_middleware(MembersOnly, context_of=lambda: app.state.context)
    app.add_middleware(Packed)
    app.add_middleware(
        Guard,
        person_of=lambda session: _people(app).of(session),
        allowed_hosts=settings.allowed_hosts,
        named_in=settings.identity_header,
        session_of=lambda name, client: _people(app).named_by_proxy(name, client),
    )
    app.add_middleware(Measured, metrics=metrics)
    if settings.trusted_proxies:
        app.add_middleware(BehindProxies, trusted=settings.trusted_proxies)
    return app


@cache  # FastAPI builds a route's dependencies on first use, and caches them with the router: some 0.6 s
def _api() -> APIRouter:
    """All routes of the app, with their error responses."""
    errors: dict[int | str, dict[str, Any]] = {code: {"model": schemas.ErrorBody} for code in (401, 403, 404, 409, 422, 429)}
    api = APIRouter(responses=errors, max_body_size=MOST_BODY_BYTES)
    for module in ROUTERS:
        api.include_router(module.router)
    return api


def _open(
    settings: Settings, commands: Commands, viewer_client: Viewer | None, metrics: Metrics, traces: TracerProvider
) -> Context:
    """Start all running parts: database, queue, live segmenters, viewer."""
    engine, hub, gates, store = open_engine(settings.rows, busy_s=settings.busy_s), Hub(), Gates(), open_store(settings)
    rows = JobRows(engine, hub, settings, store, FINISHERS, job_ended)
    runner = Runner(rows, settings, commands, metrics.stages, traces)
    context = Context(
        settings=settings,
        engine=engine,
        hub=hub,
        channel=Channel(engine, rows.owner, settings.beat_s) if rows.shared else None,
        store=store,
        people=People(engine, settings, gates.passwords),
        access=Access(engine),
        uploads=AtWork(),
        descriptions=Descriptions(engine, settings),
        posting=Posting(engine, settings),
        person=Person(settings.user, "admin"),
        runner=runner,
        live=LiveSegmenters(engine, hub, settings, commands, store),
        viewer=viewer_client or Viewer(settings),
        gates=gates,
        probes=Workers(),
        metrics=metrics,
        provider=Provider(settings) if settings.identity_issuer else None,
        static=shipped("static", "index.html"),
    )
    context.descriptions.start()
    context.posting.start()
    context.live.on_object = lambda project, number: _tell(context, project, number)
    context.live.on_again = lambda project, number, key, others: _again(context, project, number, key, others)
    runner.on_done = lambda project, kind: _prepare(context, project, kind)
    if context.channel is not None:
        join_hubs(context.channel, hub)
        hear_others(context, context.channel)
        context.live.far = FarWorkers(context.channel).start
    if settings.run_jobs:
        runner.start()
    if context.channel is not None:
        context.channel.start()
    if settings.run_jobs:
        masks.resume(context)
    return context


def _people(app: FastAPI) -> People:
    context: Context = app.state.context
    return context.people


async def _tidy(context: Context) -> None:
    """Close unused resources, in a separate thread, as this may wait for the 3D view."""
    thread = anyio.CapacityLimiter(1)
    while True:
        await asyncio.sleep(TIDY_S)
        for tidy in TIDYING:
            try:
                await anyio.to_thread.run_sync(tidy, context, limiter=thread)
            except errors.Unavailable as error:
                _log.warning("tidying: %s", error)
            except Exception:  # a temporarily full disk or locked database must not end tidying for good
                _log.exception("tidying")


def _look_at_members(context: Context) -> None:
    context.access.look_again()


def _close_idle_views(context: Context) -> None:
    context.viewer.close_idle()


def _forget_ended(context: Context) -> None:
    context.people.forget_ended()


def _tidy_store(context: Context) -> None:
    context.store.tidy(context.runner.projects | context.live.projects)


TIDYING = (
    _close_idle_views,
    _look_at_members,
    _forget_ended,
    forget_stopped,
    leftovers.tidy,
    _tidy_store,
    sending.tidy,
    sizes.measure,
)


def _tell(context: Context, project: str, number: int) -> None:
    try:
        tell_object(context, project, number)
    except R2C2RError:  # deleted meanwhile
        return


def _prepare(context: Context, project: str, kind: str) -> None:
    """Prepare a newly read recording; errors are shown when Annotate is opened."""
    if kind not in READS_RECORDING or not context.settings.prepare_imports:
        return
    try:
        masks.prepare(context, project)
    except Exception:
        _log.exception("preparing %s", project)


def _again(context: Context, project: str, number: int, key: str, others: list[int]) -> None:
    try:
        segment_again(context, project, number, key, others)
    except R2C2RError:  # deleted meanwhile
        return


async def let_go(app: FastAPI) -> None:
    """End all waits of requests, so that a stopping server need not wait; no further requests are accepted."""
    context: Context | None = getattr(app.state, "context", None)
    if context is not None:
        await anyio.to_thread.run_sync(_end_waits, context, limiter=anyio.CapacityLimiter(1))


def _end_waits(context: Context) -> None:
    context.probes.stop()
    context.viewer.stop()


def _close(context: Context) -> None:
    """Close all parts, first those that requests wait for; nothing here waits for a request."""
    _end_waits(context)
    context.live.stop()
    context.runner.stop()
    if context.channel is not None:
        context.channel.stop()
    context.posting.stop()
    context.descriptions.stop()
    context.engine.dispose()


def _add_error_handlers(app: FastAPI) -> None:
    """Register handlers that give all errors the same JSON shape."""

    @app.exception_handler(R2C2RError)
    async def known(request: Request, error: R2C2RError) -> JSONResponse:
        headers = {"retry-after": str(error.retry_s)} if isinstance(error, errors.TooMany) else None
        said, person = errors.error_body(error), getattr(request.state, "person", None)
        if person is None or not person.may("admin"):
            settings = request.app.state.context.settings
            said |= {key: without_places(said[key], settings) for key in ("message", "hint")}
        return JSONResponse(said, errors.kind_of(error)[1], headers=headers)

    @app.exception_handler(RequestValidationError)
    async def invalid(_: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"] if part != "body") or "the body"
        return JSONResponse(errors.body("invalid", f"{where}: {_in_words(first)}", "see /api/openapi.json"), 422)

    @app.exception_handler(HTTPException)
    async def refused(_: Request, error: HTTPException) -> JSONResponse:
        kind = STATUS_KINDS.get(error.status_code, "error")
        return JSONResponse(errors.body(kind, str(error.detail)), error.status_code, headers=error.headers)

    @app.exception_handler(OSError)
    async def files(request: Request | WebSocket, error: OSError) -> JSONResponse:
        if isinstance(request, WebSocket):
            raise error  # a connection takes no response; one whose browser has gone is the server's to end
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            return _full_disk()
        return await unexpected(request, error)

    @app.exception_handler(Exception)
    async def unexpected(request: Request, error: Exception) -> JSONResponse:
        _log.exception("%s %s", request.method, request.url.path, exc_info=error)
        return JSONResponse(errors.body("internal", "the server met an unexpected error", "it is in the server's log"), 500)


def _in_words(problem: dict[str, Any]) -> str:
    """Message of a validation error; for too long text it counts characters, which pydantic calls items."""
    if problem["type"] in ("too_long", "string_too_long") and isinstance(problem.get("input"), str):
        return f"{len(problem['input'])} characters, at most {problem['ctx']['max_length']} expected"
    return str(problem["msg"])


def _full_disk() -> JSONResponse:
    return JSONResponse(errors.body("no-space", "the disk is full", "free some space: nothing already made is lost"), 507)
