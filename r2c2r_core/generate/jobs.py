"""Job queue of a worker: one job at a time, in order; finished jobs keep their mesh until it is deleted or expires."""

import hashlib
import logging
import queue
import secrets
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from r2c2r_core.errors import Cancelled, R2C2RError
from r2c2r_core.generate.wire import Wish
from r2c2r_core.geometry.glb import glb_bytes
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.progress import Progress

log = logging.getLogger(__name__)

State = Literal["queued", "running", "done", "failed", "cancelled"]
Make = Callable[[Wish, Progress], MeshAsset]

_KEPT = 64  # maximum number of finished jobs remembered
_WAITING = 32  # maximum number of waiting jobs


@dataclass(slots=True)
class Job:
    """One request with its state and result."""

    wish: Wish | None  # dropped when it is done: its images are large
    state: State = "queued"
    error: str = ""
    artifact: dict[str, Any] = field(default_factory=dict)
    glb: bytes = b""

    def to_json(self) -> dict[str, Any]:
        """The job's state in the protocol's JSON form."""
        return {"state": self.state, "error": self.error, "artifacts": [self.artifact] if self.state == "done" else []}


class Jobs:
    """A queue with one worker thread: a GPU generates one mesh at a time."""

    def __init__(self, make: Make) -> None:
        self._make = make
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._waiting: queue.Queue[str] = queue.Queue(_WAITING)
        self._lock = threading.Lock()
        threading.Thread(target=self._work, daemon=True).start()

    def add(self, wish: Wish) -> str | None:
        """The new job's id; None when the queue is full."""
        identity = secrets.token_hex(8)
        with self._lock:
            try:
                self._waiting.put_nowait(identity)
            except queue.Full:
                return None
            self._jobs[identity] = Job(wish)
            finished = [key for key, job in self._jobs.items() if job.state not in ("queued", "running")]
            for key in finished[: max(len(finished) - _KEPT, 0)]:
                del self._jobs[key]
        return identity

    def find(self, identity: str) -> Job | None:
        """The job with that id, while it is remembered."""
        with self._lock:
            return self._jobs.get(identity)

    def cancel(self, identity: str) -> bool:
        """Cancel an unfinished job and discard its mesh; False when no job has that id."""
        job = self.find(identity)
        if job is None:
            return False
        job.state, job.wish, job.glb = "cancelled", None, b""
        return True

    def _work(self) -> None:
        while True:
            job = self.find(self._waiting.get())
            if job is not None and job.wish is not None:
                self._run(job, job.wish)

    def _run(self, job: Job, wish: Wish) -> None:
        with self._lock:
            if job.state != "queued":
                return
            job.state = "running"
        try:
            asset = self._make(wish, Progress(is_cancelled=lambda: job.state == "cancelled"))
            glb = glb_bytes(asset.mesh.vertices, asset.mesh.faces, asset.mesh.uv, asset.mesh.texture)
        except Cancelled:
            pass  # its state is already set
        except Exception as error:  # the edge of a job: the traceback goes to the log, one line to the client
            log.warning("%s %s failed", wish.evidence.track.name, wish.candidate_id, exc_info=not isinstance(error, R2C2RError))
            self._finish(job, "failed", error=" ".join(str(error).split())[:300] or type(error).__name__)
        else:
            self._finish(job, "done", glb=glb, artifact=_artifact(asset, glb))

    def _finish(
        self, job: Job, state: State, *, error: str = "", glb: bytes = b"", artifact: dict[str, Any] | None = None
    ) -> None:
        with self._lock:
            job.wish = None
            if job.state == "running":
                job.error, job.glb, job.artifact = error, glb, artifact or {}
                job.state = state  # last, so that a client that sees it done finds the mesh


def _artifact(asset: MeshAsset, glb: bytes) -> dict[str, Any]:
    return {
        "bytes": len(glb),
        "sha256": hashlib.sha256(glb).hexdigest(),
        "generator": asset.generator,
        "frames": list(asset.frames),
        "parameters": asset.parameters,
        "metrics": asset.metrics,
        "warnings": list(asset.warnings),
        "assumes": asset.assumes,
    }
