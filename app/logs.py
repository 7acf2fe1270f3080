"""The server's log: one JSON object per line with `R2C2R_LOG=json`, with the request and the job of each line."""

import json
import logging
import sys
import time
from contextvars import ContextVar

from r2c2r_core.errors import InputError

REQUEST: ContextVar[str] = ContextVar("r2c2r_request", default="")  # the id in the answer's X-Request-ID
JOB: ContextVar[int | None] = ContextVar("r2c2r_job", default=None)
_OWN = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime"}


class JsonLines(logging.Formatter):
    """Formatter of a record as one line of JSON, with `extra` fields beside the message."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as a line."""
        at = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created)) + f".{int(record.msecs):03d}Z"
        said = {"at": at, "level": record.levelname.lower(), "logger": record.name, "message": record.getMessage()}
        known = {"request": REQUEST.get() or None, "job": JOB.get()}
        extra = {name: value for name, value in vars(record).items() if name not in _OWN}
        if record.exc_info:
            extra["traceback"] = self.formatException(record.exc_info)
        found = {**said, **{name: value for name, value in known.items() if value is not None}, **extra}
        return json.dumps(found, default=str, separators=(",", ":"))


def log_as(kind: str) -> None:
    """Send all loggers of this process to stderr from `info` on, in R2C2R_LOG's format; raises InputError if it is unknown."""
    if kind != "json":
        raise InputError(f"R2C2R_LOG {kind[:40]!r}: not json", hint="leave it out for plain text")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
