"""One step of a job on a Ray cluster: `python -m app.jobs.ray_relay ORDER`, a JSON of app.jobs.ray_order.

It relays the step's messages and exit status, so that the caller need not know about Ray. It waits for a cluster and for a
node with free resources. The actor belongs to Ray and ends with this process; the step's processes end with the actor.
"""

import json
import os
import signal
import sys
import threading
import time
from typing import Any

from app.errors import told
from app.jobs.ray_order import Order
from app.jobs.ray_seat import NodeSeat
from app.process import Line
from r2c2r_core.errors import Cancelled, EnvironmentProblem, R2C2RError

SAID_S = 5.0  # interval of messages while waiting
TRIED_S = 1.0


def main(arguments: list[str]) -> int:
    """Relay a step and return its exit status, or 1 without a last message where its node vanished."""
    order, stopped = order_of(arguments[0]), threading.Event()
    _listen(stopped)
    try:
        return _relay(order, stopped)
    except R2C2RError as error:
        _say(error=told(error))
        return error.exit_code


def order_of(said: str) -> Order:
    """Parse the order written by `app.jobs.compute`."""
    return Order(**json.loads(said))


def _relay(order: Order, stopped: threading.Event) -> int:
    ray = _joined(order, stopped)
    gpus = 1 if order.gpu and ray.cluster_resources().get("GPU", 0) else 0
    takes = {"num_cpus": order.cpus, "num_gpus": gpus, "memory": order.memory_bytes}
    seat = ray.remote(NodeSeat).options(max_concurrency=2, **takes).remote(order)
    try:
        wrong = _started(ray, seat, order, stopped, _words(takes))
        if wrong is not None:
            _say(**wrong)
            return 1
        while True:
            hearing = seat.hear.remote()
            while not ray.wait([hearing], timeout=TRIED_S / 5)[0]:
                if stopped.is_set():
                    seat.ask_to_stop.remote()
                    stopped.clear()
            heard = ray.get(hearing)
            sys.stderr.buffer.write(heard.log)
            sys.stderr.buffer.flush()
            for line in heard.lines:
                _say(**line)
            if heard.status is not None:
                return int(heard.status) if heard.status >= 0 else _ended_by(-heard.status)
    except ray.exceptions.RayActorError as error:
        sys.stderr.write(f"the Ray node of {order.stage} vanished: {_first_line(error)}\n")
        return 1


def _listen(stopped: threading.Event) -> None:
    signal.signal(signal.SIGTERM, lambda *_: stopped.set())


def _joined(order: Order, stopped: threading.Event) -> Any:
    """The ray module, once connected to a cluster."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ModuleNotFoundError as error:
        raise EnvironmentProblem(f"no module {error.name}", hint="pip install 'r2c2r[ray]'") from error
    waiting = _Waiting(order, stopped, "waits for a Ray cluster: none answers, or it refuses this token; see the log")
    while True:
        try:
            ray.init(address="auto", log_to_driver=False, logging_level="ERROR", configure_logging=False)
            _listen(stopped)  # Ray has installed its own handlers
            return ray
        except ConnectionError:
            waiting.wait()
        except RuntimeError as error:  # mismatching versions of Ray or Python
            raise EnvironmentProblem(f"Ray: {_first_line(error)}", hint="install the same version on all machines") from error


def _started(ray: Any, seat: Any, order: Order, stopped: threading.Event, takes: str) -> Line | None:
    """Start the step on a free node; returns an error message, or None."""
    starting, waiting = seat.start.remote(), _Waiting(order, stopped, f"waits for a Ray node with {takes}")
    while not ray.wait([starting], timeout=0)[0]:
        waiting.wait()
    wrong: Line | None = ray.get(starting)
    return wrong


class _Waiting:
    """Waiting loop that reports the reason, and ends on cancellation."""

    def __init__(self, order: Order, stopped: threading.Event, words: str) -> None:
        self._order, self._stopped, self._words = order, stopped, words
        self._told = time.monotonic()

    def wait(self) -> None:
        """Wait for a short interval."""
        if self._stopped.wait(TRIED_S / 10):
            raise Cancelled(f"{self._order.stage}: cancelled")
        if time.monotonic() - self._told > SAID_S:
            self._told = time.monotonic()
            _say(stage=self._order.stage, fraction=0.0, text=self._words)


def _words(takes: dict[str, int]) -> str:
    gpus = f", {takes['num_gpus']} GPU" if takes["num_gpus"] else ""
    return f"{takes['num_cpus']} CPU{gpus} and {takes['memory'] / 1e9:.1f} GB free"


def _ended_by(number: int) -> int:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    return 1


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0][:200]


def _say(**line: Any) -> None:
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
