"""Exception hierarchy of the web app, and its mapping to {kind, message, hint} and HTTP status.

R2C2RError (r2c2r_core.errors)
├── AppError
│   ├── NotFound            404
│   ├── Conflict            409   changed by someone else; `current` is the stored state
│   ├── Unauthorised        401
│   ├── Forbidden           403
│   ├── TooLarge            413
│   ├── TooMany             429   too many attempts or requests
│   ├── NotReady            409   the requested result does not exist yet
│   └── Unavailable         503   a helper process, the database or a store is down
├── DatabaseUnusable        503   damaged, of a newer r2c2r, not writable (exit 2)
└── the core's own errors   422 the input, 507/503 the machine, 500 the work
"""

from typing import Any

from r2c2r_core import errors as core


class AppError(core.R2C2RError):
    """A request that cannot be served."""


class NotFound(AppError):
    """The requested resource does not exist."""


class Conflict(AppError):
    """The resource was changed in the meantime; `current` is the stored state."""

    def __init__(self, message: str, *, hint: str = "", current: Any = None) -> None:
        super().__init__(message, hint=hint)
        self.current = current


class Unauthorised(AppError):
    """The request has no valid session."""


class Forbidden(AppError):
    """The user or the origin of the request lacks the right."""


class TooLarge(AppError):
    """More bytes than the limit."""


class TooMany(AppError):
    """Too many attempts or requests; `retry_s` is the time until the next may succeed."""

    def __init__(self, message: str, *, hint: str = "", retry_s: int = 60) -> None:
        super().__init__(message, hint=hint)
        self.retry_s = retry_s


class NotReady(AppError):
    """The requested result does not exist yet."""


class Unavailable(AppError):
    """A helper process, the database or a store is temporarily unavailable."""


class DatabaseUnusable(core.InputError):
    """The database is damaged, of a newer r2c2r, not writable, missing, or not a database."""


class NoSpace(core.EnvironmentProblem):
    """The disk is too full to start."""


KINDS: tuple[tuple[type[core.R2C2RError], str, int], ...] = (
    # the narrowest class first
    (NotFound, "not-found", 404),
    (Conflict, "conflict", 409),
    (NotReady, "not-ready", 409),
    (Unauthorised, "unauthorised", 401),
    (Forbidden, "forbidden", 403),
    (TooLarge, "too-large", 413),
    (TooMany, "too-many", 429),
    (Unavailable, "unavailable", 503),
    (NoSpace, "no-space", 507),
    (DatabaseUnusable, "database", 503),
    (core.CaptureError, "capture", 422),
    (core.PromptError, "prompt", 422),
    (core.OverrideError, "override", 422),
    (core.BundleError, "bundle", 422),
    (core.InputError, "input", 422),
    (core.ObjectNotSeen, "object-not-seen", 422),
    (core.GenerationFailed, "generation-failed", 500),
    (core.PlacementFailed, "placement-failed", 500),
    (core.ExportFailed, "export-failed", 500),
    (core.StageError, "stage", 500),
    (core.BackendUnavailable, "backend-unavailable", 503),
    (core.EnvironmentProblem, "environment", 503),
    (core.Cancelled, "cancelled", 409),
    (core.R2C2RError, "error", 500),
)


def kind_of(error: core.R2C2RError) -> tuple[str, int]:
    """The error's kind for a program, and its HTTP status."""
    return next((kind, status) for cls, kind, status in KINDS if isinstance(error, cls))


def body(kind: str, message: str, hint: str = "", current: Any = None) -> dict[str, Any]:
    """The JSON shape of all errors."""
    return {"kind": kind, "message": message, "hint": hint, "current": current}


def error_body(error: core.R2C2RError) -> dict[str, Any]:
    """The error as an API response body."""
    return body(kind_of(error)[0], error.message, error.hint, getattr(error, "current", None))


def told(error: core.R2C2RError) -> dict[str, str]:
    """The error as JSON for another process."""
    return {"kind": type(error).__name__, "message": error.message, "hint": error.hint}


def told_body(told: dict[str, Any]) -> dict[str, Any]:
    """API response body for an error from another process, with class names mapped to kinds."""
    by_class = {cls.__name__: kind for cls, kind, _ in KINDS}
    kind = str(told.get("kind", "error"))
    known = by_class.get(kind, kind if kind.islower() else "internal")
    return body(known, str(told.get("message", "")), str(told.get("hint", "")))
