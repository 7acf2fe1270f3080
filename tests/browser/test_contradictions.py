"""Two clicks on one thing are said beside both objects as soon as their masks are there, and no more once that is mended."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.test_journey import picture
from tests.browser.test_together import click_frame, rows, sample
from tests.browser.together import Server, signed_in


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with Server(tmp_path) as running:
        yield running


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_second_object_on_the_same_thing_is_said_until_it_is_deleted(browser: Browser, server: Server, theme: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark" if theme == "dark" else "light")
    page = signed_in(context, server, "ann")
    sample(page)
    page.get_by_role("link", name="Annotate").click()
    said = page.locator(".contradicted")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)
    expect(rows(page)).to_have_count(3)
    page.get_by_role("button", name="New object").click()
    click_frame(page, 102, 41)
    expect(rows(page)).to_have_count(4)
    expect(said).to_have_count(2)
    expect(said.first).to_contain_text("On the same thing as drawer_3")
    picture(page, f"contradiction-{theme}")
    page.get_by_role("button", name="Delete drawer_3").click()
    expect(said).to_have_count(0)
    context.close()
