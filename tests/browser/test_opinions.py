"""Two people annotate one recording independently, and see their agreement."""

import csv
import re
from pathlib import Path

from playwright.sync_api import expect

from tests.browser.looks import picture, scroll_to, serious
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import both, click_frame, ready, rows, sample
from tests.browser.together import Server, post


def test_a_second_opinion_is_requested_given_and_compared(new_context: NewContext, server: Server) -> None:
    ann, bea = both(new_context, server, bypass_csp=True)  # for axe
    project = sample(ann)
    ann.goto(f"{project}/annotate?frame=3")
    ready(ann)
    for x, y in ((30, 60), (120, 90)):
        ann.get_by_role("button", name="New object").click()
        click_frame(ann, x, y)
    expect(rows(ann)).to_have_count(4)
    expect(rows(ann).last).to_contain_text("3 frames")
    post(ann, f"/api/projects/{project.rsplit('/', 1)[-1]}/objects", {"category": "bottle"})  # has no mask

    ann.goto(project)
    section = ann.get_by_role("region", name="Second opinions")
    section.get_by_label("Who gives the second opinion").select_option("bea")
    section.get_by_role("button", name="Ask for a second opinion").press("Enter")
    wait_for_toast(ann, "It is in the inbox of bea.")
    expect(section.get_by_role("listitem")).to_contain_text("Sample kitchen (opinion of bea)")
    scroll_to(section)
    picture(ann, "opinions-overview")
    assert serious(ann, "overview with second opinions") == []

    bea.goto(server.address)
    bea.locator("r2c2r-who").get_by_role("link", name="Inbox").press("Enter")
    bea.get_by_role("link", name="Sample kitchen (opinion of bea)").press("Enter")
    bea.get_by_role("link", name="Click objects").press("Enter")
    ready(bea)
    expect(bea.locator(".object-list")).to_contain_text("Click a drawer, a door or a thing")  # nothing of Ann's
    bea.goto(f"{bea.url.split('?')[0]}?frame=3")
    ready(bea)
    bea.get_by_label("Category of the next object").fill("oven")
    click_frame(bea, 32, 60)
    expect(rows(bea)).to_have_count(1)
    expect(rows(bea).last).to_contain_text("3 frames")

    section.get_by_role("link", name="Compare with Sample kitchen (opinion of bea)").press("Enter")
    expect(ann).to_have_url(re.compile(r"/agreement\?other="))
    facts = ann.locator(".facts")
    expect(facts).to_contain_text("Objects that both have1")
    expect(facts).to_contain_text("Same category0 of 1")
    lines = ann.get_by_role("region", name="Objects").locator("tbody tr")
    expect(lines.last).to_contain_text("drawer_2")
    expect(lines.last).to_contain_text("oven_1")
    expect(lines.last).to_contain_text(re.compile(r"0\.[567]\d"))
    expect(lines.first).to_contain_text("only one has it")
    expect(ann.get_by_text(re.compile("^Not compared, as they have no mask"))).to_be_visible()
    picture(ann, "opinions-agreement")
    assert serious(ann, "agreement") == []
    ann.set_viewport_size({"width": 390, "height": 800})
    assert ann.evaluate("document.documentElement.scrollWidth") <= 390
    ann.set_viewport_size({"width": 1280, "height": 720})
    with ann.expect_download() as waiting:
        ann.get_by_role("link", name="Download as a table").press("Enter")
    told = list(csv.DictReader(Path(waiting.value.path()).read_text().splitlines()))
    assert (told[-1]["first object"], told[-1]["second category"], told[-1]["same category"]) == ("drawer_2", "oven", "no")
    ann.get_by_role("link", name="oven_1").press("Enter")  # opens the other project
    expect(ann.get_by_label("Name of oven_1")).to_be_visible()
