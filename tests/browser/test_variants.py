"""Variants on the download page: requested, followed, cancelled, downloaded and deleted by keyboard alone."""

import json

from playwright.sync_api import expect

from tests.browser.serving import NewContext
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in


def test_variants_are_requested_by_keyboard_with_their_size_shown_before(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "cleo")
    project = sample(page)
    folder = server.data / "projects" / project.split("/p/")[1]
    page.goto(f"{project}/run")
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.get_by_role("link", name="Download").last).to_be_visible()
    (folder / "behave.json").write_text(json.dumps({"vary": "hang"}))
    page.goto(f"{project}/download")
    count, make = page.get_by_label("How many"), page.get_by_role("button", name="Make variants")
    expect(page.get_by_text("to download")).to_be_visible()
    count.fill("1001")
    expect(page.get_by_text("At most 1000 at a time")).to_be_visible()
    expect(make).to_be_disabled()
    count.fill("2")
    page.keyboard.press("Tab")
    page.keyboard.type("7")  # replaces the 0 before it
    page.keyboard.press("Enter")
    stop = page.get_by_role("button", name="Cancel")
    stop.focus()
    expect(page.get_by_role("progressbar", name="Progress")).to_have_js_property("value", 0.5)
    expect(stop).to_be_focused()  # though the surrounding page is rebuilt
    page.keyboard.press("Enter")
    expect(page.locator("r2c2r-job")).to_contain_text("cancelled")
    expect(count).to_have_value("2")  # the page around it was rebuilt
    (folder / "behave.json").unlink()
    page.get_by_role("button", name="Try again").press("Enter")
    made = page.get_by_role("list", name="Variants that were made").get_by_role("listitem")
    expect(made).to_contain_text("2 variants of bundle 1, seed 7")
    expect(made).to_contain_text("2 of 2 checked are certified")
    expect(make).to_be_disabled()  # they exist already
    with page.expect_download() as taken:
        made.get_by_role("link", name="Download").press("Enter")
    assert taken.value.suggested_filename == "sample-kitchen-v1-n2-s7-variants.zip"
    page.get_by_role("button", name="Delete 2 variants").press("Enter")
    expect(made).to_have_count(0)
    expect(make).to_be_enabled()
