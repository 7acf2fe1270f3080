"""The object over its photos in Review: outlined, filling the picture, with the comments that were pinned on it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.app.nouns import finish
from tests.browser.test_journey import picture
from tests.browser.test_together import pick, ready, sample, say
from tests.browser.together import Server, signed_in


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with Server(tmp_path) as running:
        yield running


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_object_fills_the_picture_and_its_comments_are_pins(browser: Browser, server: Server, theme: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark" if theme == "dark" else "light")
    page = signed_in(context, server, "ann")
    project = sample(page)
    finish(server.data / "projects" / project.split("/p/")[1] / "work")
    page.goto(f"{project}/annotate?frame=3")
    ready(page)
    pick(page, "drawer_1")
    page.keyboard.press("g")
    expect(page.locator(".object-list .current")).to_contain_text("3 frames")
    number = page.evaluate("new URLSearchParams(location.search).get('object')")
    page.goto(f"{project}/review?object={number}")
    expect(page.get_by_role("button", name="Outline")).to_have_attribute("aria-pressed", "true")
    sheet = page.locator("r2c2r-photo-check .sheet")
    near = sheet.bounding_box()
    page.get_by_role("button", name="Photo", exact=True).click()
    whole = sheet.bounding_box()
    room = page.locator("r2c2r-photo-check .pictures").bounding_box()
    assert near is not None
    assert whole is not None
    assert room is not None
    assert near["width"] > 2 * whole["width"]  # the drawer is a twelfth of the photo
    assert whole["width"] <= room["width"] + 1
    assert whole["height"] <= room["height"] + 1
    at = whole["x"] + whole["width"] * 0.5, whole["y"] + whole["height"] * 0.25
    page.mouse.dblclick(*at)
    say(page, "Comment", "a scratch")
    pin = page.locator("r2c2r-photo-check .pin")
    expect(pin).to_have_count(1)
    shown = pin.bounding_box()
    assert shown is not None
    assert shown["x"] + shown["width"] / 2 == pytest.approx(at[0], abs=2)
    assert shown["y"] + shown["height"] / 2 == pytest.approx(at[1], abs=2)
    picture(page, f"photo-check-{theme}")
    context.close()
