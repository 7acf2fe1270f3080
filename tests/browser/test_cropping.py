"""A thing's crop box: begun around its points, a side dragged and one moved by keys, in prompts.json, undone, taken away."""

from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.nouns import finish
from tests.browser.serving import box_of
from tests.browser.test_journey import picture
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in


def crop(page: Page) -> dict[str, Any] | None:
    """What prompts.json says of the mug's box, once all is saved."""
    expect(page.locator(".stage-tools .chip").nth(1)).to_contain_text("saved")
    project = page.url.split("/p/")[1].split("/")[0]
    file = page.evaluate(f"async () => (await fetch('/api/projects/{project}/prompts.json')).json()")
    box: dict[str, Any] | None = next(entry for entry in file["objects"] if entry["name"] == "mug_1").get("crop")
    assert file["version"] == (3 if box else 1)
    return box


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_crop_box_is_dragged_typed_undone_and_taken_away(browser: Browser, server: Server, theme: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark" if theme == "dark" else "light")
    page = signed_in(context, server, "ann")
    project = sample(page).split("/p/")[1]
    finish(server.data / "projects" / project / "work")  # cameras and depth, as a reading leaves them
    page.get_by_role("link", name="Annotate").click()
    page.get_by_role("button", name="mug_1", exact=True).click()
    page.keyboard.press("g")
    expect(page.locator("r2c2r-object-cloud")).to_contain_text("from")
    page.keyboard.press("s")
    sides = page.locator(".crop-side")
    expect(sides).to_have_count(6)
    assert crop(page) is None  # nothing is stored before something is set
    right = page.get_by_role("slider", name="Right side of the crop box")
    before = int(right.get_attribute("aria-valuenow") or 0)
    box = box_of(right)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=5)
    page.mouse.up()
    wider = int(right.get_attribute("aria-valuenow") or 0)
    assert wider > before
    dragged = crop(page)
    assert dragged is not None
    picture(page, f"crop-box-{theme}")

    top = page.get_by_role("slider", name="Top of the crop box")
    tall = int(top.get_attribute("aria-valuenow") or 0)
    top.focus()
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowUp")
    expect(top).to_have_attribute("aria-valuenow", str(tall + 11))
    page.wait_for_timeout(500)  # keys pressed one after the other are one change
    typed = crop(page)
    assert typed is not None
    assert typed != dragged
    page.keyboard.press("Control+z")
    expect(top).to_have_attribute("aria-valuenow", str(tall))
    assert crop(page) == dragged
    page.keyboard.press("Escape")
    expect(sides).to_have_count(0)
    page.get_by_role("button", name="Take it away").click()
    expect(page.get_by_role("button", name="Take it away")).to_have_count(0)
    assert crop(page) is None
    context.close()
