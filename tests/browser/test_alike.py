"""Many similar objects: selection of similar ones by keyboard, and a common name in the order of their positions."""

from collections.abc import Callable
from functools import partial

from playwright.sync_api import expect

from tests.browser.looks import picture, scroll_to, serious
from tests.browser.serving import NewContext
from tests.browser.test_together import rows, sample
from tests.browser.together import Server, post, signed_in
from tests.waiting import until

# half a metre wide and 20 cm high, like the proposals
CORNERS = [[0.6, 2.0, 0.8], [1.1, 2.0, 0.8], [1.1, 2.0, 0.6], [0.6, 2.0, 0.6]]


def test_proposals_similar_to_an_object_are_listed_and_confirmed(new_context: NewContext, server: Server) -> None:
    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "cleo")
    project = sample(page)
    page.goto(f"{project}/annotate?frame=3")
    proposals = page.get_by_label("Proposals", exact=True)
    shown = proposals.get_by_role("listitem")
    expect(shown).to_have_count(3)
    front = {"corners_m": CORNERS, "handle": None, "hinge": None}
    post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "pull_out", "front": front})
    expect(page.locator(".object-list")).to_contain_text("drawn · 3 frames")

    page.get_by_role("button", name="drawer_1", exact=True).click()
    page.keyboard.press("j")
    expect(proposals.get_by_role("heading")).to_have_text("Like drawer_1 (2)")
    expect(proposals).to_contain_text("By category: it has no flat front to compare.")
    page.keyboard.press("Escape")
    expect(proposals.get_by_role("heading")).to_have_text("Proposals (3)")

    page.get_by_role("button", name="pull_out_1", exact=True).click()
    page.get_by_role("button", name="Find the ones like this").press("Enter")
    expect(proposals.get_by_role("heading")).to_have_text("Like pull_out_1 (2)")
    expect(shown.first).to_contain_text("50 % alike")
    expect(shown.first).to_have_class("current")
    scroll_to(proposals)
    picture(page, "alike")
    assert serious(page, "alike") == []
    answers: list[Callable[[], None]] = []
    page.route("**/proposals/confirm", lambda route: answers.append(partial(route.fulfill, response=route.fetch())))
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="pull_out_2", exact=True)).to_be_visible()
    expect(proposals.get_by_role("heading")).to_have_text("Like pull_out_1 (1)")
    page.keyboard.press("Control+z")  # of the confirmation, whose response is still pending
    until(lambda: page.title() and answers, "no response")  # calls to the page deliver what was routed
    answers.pop()()
    page.unroute("**/proposals/confirm")
    expect(rows(page)).to_have_count(3)
    expect(page.get_by_role("button", name="pull_out_1", exact=True)).to_be_visible()
    expect(proposals.get_by_role("heading")).to_have_text("Like pull_out_1 (2)")

    page.get_by_label("Least confidence").select_option("50 % alike")
    page.locator("r2c2r-frame-canvas canvas").focus()
    page.keyboard.press("Shift+Enter")
    expect(page.get_by_role("button", name="pull_out_3", exact=True)).to_be_visible()
    expect(proposals).to_contain_text("No proposal is like pull_out_1.")
    page.get_by_role("button", name="All proposals").click()
    expect(proposals.get_by_role("heading")).to_have_text("Proposals (1)")


def test_selected_objects_are_numbered_left_to_right_and_top_down(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "cleo")
    project = sample(page)
    page.goto(f"{project}/annotate?frame=3")
    expect(page.get_by_label("Proposals", exact=True).get_by_role("listitem")).to_have_count(3)
    for across, down in ((0.6, 0.0), (0.0, 0.3), (0.0, 0.0)):  # made in reverse order
        corners = [[x + across, y, z - down] for x, y, z in CORNERS]
        front = {"corners_m": corners, "handle": None, "hinge": None}
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "flap", "front": front})
    expect(page.locator(".object-list").get_by_text("drawn · 3 frames")).to_have_count(3)
    page.get_by_role("button", name="flap_1", exact=True).click(modifiers=["Control"])
    page.get_by_role("button", name="flap_3", exact=True).click(modifiers=["Shift"])
    page.get_by_label("Name for all, numbered").fill("door")
    page.get_by_label("Name for all, numbered").press("Enter")
    expect(page.locator(".object-list .pick")).to_have_text(["drawer_1", "mug_1", "door_3", "door_2", "door_1"])
    picture(page, "numbered")
