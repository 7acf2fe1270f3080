"""Lists of many objects and projects are searched, ordered, and keep their heads in sight."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.test_journey import picture
from tests.browser.test_together import rows, sample
from tests.browser.together import Server, signed_in


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with Server(tmp_path) as running:
        yield running


def post(page: Page, path: str, body: dict[str, str]) -> None:
    script = """async ([path, body]) => {
      const headers = { "content-type": "application/json", "x-requested-with": "r2c2r" };
      return (await fetch(path, { method: "POST", headers, body: JSON.stringify(body) })).status;
    }"""
    assert page.evaluate(script, [path, body]) in (201, 202)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_many_objects_are_searched_and_new_object_stays_in_sight(browser: Browser, server: Server, theme: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark" if theme == "dark" else "light")
    page = signed_in(context, server, "ann")
    project = sample(page)
    for number in range(14):
        category = "wall_cabinet" if number % 2 else "bottle"
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": category})
    page.goto(f"{project}/annotate")
    expect(rows(page)).to_have_count(16)
    page.locator(".objects-pane").evaluate("pane => pane.scrollTo(0, 600)")
    expect(page.get_by_role("button", name="New object")).to_be_in_viewport()
    page.get_by_label("Find objects").fill("wall")
    expect(rows(page)).to_have_count(7)
    expect(rows(page).first).to_be_in_viewport()
    expect(page.locator(".find")).to_contain_text("7 of 16")
    expect(rows(page).first.locator(".badge")).to_have_text("4")  # the number it has on the picture
    picture(page, f"many-objects-{theme}")
    page.get_by_label("Find objects").fill("")
    expect(rows(page)).to_have_count(16)
    context.close()


def test_projects_are_searched_and_ordered(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = signed_in(context, server, "ann")
    for name in ("Cellar", "Attic", "Bath", "Attic two"):
        post(page, "/api/projects/sample", {"name": name})
    names = page.locator(".card h2 a")
    expect(names).to_have_count(4)
    page.get_by_label("Order of the projects").select_option("name")
    expect(names).to_have_text(["Attic", "Attic two", "Bath", "Cellar"])
    page.get_by_label("Find projects").fill("attic")
    expect(names).to_have_text(["Attic", "Attic two"])
    picture(page, "many-projects")
    context.close()
