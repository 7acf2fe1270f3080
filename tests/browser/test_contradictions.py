"""Two clicks on one object are reported beside both once their masks exist, until the contradiction is resolved."""

import re

import pytest
from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext
from tests.browser.test_together import click_frame, pick, rows, sample
from tests.browser.together import Server, signed_in


def test_two_objects_at_the_same_place_are_reported_until_one_is_deleted(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate")
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
    picture(page, "contradiction")
    page.get_by_role("button", name="Delete drawer_3").click()
    expect(said).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(said).to_have_count(2)
    page.get_by_role("button", name="Merge with drawer_2: drawer_3").click()
    expect(rows(page)).to_have_count(3)
    expect(said).to_have_count(0)
    expect(rows(page).last).to_contain_text("2 clicks")
    expect(page.get_by_role("button", name="drawer_2", exact=True)).to_have_attribute("aria-pressed", "true")


def test_a_click_without_a_mask_is_reported_until_it_is_removed(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    page.goto(f"{project}/annotate?frame=3")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)
    expect(rows(page)).to_have_count(3)
    page.goto(f"{project}/annotate?frame=7")
    pick(page, "drawer_2")
    expect(page.get_by_role("button", name="drawer_2", exact=True)).to_have_attribute("aria-pressed", "true")
    said = rows(page).last.locator(".contradicted")
    click_frame(page, 100, 116)
    expect(rows(page).last).to_contain_text("2 clicks")
    expect(said).to_have_text(re.compile("^A click on it found no mask in this frame"))
    picture(page, "click-without-mask")
    page.keyboard.press("Control+z")
    expect(rows(page).last).to_contain_text("1 click")
    expect(said).to_have_count(0)


@pytest.mark.parametrize("live", ["panels"])  # of 0.8 by 1.2 m
def test_a_size_implausible_for_its_category_is_reported_with_a_remedy(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(), server, "ann")
    page.goto(f"{sample(page)}/annotate")
    page.get_by_label("Category of the next object").fill("bottle")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 20, 60)
    expect(rows(page)).to_have_count(3)
    said = rows(page).last.locator(".contradicted")  # in addition to being on the stand-in's one panel
    expect(said.filter(has_text="m wide")).to_contain_text("0.80 m wide")
    expect(said.filter(has_text="m wide")).to_contain_text("click off it where its mask is too large")
    page.get_by_label("Category of bottle_1").fill("drawer")
    page.get_by_label("Category of bottle_1").press("Enter")
    high = said.filter(has_text="m high")
    expect(high).to_contain_text("1.20 m high")
    expect(high).to_contain_text("click each separately; else correct its category")
    picture(page, "doubt")
    page.get_by_label("Category of bottle_1").fill("refrigerator")
    page.get_by_label("Category of bottle_1").press("Enter")
    expect(high).to_have_count(0)
