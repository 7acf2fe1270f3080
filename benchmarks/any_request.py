"""Whatever is sent to whichever operation, with and without a session: never a server error.

    python benchmarks/any_request.py [--examples 100] [--seed 0] [--json benchmarks/app.json]

Schemathesis makes requests from the app's own OpenAPI document, such as it allows and such as it forbids; each is sent with a
session and without one, half of them at things that exist (all of them, unless thorough).
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
from starlette.testclient import TestClient

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report

from app.settings import Settings
from app.viewer.client import Viewer
from tests.app.conftest import ORIGIN, fake, running

SAID_IN_ONE_LINE = (503, 507)  # a helper is down, the disk is full
ENDS_ITS_SESSION = ("signOut",)
DELETES = ("deleteProject",)  # not at the project that the others need


def send_anything(folder: Path, *, examples: int, seed: int, thorough: bool = True) -> dict[str, Any]:
    """Requests to every operation of an app of its own; what went wrong, and how many they were."""
    data = folder / "data"
    statuses, failures, operations = Counter[int](), [], 0
    began = time.monotonic()
    with running(data, viewer=Viewer(Settings(data_dir=data), fake("viewer"))) as web:
        known = {"project": web.sample(), "object": 1, "job": 1, "frame": 3}
        stranger = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"}, raise_server_exceptions=False)
        for found in schemathesis.openapi.from_dict(web.app.openapi()).get_all_operations():
            operation = found.ok()
            operations += 1
            name = operation.definition.raw["operationId"]
            parameters = {p.name for p in operation.path_parameters}
            existing = {key: value for key, value in known.items() if key in parameters and name not in DELETES}
            places = (existing, None) if existing and thorough else (existing or None,)
            for mode, place in itertools.product(GenerationMode, places):
                strategy = operation.as_strategy(generation_mode=mode, path_parameters=place)
                for problem, status in _try((web.client, stranger), strategy, examples, seed):
                    statuses[status] += 1
                    if problem:
                        failures.append(f"{name}: {problem}")
            if name in ENDS_ITS_SESSION:
                web.client.get(f"/?token={web.settings.launch_token}")
    return {
        "operations": operations,
        "requests": sum(statuses.values()),
        "statuses": {str(status): many for status, many in sorted(statuses.items())},
        "failures": failures,
        "seconds": round(time.monotonic() - began, 1),
    }


def _try(clients: tuple[TestClient, ...], strategy: Any, examples: int, seed: int) -> list[tuple[str, int]]:
    """(what was wrong or nothing, status) of some requests of a strategy."""
    found: list[tuple[str, int]] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        verbosity=Verbosity.quiet,
        suppress_health_check=list(HealthCheck),
    )
    @hypothesis.given(strategy)
    def send(case: Any) -> None:
        found.extend(_send(client, case) for client in clients)

    try:
        send()
    except hypothesis.errors.Unsatisfiable:  # nothing about this operation can be wrong
        return found
    return found


def _send(client: TestClient, case: Any) -> tuple[str, int]:
    body: dict[str, Any] = {}
    if isinstance(case.body, bytes | str):
        body["content"] = case.body
    elif not isinstance(case.body, schemathesis.core.NotSet):
        body["content"] = json.dumps(case.body)
        body["headers"] = {"content-type": "application/json"}
    headers = {**{str(k): _header(v) for k, v in (case.headers or {}).items()}, **body.pop("headers", {})}
    query = dict(case.query or {})
    try:
        answer = client.request(case.method, case.formatted_path, params=query, headers=headers, follow_redirects=False, **body)
    except (ValueError, TypeError):  # the client would not send such a thing
        return "", 0
    wrong = answer.status_code >= 500 and answer.status_code not in SAID_IN_ONE_LINE
    what = f"{case.method} {case.formatted_path} {query} {headers} {body} -> {answer.status_code} {answer.text[:300]}"
    return what if wrong else "", answer.status_code


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
