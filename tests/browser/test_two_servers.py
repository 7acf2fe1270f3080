"""Two people on one project, each at a different server, with rows in one Postgres and files in one store."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from app.db.engine import opened
from app.services import accounts
from tests.app import postgres
from tests.browser.looks import picture
from tests.browser.serving import NewContext
from tests.browser.test_together import click_frame, rows, sample
from tests.browser.together import PASSWORD, PEOPLE, Server, signed_in
from tests.ports import free_port


class Beside(Server):
    """One of several servers on the environment's database, whose accounts exist already."""

    def __init__(self, data: Path) -> None:
        data.mkdir()
        self.data, self.port, self.live, self.scenes = data, free_port(), "live", False
        self._clients = {}


@pytest.fixture
def two(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Server, Server]]:
    with postgres.server() as found:
        address = found.of_folder(tmp_path)
        with opened(address) as engine:
            for name, role in PEOPLE.items():
                accounts.add(engine, name, role, PASSWORD)
        monkeypatch.setenv("R2C2R_DATABASE", address)
        monkeypatch.setenv("R2C2R_STORE", f"file://{tmp_path / 'store'}")
        with Beside(tmp_path / "a") as a, Beside(tmp_path / "b") as b:
            yield a, b


def test_people_at_two_servers_see_each_other_clicks_and_runs(new_context: NewContext, two: tuple[Server, Server]) -> None:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")
    contexts = [new_context() for _ in two]
    ann, bea = (signed_in(*given) for given in zip(contexts, two, ("ann", "bea"), strict=True))
    path = sample(ann).removeprefix(two[0].address)
    ann.goto(f"{two[0].address}{path}/annotate")
    bea.goto(f"{two[1].address}{path}/annotate")
    expect(ann.locator("r2c2r-presence .chip")).to_contain_text("bea")
    expect(bea.locator("r2c2r-presence .chip")).to_contain_text("ann")
    expect(rows(bea)).to_have_count(2)
    click_frame(ann, 40, 60)
    expect(rows(bea)).to_have_count(3)
    expect(rows(bea).last).to_contain_text(re.compile("3 frames|3 of"))
    picture(bea, "26-two-servers")
    bea.goto(f"{two[1].address}{path}/run")
    ann.goto(f"{two[0].address}{path}/run")
    bea.get_by_role("button", name=re.compile("^Run")).first.click()
    expect(ann.get_by_text("done").first).to_be_visible()
    picture(ann, "27-a-run-of-another-server")
    two[0].kill()
    expect(bea.locator("r2c2r-presence .chip")).to_have_count(0)  # she has left
    two[0].start()
