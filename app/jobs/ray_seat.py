"""Ray actor on a node that runs one step of a job, in its own process group that ends with it."""

import contextlib
import queue
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from app.errors import told
from app.files import only_server, project_files
from app.jobs.plans import placed_request
from app.jobs.ray_order import Order
from app.jobs.seats import version
from app.process import Line, Worker, python_module
from app.settings import Settings
from app.store.opening import open_store
from app.store.protocol import Store
from r2c2r_core.errors import EnvironmentProblem, R2C2RError

HEARD_S = 1.0  # maximum wait for output before an empty report
CACHES = 256  # maximum caches, and so concurrent steps, of one machine


class Heard(NamedTuple):
    """Output of the step since the last call; `status` once it has ended and its results are stored."""

    lines: list[Line]
    log: bytes
    status: int | None


class NodeSeat:
    """The node's side of a step: fetch, start, report, store. `ask_to_stop` may be called while `hear` waits."""

    def __init__(self, order: Order) -> None:
        self._order, self._left = order, contextlib.ExitStack()
        self._log = Path(self._left.enter_context(tempfile.TemporaryDirectory(prefix="r2c2r-ray-"))) / "log"
        self._read = 0
        self._worker: Worker | None = None
        self._store: Store | None = None

    def start(self) -> Line | None:
        """Start the step; returns an error message, or None."""
        order = self._order
        try:
            if version() != order.version:
                raise EnvironmentProblem(
                    f"this is r2c2r {order.version}, and the Ray node's is {version()}",
                    hint="install the same version on all machines",
                )
            here = self._left.enter_context(_data_folder(order))
            settings = Settings(data_dir=here, store=order.store, cache_gb=order.cache_gb)
            self._store = open_store(settings)
            self._store.hold(order.project, order.holder, taken=True)
            self._store.fetch(order.project, recording=True)
            files = project_files(here, order.project)
            if files.request(order.job).is_file():
                placed_request(files.request(order.job), files)
            self._worker = Worker((*python_module("app.tethered"), *_command(order, here)), self._log)
        except R2C2RError as error:
            self._left.close()
            return {"error": told(error)}
        return None

    def hear(self) -> Heard:
        """Wait for output; the last report follows after results are stored."""
        worker, lines = self._worker, list[Line]()
        assert worker is not None
        with contextlib.suppress(queue.Empty):
            while (line := worker.next_line(0.0 if lines else HEARD_S)) is not None:
                lines.append(line)
                if "done" in line or "error" in line:
                    break
            if line is None or "done" in line or "error" in line:
                return self._end(worker, lines)
        return Heard(lines, self._logged(), None)

    def ask_to_stop(self) -> None:
        """SIGTERM to the step's processes."""
        if self._worker is not None:
            self._worker.ask_to_stop()

    def _end(self, worker: Worker, lines: list[Line]) -> Heard:
        status, order = worker.close(self._order.grace_s), self._order
        try:
            assert self._store is not None
            self._store.keep(order.project)
            self._store.tidy(frozenset({order.project}))
        except R2C2RError as error:
            lines = [*(line for line in lines if "done" not in line), {"error": told(error)}]
        log = self._logged()
        self._left.close()
        return Heard(lines, log, status)

    def _logged(self) -> bytes:
        """New content of the log since the last call."""
        with self._log.open("rb") as log:
            log.seek(self._read)
            said = log.read()
        self._read += len(said)
        return said


@contextlib.contextmanager
def _data_folder(order: Order) -> Iterator[Path]:
    """A cache used only by this step; without a store, the folder shared by all machines."""
    root = Path(order.data_dir)
    if not order.store:
        yield root
        return
    with contextlib.ExitStack() as held:
        for number in range(CACHES):
            folder = root / "ray" / str(number)
            folder.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(EnvironmentProblem):
                held.enter_context(only_server(folder))
                break
        else:
            raise EnvironmentProblem(f"{root / 'ray'}: {CACHES} steps run here already", hint="see what the Ray node runs")
        yield folder


def _command(order: Order, here: Path) -> tuple[str, ...]:
    """The step's command with this machine's Python and folder."""
    placed = (
        str(here) + word.removeprefix(order.data_dir) if word.startswith(f"{order.data_dir}/") else word
        for word in order.command
    )
    return tuple(python_module()[0] if word == order.python else word for word in placed)
