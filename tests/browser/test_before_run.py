"""The Run page reports, before a run is started, problems that would spoil it."""

from playwright.sync_api import expect

from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext
from tests.browser.test_together import click_frame, ready, rows, sample
from tests.browser.together import Server, post, signed_in

SAME = {"frame": 3, "x": 30.5, "y": 90.5, "label": 1}  # at the same place as the click on drawer_2


def test_objects_that_would_spoil_a_run_are_listed_before_it(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(bypass_csp=True), server, "ann")
    project = sample(page)
    page.goto(f"{project}/annotate?frame=3")
    ready(page)
    page.goto(f"{project}/run")
    expect(page.get_by_text("2 objects.")).to_be_visible()
    before = page.get_by_role("region", name="Before the run")
    expect(before).to_be_hidden()  # no problem
    page.goto(f"{project}/annotate?frame=3")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 30, 90)
    expect(rows(page)).to_have_count(3)
    post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "bottle"})
    post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "mug", "points": [SAME]})
    expect(rows(page).last).to_contain_text("3 frames")
    page.get_by_role("link", name="Run", exact=True).click()
    expect(before.get_by_role("heading")).to_have_text("Fix this before the run")
    told = before.get_by_role("listitem")
    expect(told).to_have_count(2)
    expect(told.first).to_contain_text("bottle_1: Has no click yet")
    expect(told.last).to_contain_text("drawer_2: On the same thing as mug_2 (90 % shared): merge or delete one")
    assert serious(page, "before the run") == []
    picture(page, "before-run")
    told.last.get_by_role("link").click()
    expect(rows(page).nth(2)).to_contain_text("On the same thing as mug_2")
