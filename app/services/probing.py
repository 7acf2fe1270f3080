"""Validation of uploaded files in a separate process before further use."""

import os
import queue
from pathlib import Path
from typing import Any, Literal

from app import archives
from app.errors import Unavailable, told_body
from app.services.context import Context
from r2c2r_core.errors import CaptureError, InputError, OverrideError

Kind = Literal["recording", "mesh"]
PROBE_S: dict[Kind, float] = {"recording": 120.0, "mesh": 300.0}
_REFUSAL: dict[Kind, type[InputError]] = {"recording": CaptureError, "mesh": OverrideError}


def check_recording(context: Context, path: Path, name: str) -> None:
    """Raise CaptureError, in one line, for an unreadable recording. It waits for a process, as `look_at` does."""
    check_whole(context, path, name)
    look_at(context, "recording", path, name)


def check_whole(context: Context, path: Path, name: str) -> None:
    """Raise CaptureError unless a zip is complete and safe to unpack."""
    settings = context.settings
    archives.check_archive(path, name, max_bytes=settings.max_unpacked_bytes, max_files=settings.max_unpacked_files)


def look_at(context: Context, kind: Kind, path: Path, name: str) -> Any:
    """Probe result of a file called `name`: size, triangles, notes and picture for a mesh, None for a recording.

    Raises CaptureError or OverrideError, in one line, for a file that the core could not use.

    It waits for a process: call it behind the gate of looks. Raises Unavailable when the server stops meanwhile, which is
    not the file's fault.
    """
    command = (*context.runner.commands.probe, kind, str(path), name)
    with context.probes.running(command, Path(os.devnull)) as worker:
        try:
            line = worker.next_line(timeout=PROBE_S[kind])
        except queue.Empty:
            line = None
    if line is None and context.probes.stopped:
        raise Unavailable("the server stops", hint="the sent bytes are kept: finish the upload when the server is back")
    if line is None:
        raise _REFUSAL[kind](f"{name} cannot be read: checking it took too long or too much memory", hint="export it again")
    if "error" in line:
        raise _refusal(kind, name, line["error"])
    return line.get("seen")


def _refusal(kind: Kind, name: str, told: dict[str, str]) -> InputError:
    """The probe's error; any unexpected failure is attributed to the file."""
    said = told_body(told)
    message, hint = (" ".join(said[part].split())[:most] for part, most in (("message", 500), ("hint", 400)))
    if said["kind"] == "internal":
        message, hint = f"{name} cannot be read ({message[:200]})", "export it again from the app that made it"
    return _REFUSAL[kind](message, hint=hint)
