"""Whatever is sent to whichever operation, alone or one after the other, with and without a session: never a server error.

    python benchmarks/any_request.py [--examples 100] [--seed 0] [--json benchmarks/app.json]

Schemathesis makes requests from the app's own OpenAPI document, such as it allows and such as it forbids; each is sent with a
session and without one, most of them at things that exist (all of them, unless thorough). The queue stands still meanwhile:
what is queued by thousands of requests is not what is looked at. Then it runs, and Schemathesis walks from answer to request:
what one operation made, others are asked about.
"""

import argparse
import itertools
import json
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import hypothesis
import schemathesis
from hypothesis import HealthCheck, Phase, Verbosity
from schemathesis import GenerationMode
from schemathesis.core.transport import Response
from starlette.testclient import TestClient

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report

from app.settings import Settings
from app.viewer.client import Viewer
from tests.app.conftest import ORIGIN, Running, fake, running

SAID_IN_ONE_LINE = (503, 507)  # a helper is down, the disk is full
ENDS_ITS_SESSION = ("signOut",)
DELETES = ("deleteProject",)  # not at the project that the others need
NOWHERE = 4  # one request at what does not exist (where little of it is read) for so many at what does
STEPS = 30  # of a walk


def send_anything(folder: Path, *, examples: int, seed: int, thorough: bool = True) -> dict[str, Any]:
    """Requests to every operation of an app of its own; what went wrong, and how many they were."""
    began, data = time.monotonic(), folder / "data"
    with running(data) as web:
        project = web.sample()
    with running(data, viewer=Viewer(Settings(data_dir=data), fake("viewer")), run_jobs=False) as web:
        operations, statuses, failures = _send_to_each(web, project, examples, seed, thorough)
    with running(data, viewer=Viewer(Settings(data_dir=data), fake("viewer"))) as web:
        walked, wrong = _walk(web, walks=examples, seed=seed)
    return {
        "operations": operations,
        "requests": sum(statuses.values()),
        "statuses": {str(status): many for status, many in sorted(statuses.items())},
        "walks": examples,
        "steps": sum(walked.values()),
        "steps_statuses": {str(status): many for status, many in sorted(walked.items())},
        "failures": failures + wrong,
        "seconds": round(time.monotonic() - began, 1),
    }


def _send_to_each(web: Running, project: str, examples: int, seed: int, thorough: bool) -> tuple[int, Counter[int], list[str]]:
    """How many operations there are, the statuses of the requests to them, and what went wrong."""
    statuses, failures, operations = Counter[int](), [], 0
    known = {"project": project, "object": 1, "job": 1, "frame": 3}
    stranger = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"}, raise_server_exceptions=False)
    for found in schemathesis.openapi.from_dict(web.app.openapi()).get_all_operations():
        operation = found.ok()
        operations += 1
        name = operation.definition.raw["operationId"]
        parameters = {p.name for p in operation.path_parameters}
        existing = {key: value for key, value in known.items() if key in parameters and name not in DELETES}
        places = [(existing or None, examples)] + ([(None, max(examples // NOWHERE, 1))] if existing and thorough else [])
        for mode, (place, count) in itertools.product(GenerationMode, places):
            strategy = operation.as_strategy(generation_mode=mode, path_parameters=place)
            for problem, status in _try((web.client, stranger), strategy, count, seed):
                statuses[status] += 1
                if problem:
                    failures.append(f"{name}: {problem}")
        if name in ENDS_ITS_SESSION:
            web.client.get(f"/?token={web.settings.launch_token}")
        _forget_others(web, project)
        sys.stderr.write(f"{operations} {name}: {sum(statuses.values())} requests\n")
    return operations, statuses, failures


def _forget_others(web: Running, project: str) -> None:
    """Delete the projects that requests made, so that the next ones are answered as fast."""
    for other in web.get("/api/projects"):
        if other["id"] != project:
            web.delete(f"/api/projects/{other['id']}")


def _walk(web: Running, *, walks: int, seed: int) -> tuple[Counter[int], list[str]]:
    """Walks of STEPS requests each, from what was answered to what may be asked about it: statuses, and what went wrong."""
    statuses, failures = Counter[int](), []
    machine = schemathesis.openapi.from_dict(web.app.openapi()).as_state_machine()

    class Walk(machine):  # type: ignore[misc,valid-type]
        """One person who does anything."""

        def setup(self) -> None:
            web.client.get(f"/?token={web.settings.launch_token}")

        def call(self, case: Any, **_: Any) -> Response:
            answer = send(web.client, case)
            hypothesis.assume(answer is not None)
            statuses[answer.status_code] += 1
            failures.extend(filter(None, [complaint(case, answer)]))
            return Response.from_any(answer)

        def validate_response(self, *_: Any, **__: Any) -> None:
            """Nothing else is wrong."""

    Walk.run(settings=hypothesis.settings(_settings(walks), stateful_step_count=STEPS, derandomize=seed == 0))
    return statuses, failures


def _try(clients: tuple[TestClient, ...], strategy: Any, examples: int, seed: int) -> list[tuple[str, int]]:
    """(what was wrong or nothing, status) of some requests of a strategy."""
    found: list[tuple[str, int]] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(_settings(examples))
    @hypothesis.given(strategy)
    def send_it(case: Any) -> None:
        for client in clients:
            answer = send(client, case)
            if answer is not None:
                found.append((complaint(case, answer), answer.status_code))

    try:
        send_it()
    except hypothesis.errors.Unsatisfiable:  # nothing about this operation can be wrong
        return found
    return found


def _settings(examples: int) -> hypothesis.settings:
    return hypothesis.settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        verbosity=Verbosity.quiet,
        suppress_health_check=list(HealthCheck),
    )


def send(client: TestClient, case: Any) -> Any:
    """The answer to a made-up request; None where the client would not send such a thing."""
    body: dict[str, Any] = {}
    if isinstance(case.body, bytes | str):
        body["content"] = case.body
    elif not isinstance(case.body, schemathesis.core.NotSet):
        body["content"] = json.dumps(case.body)
        body["headers"] = {"content-type": "application/json"}
    headers = {**{str(k): _header(v) for k, v in (case.headers or {}).items()}, **body.pop("headers", {})}
    asked = {"params": dict(case.query or {}), "headers": headers, "follow_redirects": False, **body}
    try:
        return client.request(case.method, case.formatted_path, **asked)
    except (ValueError, TypeError):
        return None


def complaint(case: Any, answer: Any) -> str:
    """What is wrong with an answer; empty when nothing is."""
    if answer.status_code < 500 or answer.status_code in SAID_IN_ONE_LINE:
        return ""
    asked = f"{case.method} {case.formatted_path} {case.query} {case.headers} {case.body!r}"
    return f"{asked[:2000]} -> {answer.status_code} {answer.text[:300]}"


def _header(value: Any) -> str:
    return str(value).encode("latin-1", "replace").decode("latin-1")


def main() -> int:
    """Send, report; 1 when a server error came back."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=100, help="of each operation, mode and place")
    parser.add_argument("--seed", type=int, default=0)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-any-") as folder:
        figures = send_anything(Path(folder), examples=options.examples, seed=options.seed)
    return report("any_request", figures, options.json, failed=bool(figures["failures"]))


if __name__ == "__main__":
    sys.exit(main())
