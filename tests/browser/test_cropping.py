"""Crop box of an object: initialised around its points, changed by drag and keys, stored in prompts.json, undone, removed."""

from contextlib import AbstractContextManager
from typing import Any

from playwright.sync_api import Page, expect

from tests.app.nouns import finish
from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of
from tests.browser.test_together import ready, sample
from tests.browser.together import Server, signed_in


def crop(page: Page) -> dict[str, Any] | None:
    """The mug's crop box in prompts.json, once all is saved."""
    expect(page.locator(".transport .chip").nth(1)).to_contain_text("saved")
    project = page.url.split("/p/")[1].split("/")[0]
    file = page.evaluate(f"async () => (await fetch('/api/projects/{project}/prompts.json')).json()")
    box: dict[str, Any] | None = next(entry for entry in file["objects"] if entry["name"] == "mug_1").get("crop")
    assert file["version"] == (3 if box else 1)
    return box


def changed(page: Page) -> AbstractContextManager[object]:
    """Wait until the server has accepted the change made within the block."""
    return page.expect_response(lambda answer: answer.request.method == "PATCH" and answer.ok)


def test_a_crop_box_is_dragged_typed_undone_and_removed(new_context: NewContext, server: Server) -> None:
    context = new_context()
    context.clock.install()
    page = signed_in(context, server, "ann")
    address = sample(page)
    project = address.split("/p/")[1]
    finish(server.data / "projects" / project / "work")  # cameras and depth, as after reading the recording
    page.goto(f"{address}/annotate")
    ready(page)
    page.get_by_role("button", name="mug_1", exact=True).click()
    page.keyboard.press("g")
    expect(page.locator("r2c2r-object-cloud")).to_contain_text("from")
    page.keyboard.press("s")
    sides = page.locator(".crop-side")
    expect(sides).to_have_count(6)
    assert crop(page) is None  # nothing is stored before a first change
    right = page.get_by_role("slider", name="Right side of the crop box")
    before = int(right.get_attribute("aria-valuenow") or 0)
    box = box_of(right)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=5)
    with changed(page):
        page.mouse.up()
    wider = int(right.get_attribute("aria-valuenow") or 0)
    assert wider > before
    dragged = crop(page)
    assert dragged is not None
    picture(page, "crop-box")

    top = page.get_by_role("slider", name="Top of the crop box")
    tall = int(top.get_attribute("aria-valuenow") or 0)
    top.focus()
    context.clock.pause_at(page.evaluate("Date.now()") / 1000 + 60)
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowUp")  # presses in a row are one change, however slow the machine is
    expect(top).to_have_attribute("aria-valuenow", str(tall + 11))
    with changed(page):
        context.clock.resume()
    typed = crop(page)
    assert typed is not None
    assert typed != dragged
    page.keyboard.press("Control+z")
    expect(top).to_have_attribute("aria-valuenow", str(tall))
    assert crop(page) == dragged
    page.keyboard.press("Escape")
    expect(sides).to_have_count(0)
    with changed(page):
        page.get_by_role("button", name="Remove box").click()
    expect(page.get_by_role("button", name="Remove box")).to_have_count(0)
    assert crop(page) is None
