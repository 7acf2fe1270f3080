"""Confirming what was found without a click, in a real Chromium."""

import re
from pathlib import Path

from playwright.sync_api import Page, expect

from tests.browser.serving import wait_for_toast
from tests.browser.test_journey import LONG_MS, picture


def test_a_key_confirms_the_next_proposal_undo_takes_it_back_and_another_dismisses(
    page: Page, address: str, sample: Path
) -> None:
    page.goto(address)
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import a scan").first.click()
    chooser.value.set_files(sample / "scan.r3d")
    page.wait_for_url(re.compile(r"/p/\w+"))
    page.get_by_role("link", name="Click objects").wait_for(timeout=LONG_MS)
    page.get_by_role("link", name="Annotate").click()
    proposals = page.get_by_label("Proposals", exact=True)
    expect(proposals).to_contain_text("They appear once the scan is prepared")
    picture(page, "11-proposals-empty")
    expect(proposals).to_contain_text("Y confirms", timeout=LONG_MS)  # all were found
    rows = proposals.get_by_role("listitem")
    count = rows.count()
    assert count >= 5
    objects = page.locator("r2c2r-object-list")

    page.keyboard.press("y")  # nothing is highlighted: shown, not confirmed
    expect(rows.first).to_have_class("current")
    expect(rows).to_have_count(count)
    picture(page, "12-proposals")
    page.keyboard.press("y")
    expect(rows).to_have_count(count - 1)
    expect(rows.first).to_have_class("current")  # the next one
    expect(objects.locator(".head")).to_have_count(1, timeout=LONG_MS)
    expect(objects).to_contain_text(re.compile(r"1 click · \d+ frames"), timeout=LONG_MS)
    picture(page, "13-proposal-confirmed")

    page.keyboard.press("Control+z")
    wait_for_toast(page, "Undone: confirmed proposal")
    expect(rows).to_have_count(count, timeout=LONG_MS)

    page.keyboard.press("n")
    page.keyboard.press("x")
    expect(rows).to_have_count(count - 1)
    restore = page.get_by_role("button", name="Bring back 1 dismissed")
    expect(restore).to_be_visible(timeout=LONG_MS)
    page.reload()  # remembered
    expect(restore).to_be_visible(timeout=LONG_MS)
    restore.click()
    expect(rows).to_have_count(count, timeout=LONG_MS)

    page.get_by_label("Least confidence").select_option("0.5")
    sure = int(proposals.get_by_role("button", name=re.compile(r"^Confirm \d+$")).inner_text().split()[1])
    assert sure >= 5
    page.emulate_media(color_scheme="dark")
    page.keyboard.press("n")
    picture(page, "14-proposals-dark")
    page.keyboard.press("Shift+Y")
    expect(objects.locator(".object-list > li")).to_have_count(sure, timeout=LONG_MS)
    expect(rows).to_have_count(count - sure, timeout=LONG_MS)
    expect(objects).not_to_contain_text("finding it", timeout=LONG_MS)
    picture(page, "15-all-confirmed-dark")
