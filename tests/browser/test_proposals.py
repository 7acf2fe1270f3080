"""Confirmation of proposals in a real Chromium."""

import re

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import click_frame, rows, sample
from tests.browser.together import Server, signed_in


def test_proposals_are_confirmed_undone_and_dismissed_by_key(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(), server, "ann")
    page.goto(f"{sample(page)}/annotate")
    proposals = page.get_by_label("Proposals", exact=True)
    expect(proposals).to_contain_text("Y confirms")  # all were found
    rows = proposals.get_by_role("listitem")
    expect(rows).to_have_count(3)
    objects = page.locator("r2c2r-object-list")
    heads = objects.locator(".object-list > li")
    expect(heads).to_have_count(2)

    page.keyboard.press("y")  # nothing is highlighted: shown, not confirmed
    expect(rows.first).to_have_class("current")
    expect(rows).to_have_count(3)
    picture(page, "12-proposals")
    page.keyboard.press("y")
    expect(rows).to_have_count(2)
    expect(rows.first).to_have_class("current")  # the next one
    expect(heads).to_have_count(3)
    expect(heads.last).to_contain_text(re.compile(r"1 click · \d+ frames"))
    picture(page, "13-proposal-confirmed")

    page.keyboard.press("Control+z")
    wait_for_toast(page, "Undone: confirmed proposal")
    expect(rows).to_have_count(3)

    page.keyboard.press("n")
    page.keyboard.press("x")
    expect(rows).to_have_count(2)
    restore = page.get_by_role("button", name="Bring back 1 dismissed")
    expect(restore).to_be_visible()
    page.reload()  # stored
    expect(restore).to_be_visible()
    restore.click()
    expect(rows).to_have_count(3)

    page.get_by_label("Least confidence").select_option("0.5")
    expect(proposals.get_by_role("button", name="Confirm 2")).to_be_visible()
    page.keyboard.press("n")
    page.keyboard.press("Shift+Y")
    expect(heads).to_have_count(4)
    expect(rows).to_have_count(1)
    expect(objects).not_to_contain_text("finding it")
    picture(page, "15-all-confirmed")


def test_confirming_all_skips_doubtful_proposals(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(viewport={"width": 1280, "height": 1000}), server, "ann")
    page.goto(f"{sample(page)}/annotate?frame=3")
    proposals = page.get_by_label("Proposals", exact=True)
    expect(proposals.get_by_role("button", name="Confirm 2")).to_be_visible()  # of at least 80 %
    page.get_by_role("button", name="New object").click()
    click_frame(page, 38, 60)  # its mask covers a part of the first drawer's
    expect(rows(page)).to_have_count(3)
    page.keyboard.press("Escape")
    expect(proposals.get_by_role("button", name="Confirm 1")).to_be_visible()
    expect(proposals).to_contain_text("1 proposal left out, to be looked at one by one: drawer shares")
    picture(page, "proposal-left-out")
    page.keyboard.press("Shift+Y")
    expect(rows(page)).to_have_count(4)
    expect(proposals.get_by_role("listitem")).to_have_count(2)


def test_an_object_takes_the_category_of_the_proposal_clicked_unless_one_is_typed(
    new_context: NewContext, server: Server
) -> None:
    page = signed_in(new_context(viewport={"width": 1280, "height": 1000}), server, "ann")
    page.goto(f"{sample(page)}/annotate?frame=3")
    proposals = page.get_by_label("Proposals", exact=True)
    expect(proposals.get_by_role("listitem")).to_have_count(3)
    page.get_by_role("button", name="New object").click()
    click_frame(page, 98, 62)
    expect(rows(page)).to_have_count(3)
    expect(rows(page).last).to_contain_text("bottle")
    expect(proposals.get_by_role("listitem")).to_have_count(2)  # it is this object now
    picture(page, "proposal-clicked")
    page.get_by_label("Category of the next object").fill("oven")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 62, 58)
    expect(rows(page)).to_have_count(4)
    expect(rows(page).last).to_contain_text("oven")
    make = page.get_by_role("button", name=re.compile("^Make it a wall cabinet: oven"))  # its size is one of those
    make.click()
    expect(page.get_by_label("Category of oven")).to_have_value("wall_cabinet")
    expect(make).to_have_count(0)
