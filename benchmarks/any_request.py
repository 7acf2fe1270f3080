"""Schema-based fuzzing of every API operation, in every role, one request at a time and in sequences: no server errors.

    python benchmarks/any_request.py [--examples 100] [--roles annotator reviewer admin nobody] [--walks 16]
                                     [--seed 0] [--json benchmarks/app.json]

Schemathesis generates valid and invalid requests from the app's own OpenAPI document. Each role sends the same number to each
operation, most of them to objects that exist, on its own data folder: a project with clicks, comments, nouns and two bundles as
the exporter writes them. The job queue does not run during this part: the jobs that thousands of requests queue are not under
test. Then the queue runs, and an admin makes stateful walks: ids returned by one operation are used in requests to others.
"""

import argparse
import json
import shutil
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import hypothesis
import schemathesis
from hypothesis import HealthCheck, Phase, Verbosity
from schemathesis import GenerationMode
from schemathesis.core.transport import Response
from starlette.testclient import TestClient

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from kept import add_options, report

from app.services import accounts, people
from app.settings import Settings
from app.viewer.client import Viewer
from r2c2r_core.export.stage import ExportConfig, check_bundle, write_bundle
from tests.app.conftest import ORIGIN, Running, fake, running
from tests.app.finished import finished_kitchen
from tests.core.export.kitchen import reconstruction

SAID_IN_ONE_LINE = (503, 507)  # a helper is down, or the disk is full
ROLES = ("annotator", "reviewer", "admin", "nobody")
PASSWORD = "correct horse battery"
ABOUT_SESSIONS = ("signIn", "signOut", "changePassword")  # sent last and not in walks: the others need the session
DELETES = ("deleteProject",)  # not sent to the project that the others need
NOWHERE = 5  # one of this many requests targets an object that does not exist
STEPS = 30  # per walk


def send_anything(folder: Path, project: str, *, examples: int, seed: int, roles: tuple[str, ...] = ROLES) -> dict[str, Any]:
    """Send `examples` requests per role to every operation; return the failures and the number of requests."""
    began = time.monotonic()
    with ExitStack() as stack:
        apps = {role: stack.enter_context(_started(folder, role, run_jobs=False)) for role in roles}
        operations, answers = _send_to_each(apps, project, examples, seed)
    return {
        "operations": operations,
        "examples": examples,
        "requests": sum(answer.statuses.total() for answer in answers.values()),
        "roles": {role: answer.figures() for role, answer in answers.items()},
        "failures": [f"{role}: {line}" for role, answer in answers.items() for line in answer.wrong],
        "seconds": round(time.monotonic() - began, 1),
    }


def walk_anywhere(folder: Path, *, walks: int, seed: int) -> dict[str, Any]:
    """Run an admin's walks of STEPS requests each while the queue runs; return the failures and the number of steps."""
    began, answers = time.monotonic(), Answers()
    with _started(folder, "walk", run_jobs=True) as (web, client):
        cut_short = _walk(web, client, answers, walks=walks, seed=seed)
    return {
        "walks": 2 * walks,
        "cut_short": cut_short,
        "steps": answers.statuses.total(),
        "statuses": _counted(answers.statuses),
        "failures": answers.wrong,
        "seconds": round(time.monotonic() - began, 1),
    }


@dataclass(frozen=True, slots=True)
class Answers:
    """Responses that one role received."""

    statuses: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def note(self, case: Any, answer: Any) -> None:
        """Count a response; store it if it has a fault."""
        self.statuses[answer.status_code] += 1
        if problem := complaint(case, answer):
            self.wrong.append(f"{_name(case.operation)}: {problem}")

    def figures(self) -> dict[str, Any]:
        """The counts and failures for the report."""
        return {"requests": self.statuses.total(), "statuses": _counted(self.statuses), "server_errors": len(self.wrong)}


def make_template(folder: Path, bundle: Path | None = None) -> str:
    """Build the data folder that is copied for every role; return its project."""
    if bundle is None:
        bundle = folder / "kitchen.zip"
        write_bundle(reconstruction(), bundle, ExportConfig())
    again = Path(shutil.copyfile(bundle, folder / "again.zip"))
    with zipfile.ZipFile(again, "a") as archive:  # another version: its bytes differ
        archive.comment = b"again"
    with running(folder / "template") as web:
        project = finished_kitchen(web, check_bundle(bundle), bundle, again)
        web.post(f"/api/projects/{project}/comments", {"text": "look", "object": 1}, 201)
        for role in (*ROLES[:3], "somebody"):
            accounts.add(web.context.engine, f"the-{role}", role if role in ROLES else "annotator", PASSWORD)
    return project


@contextmanager
def _started(folder: Path, role: str, run_jobs: bool) -> Iterator[tuple[Running, TestClient]]:
    """The app on a copy of the template, and a client signed in with that role."""
    data = folder / role
    shutil.copytree(folder / "template", data)
    viewer = Viewer(Settings(data_dir=data), fake("viewer"))
    with patch.object(people, "pause", _at_once), running(data, viewer=viewer, run_jobs=run_jobs) as web:
        client = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"}, raise_server_exceptions=False)
        if role != "nobody":
            name = "the-admin" if role == "walk" else f"the-{role}"
            entered = client.post("/api/login", json={"name": name, "password": PASSWORD})
            assert entered.status_code == 204, entered.text
        yield web, client
    shutil.rmtree(data)


async def _at_once(_: float) -> None:
    """No delay after wrong passwords (the app delays them to slow down guessing)."""


def _send_to_each(
    apps: dict[str, tuple[Running, TestClient]], project: str, examples: int, seed: int
) -> tuple[int, dict[str, Answers]]:
    """The number of operations, and each role's responses; the requests are generated once."""
    answers = {role: Answers() for role in apps}
    known = {"project": project, "object": 1, "job": 1, "frame": 7, "version": 1, "comment": 1, "candidate": "c0"}
    known |= {"name": "the-somebody", "side": "plan", "point": 1}
    document = next(iter(apps.values()))[0].app.openapi()
    found = [each.ok() for each in schemathesis.openapi.from_dict(document).get_all_operations()]
    for number, operation in enumerate(sorted(found, key=lambda each: _name(each) in ABOUT_SESSIONS), 1):
        cases = _cases(operation, known, examples, seed)
        for role, (web, client) in apps.items():
            for case in cases:
                answer = send(client, case)
                if answer is not None:
                    answers[role].note(case, answer)
            _forget_others(web, project)
        found_wrong = sum(len(answer.wrong) for answer in answers.values())
        sys.stderr.write(f"{number} {_name(operation)}: {len(cases)} requests, {found_wrong} server errors so far\n")
    return len(found), answers


def _name(operation: Any) -> str:
    return str(operation.definition.raw["operationId"])


def _cases(operation: Any, known: dict[str, Any], examples: int, seed: int) -> list[Any]:
    """Requests to an operation: half of them violate its schema where possible; most target objects that exist."""
    parameters = {p.name for p in operation.path_parameters}
    here = {key: value for key, value in known.items() if key in parameters and _name(operation) not in DELETES} or None
    cases: list[Any] = []
    for mode, until in ((GenerationMode.NEGATIVE, examples // 2), (GenerationMode.POSITIVE, examples)):
        elsewhere = until - len(cases) if here is None else (until - len(cases)) // NOWHERE
        for place, count in ((None, elsewhere), (here, until - len(cases) - elsewhere)):
            if count:
                cases += _made(operation.as_strategy(generation_mode=mode, path_parameters=place), count, seed)
    return cases


def _counted(statuses: Counter[int]) -> dict[str, int]:
    return {str(status): many for status, many in sorted(statuses.items())}


def _forget_others(web: Running, project: str) -> None:
    """Delete the projects that requests created, so that response times do not grow."""
    for other in web.get("/api/projects"):
        if other["id"] != project:
            web.delete(f"/api/projects/{other['id']}")


def _walk(web: Running, client: TestClient, answers: Answers, *, walks: int, seed: int) -> int:
    """Pairs of walks from responses to requests that use them; return how many walks were cut short.

    The available transitions depend on the server's state, but Hypothesis requires walks of one run to be reproducible from the
    same start. So each run is as small as possible: one walk of the simplest choices, and one random walk.
    """
    machine = schemathesis.openapi.from_dict(web.app.openapi()).exclude(operation_id=list(ABOUT_SESSIONS)).as_state_machine()

    class Walk(machine):  # type: ignore[misc,valid-type]
        """One person who sends any request."""

        def call(self, case: Any, **_: Any) -> Response:
            answer = send(client, case)
            hypothesis.assume(answer is not None)
            answers.note(case, answer)
            return Response.from_any(answer)

        def validate_response(self, *_: Any, **__: Any) -> None:
            """No further validation."""

    cut_short = 0
    for number in range(walks):
        try:
            hypothesis.seed(seed + number)(Walk).run(settings=hypothesis.settings(_settings(2), stateful_step_count=STEPS))
        except hypothesis.errors.FlakyStrategyDefinition:  # both walks began alike but received different responses
            cut_short += 1
    return cut_short


def _made(strategy: Any, count: int, seed: int) -> list[Any]:
    """Some requests of a strategy; none where no part of the operation can be invalid."""
    found: list[Any] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(_settings(count))
    @hypothesis.given(strategy)
    def keep(case: Any) -> None:
        found.append(case)

    with suppress(hypothesis.errors.Unsatisfiable):
        keep()
    return found[:count]


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
    """The response to a generated request; None where the client refuses to send it."""
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
    """The fault of a response; empty if there is none."""
    if answer.status_code < 500 or answer.status_code in SAID_IN_ONE_LINE:
        return ""
    asked = f"{case.method} {case.formatted_path} {case.query} {case.headers} {case.body!r}"
    return f"{asked[:2000]} -> {answer.status_code} {answer.text[:300]}"


def _header(value: Any) -> str:
    return str(value).encode("latin-1", "replace").decode("latin-1")


def main() -> int:
    """Send and report; 1 if any response was a server error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=100, help="number per role and operation")
    parser.add_argument("--roles", nargs="+", choices=ROLES, default=list(ROLES))
    parser.add_argument("--walks", type=int, default=16, help="number of pairs of walks")
    parser.add_argument("--seed", type=int, default=0)
    add_options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="r2c2r-any-") as name:
        project = make_template(folder := Path(name))
        sent = send_anything(folder, project, examples=options.examples, seed=options.seed, roles=tuple(options.roles))
        failed = report("any_request", sent, options.json, failed=bool(sent["failures"]))  # saved before the walks begin
        walked = walk_anywhere(folder, walks=options.walks, seed=options.seed)
        return report("any_request_walks", walked, options.json, failed=bool(failed or walked["failures"]))


if __name__ == "__main__":
    sys.exit(main())
