"""Table of each person's effort for each object."""

import csv
import io

import pytest

from app.db.engine import writing
from app.db.tables import Event
from tests.app.conftest import Running


def lines(web: Running, project: str) -> list[dict[str, str]]:
    answer = web.client.get(f"/api/projects/{project}/effort.csv")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/csv")
    assert "attachment" in answer.headers["content-disposition"]
    return list(csv.DictReader(io.StringIO(answer.text)))


def test_clicks_verdicts_and_minutes_are_counted_by_person_and_object(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]

    def event(scope: str, at: float, who: str, object_id: int | None = number, action: str = "x") -> Event:
        return Event(project_id=project, object_id=object_id, scope=scope, action=action, text="x", who=who, at=at)

    with writing(web.context.engine) as session:
        session.add_all([event("prompts", at, "ann") for at in (1000.0, 1030.0, 1060.0)])
        session.add(event("prompts", 5000.0, "ann"))  # after a pause
        session.add(event("prompts", 5001.0, "ann", action="import"))  # from a file: not a click
        session.add(event("review", 1010.0, "bea"))
        session.add(event("comments", 1070.0, "bea", None))
    found = {(line["person"], line["object"]): line for line in lines(web, project)}
    ann = found["ann", "drawer_1"]
    assert (ann["clicks"], ann["verdicts and corrections"], ann["category"]) == ("4", "0", "drawer")
    assert float(ann["minutes"]) == pytest.approx(61 / 60, abs=0.06)
    assert found["bea", "drawer_1"]["verdicts and corrections"] == "1"
    assert (found["bea", ""]["comments"], found["bea", ""]["minutes"]) == ("1", "1.0")


def test_a_name_that_looks_like_a_formula_is_escaped_in_the_csv(web: Running) -> None:
    project = web.sample()
    web.patch(f"/api/projects/{project}", {"name": "=HYPERLINK(1)"})
    assert {line["project"] for line in lines(web, project)} == {"'=HYPERLINK(1)"}
