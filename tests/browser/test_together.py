"""Two people on one project, from the first click to the approval, including failures and conflicts."""

import json
import re
from typing import Any

from playwright.sync_api import Locator, Page, expect

from tests.app.nouns import finish
from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.together import Server, ask, post, signed_in
from tests.waiting import until

FRAME = (160, 120)
STUCK_X = 158  # the stand-in segmenter draws one frame there and blocks


def both(new_context: NewContext, server: Server, **looks: Any) -> tuple[Page, Page]:
    """A page of Ann's and one of Bea's."""
    return signed_in(new_context(**looks), server, "ann"), signed_in(new_context(**looks), server, "bea")


def sample(page: Page) -> str:
    """Create a sample project; return the address of its overview, once its recording is read."""
    project = ask(page, "POST", "/api/projects/sample", {})["id"]
    until(lambda: ask(page, "GET", f"/api/projects/{project}")["status"] == "ready")
    return f"{page.evaluate('location.origin')}/p/{project}"


def click_frame(page: Page, x: float, y: float, *, button: str = "left") -> None:
    at: Any = on_canvas(page, x, y)
    page.locator("r2c2r-frame-canvas canvas").click(position=at, button=button)  # type: ignore[arg-type]


def tap_frame(page: Page, x: float, y: float) -> None:
    at: Any = on_canvas(page, x, y)
    page.locator("r2c2r-frame-canvas canvas").tap(position=at)


def on_canvas(page: Page, x: float, y: float) -> dict[str, float]:
    """Canvas position of a pixel of the stored frame."""
    box = box_of(page.locator("r2c2r-frame-canvas canvas"))
    scale = min(box["width"] / FRAME[0], box["height"] / FRAME[1])
    left, top = (box["width"] - FRAME[0] * scale) / 2, (box["height"] - FRAME[1] * scale) / 2
    return {"x": left + x * scale, "y": top + y * scale}


def rows(page: Page) -> Locator:
    return page.locator(".object-list > li")


def pick(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def rename(page: Page, name: str, to: str) -> None:
    pick(page, name)
    page.get_by_label(f"Name of {name}").fill(to)
    page.get_by_label(f"Name of {name}").press("Enter")


def stored(page: Page) -> None:
    """Wait until the server has accepted every change of this page: its outbox is empty."""
    page.wait_for_function("Object.keys(localStorage).every((name) => !name.startsWith('r2c2r-change'))")


def ready(page: Page) -> None:
    page.locator(".chip", has_text=re.compile("^ready$")).wait_for()


def test_clicks_survive_undo_conflicts_lost_connections_and_server_crashes(new_context: NewContext, own_server: Server) -> None:
    people = ann, bea = both(new_context, own_server)
    project = sample(ann)
    ann.goto(f"{project}/annotate?frame=3")
    ready(ann)

    # a wrong click, undone; a propagation, stopped
    click_frame(ann, 30, 60)
    expect(rows(ann)).to_have_count(3)
    click_frame(ann, 100, 100, button="right")
    expect(rows(ann).last).to_contain_text("2 clicks")
    ann.keyboard.press("Control+z")
    expect(rows(ann).last).to_contain_text("1 click ")
    ann.keyboard.press("Control+Shift+z")
    expect(rows(ann).last).to_contain_text("2 clicks")
    ann.keyboard.press("Control+z")
    ann.keyboard.press("Enter")
    click_frame(ann, STUCK_X, 60)
    ann.get_by_role("button", name=re.compile("^Stop finding")).click()
    expect(rows(ann).last).to_contain_text("stopped after")
    ann.reload()
    expect(rows(ann)).to_have_count(4)
    expect(rows(ann).nth(2)).to_contain_text("1 click ")

    # presence of others; concurrent renames, one of them offline
    bea.goto(f"{project}/annotate?frame=3")
    expect(ann.locator("r2c2r-presence")).to_contain_text("bea · annotate")
    expect(bea.locator("r2c2r-presence")).to_contain_text("ann · annotate")
    ann.context.set_offline(True)
    rename(ann, "mug_1", "cup_of_ann")
    expect(ann.locator(".banner")).to_contain_text("1 change not stored yet")
    rename(bea, "mug_1", "cup_of_bea")
    expect(bea.get_by_role("button", name="cup_of_bea", exact=True)).to_be_visible()
    ann.context.set_offline(False)
    merge = ann.get_by_role("dialog", name=re.compile("changed twice"))
    expect(merge).to_contain_text("cup_of_bea")
    picture(ann, "16-merge")
    merge.get_by_role("button", name="Keep what is chosen").click()
    for page in people:
        expect(page.get_by_role("button", name="cup_of_ann", exact=True)).to_be_visible()

    # a name typed while somebody else renames the object
    pick(bea, "cup_of_ann")
    field = bea.get_by_label("Name of cup_of_ann")
    field.fill("glass_of_bea")
    rename(ann, "cup_of_ann", "glass_of_ann")
    expect(bea.get_by_role("img", name=re.compile("^glass_of_ann: seen"))).to_be_visible()  # her tab knows it
    field.press("Enter")
    merge = bea.get_by_role("dialog", name=re.compile("changed twice"))
    expect(merge).to_contain_text("glass_of_ann")
    merge.get_by_role("button", name="Leave theirs").click()
    for page in people:
        expect(page.get_by_role("button", name="glass_of_ann", exact=True)).to_be_visible()

    # a lock holds for both
    ann.get_by_role("button", name="Lock glass_of_ann").click()
    bea.get_by_role("button", name="Unlock glass_of_ann").wait_for()
    bea.get_by_role("button", name="Delete glass_of_ann").click()
    wait_for_toast(bea, "1 locked object left out: glass_of_ann (by ann)")
    pick(bea, "glass_of_ann")
    click_frame(bea, 100, 30)
    wait_for_toast(bea, "glass_of_ann is locked by ann")
    bea.get_by_role("button", name="Unlock glass_of_ann").click()
    ann.get_by_role("button", name="Lock glass_of_ann").wait_for()

    # the server dies; later clicks are sent once it is back, even from a page that was closed
    stored(ann)
    own_server.kill()
    pick(ann, "drawer_1")
    click_frame(ann, 60, 60)
    click_frame(ann, 60, 90, button="right")
    expect(ann.locator(".banner")).to_contain_text("2 changes not stored yet")
    context = ann.context
    ann.close()
    own_server.start()
    again = context.new_page()
    again.goto(f"{project}/annotate?frame=3")
    expect(rows(again).first).to_contain_text("3 clicks")
    expect(rows(bea).first).to_contain_text("3 clicks")
    stored(again)


def test_two_people_take_a_project_from_draft_to_approval(new_context: NewContext, server: Server) -> None:
    people = ann, bea = both(new_context, server)
    bea.goto(server.address)
    project = sample(ann)
    folder = server.data / "projects" / project.rsplit("/", 1)[-1]

    # a cancelled run, a failed one, and a successful one
    told = folder / "behave.json"
    told.write_text(json.dumps({"align": "hang"}))
    ann.goto(f"{project}/run")
    ann.get_by_role("button", name="Run", exact=True).click()
    expect(ann.locator("r2c2r-job li", has_text="align")).to_contain_text("running")
    ann.get_by_role("button", name="Cancel").click()
    expect(ann.locator("r2c2r-job")).to_contain_text("cancelled")
    told.write_text(json.dumps({"align": "fail"}))
    ann.get_by_role("button", name="Try again").click()
    expect(ann.locator("r2c2r-job")).to_contain_text("no frame shows drawer_1")
    ann.get_by_role("button", name="Show the log").click()
    expect(ann.get_by_label("Log")).to_contain_text("a traceback that a person may want to read")
    picture(ann, "17-failed")
    told.unlink()
    finish(folder / "work")
    ann.get_by_role("button", name="Try again").click()
    expect(ann.get_by_role("heading", name=re.compile("Certificate"))).to_contain_text("passed")

    # a comment on a point of a frame
    ann.goto(f"{project}/annotate?frame=3")
    ready(ann)
    ann.keyboard.press("i")
    click_frame(ann, 90, 40)
    say(ann, "Comment", "is this one drawer or two?")
    expect(ann.locator("r2c2r-comments")).to_contain_text("1 open comment")

    # to review, back, and again: reasons are required for unmet requirements and refusals
    ann.goto(f"{project}/review")
    viewed(ann)
    post(ann, f"/api/projects/{folder.name}/objects", {"category": "bottle"})  # which has no clicks
    move(ann, "Send to review", "the bottle is not there")
    expect(bea.get_by_text("ready", exact=True)).to_be_visible()  # the list of projects updates itself
    bea.goto(f"{project}/review")
    viewed(bea)
    move(bea, "Start the review")
    asks = "button => (button.click(), document.querySelector('dialog[open]') !== null)"
    assert bea.get_by_role("button", name="Request changes", exact=True).evaluate(asks)  # what is typed next is the reason
    say(bea, "Request changes", "answer the comment")
    expect(ann.locator("r2c2r-review-state")).to_contain_text("answer the comment")
    ann.get_by_role("button", name=re.compile("^Resolve")).click()
    expect(ann.locator("r2c2r-comments")).to_contain_text("No open comments.")  # rebuilt together with the steps
    expect(ann.locator("r2c2r-review-state")).not_to_contain_text("open comment")
    move(ann, "Send to review again", "one drawer")
    move(bea, "Start the review")
    bea.get_by_role("button", name="drawer_1").first.click()
    bea.keyboard.press("v")
    bea.keyboard.press("]")
    expect(bea.get_by_label("Turn (°)")).to_have_value("1")
    bea.keyboard.press("Escape")
    expect(bea.get_by_label("Turn (°)")).to_have_value("0")
    expect(bea.get_by_role("button", name="Use this place and size")).to_be_disabled()
    bea.keyboard.press("l")
    expect(bea.get_by_label("Right (mm)")).to_have_value("5")  # changed by a key: shown over the photo, not stored yet
    bea.keyboard.press("Enter")
    wait_for_toast(bea, "drawer_1: place (0.005, 0.000, 0.000) m")
    bea.keyboard.press("Control+z")
    wait_for_toast(bea, "Undone: drawer_1: place")
    bea.context.set_offline(True)  # concurrent verdicts on one candidate, one of them offline
    bea.keyboard.press("y")
    expect(bea.locator(".banner")).to_contain_text("1 change not stored yet")
    ann.get_by_role("button", name="Reject", exact=True).first.click()
    say(ann, "Reject", "looks too small")
    expect(reject_c0(ann)).to_have_attribute("aria-pressed", "true")
    expect(ann.locator(".review > aside")).to_contain_text("of c0, which is no longer used")  # the figures below it
    bea.context.set_offline(False)
    merge = bea.get_by_role("dialog", name="drawer_1 was changed twice")
    expect(merge.get_by_role("row", name=re.compile("^Verdict"))).to_contain_text("rejected c0")
    picture(bea, "20-verdicts")
    merge.get_by_role("button", name="Keep what is chosen").click()
    expect(bea.get_by_text("1 of 1 object accepted")).to_be_visible()
    bea.keyboard.press("Control+z")
    for page in people:
        expect(page.get_by_text("0 of 1 object accepted")).to_be_visible()
    bea.keyboard.press("Control+y")
    expect(bea.get_by_text("1 of 1 object accepted")).to_be_visible()
    expect(ann.get_by_text("1 of 1 object accepted")).to_be_visible()
    bea.context.set_offline(True)  # her undo refers to a verdict that is no longer the latest
    bea.keyboard.press("Control+z")
    expect(bea.locator(".banner")).to_contain_text("1 change not stored yet")
    ann.get_by_role("button", name="Reject", exact=True).first.click()
    say(ann, "Reject", "looks too small")
    expect(reject_c0(ann)).to_have_attribute("aria-pressed", "true")
    bea.context.set_offline(False)
    wait_for_toast(bea, "drawer_1 was reviewed meanwhile: ann, rejected c0")
    expect(reject_c0(bea)).to_have_attribute("aria-pressed", "true")
    bea.keyboard.press("Control+z")  # now that she has seen it
    expect(bea.get_by_text("1 of 1 object accepted")).to_be_visible()
    bea.keyboard.press("y")  # accepting once more changes nothing
    move(bea, "Approve", "the mug is not part of it")
    for page in people:
        expect(page.locator("r2c2r-review-state")).to_contain_text("approved")
    expect(bea.get_by_text("1 of 1 object accepted")).to_be_visible()
    picture(bea, "18-approved")


def reject_c0(page: Page) -> Locator:
    """The reject button of c0, wherever its card is: the used candidate comes first."""
    return page.locator('[data-at="rejected:c0"]')


def test_a_tablet_can_annotate_by_touch(new_context: NewContext, server: Server) -> None:
    context = new_context(viewport={"width": 1024, "height": 768}, has_touch=True)
    ann = signed_in(context, server, "ann")
    ann.goto(f"{sample(ann)}/annotate?frame=3")
    ready(ann)
    tap_frame(ann, 60, 60)
    expect(rows(ann)).to_have_count(3)
    ann.get_by_role("button", name="Take away").tap()
    tap_frame(ann, 30, 90)
    expect(rows(ann).last).to_contain_text("2 clicks")
    drawer = ann.get_by_role("complementary", name="Depth, shape and comments")
    expect(drawer).to_be_hidden()
    ann.get_by_role("button", name="Depth, shape, comments").tap()
    expect(drawer).to_be_visible()
    expect(drawer.get_by_role("img", name=re.compile("^Depth of this frame"))).to_be_visible()
    picture(ann, "19-tablet")
    drawer.get_by_role("button", name="Close").tap()
    expect(drawer).to_be_hidden()
    lane = ann.get_by_role("img", name=re.compile("^drawer_2: seen"))
    box = box_of(lane)
    lane.tap(position={"x": box["width"] - 3, "y": box["height"] / 2})
    expect(ann.locator("r2c2r-film-strip output")).to_contain_text("frame 7 ")


def say(page: Page, button: str, text: str) -> None:
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("textbox").fill(text)
    dialog.get_by_role("button", name=button, exact=True).click()
    expect(dialog).to_be_hidden()


def viewed(page: Page) -> None:
    """Wait until the 3D view is in its iframe: a click while it is attached is lost."""
    page.frame_locator("r2c2r-viewer iframe").locator("canvas").first.wait_for(state="attached")


def move(page: Page, step: str, reason: str = "") -> None:
    page.get_by_role("button", name=step, exact=True).click()
    if reason:
        say(page, step, reason)


def test_the_inbox_lists_open_work_and_the_overview_lists_news(new_context: NewContext, server: Server) -> None:
    ann, bea = both(new_context, server, bypass_csp=True)  # for axe
    address = sample(ann)
    ann.goto(address)
    inbox = bea.locator("r2c2r-who").get_by_role("link", name="Inbox")
    with bea.expect_response(lambda answer: answer.request.method == "PUT" and answer.ok):  # later changes count as news
        bea.goto(address)
    expect(bea.get_by_label("Assigned to")).to_have_value("")
    ann.get_by_label("Assigned to").select_option("bea")
    wait_for_toast(ann, "Assigned to bea")
    expect(bea.get_by_label("Assigned to")).to_have_value("bea")  # updated without reload
    expect(inbox).to_have_text("Inbox 1")

    # a comment mentions Bea: by keyboard, from the list that @ opens
    ann.goto(f"{address}/annotate?frame=3")
    ann.get_by_role("button", name="Pin a comment").click()
    click_frame(ann, 40, 40)
    ann.get_by_role("dialog").get_by_role("textbox").press_sequentially("one drawer or two, @b")
    expect(ann.get_by_role("option", name="bea")).to_have_attribute("aria-selected", "true")
    assert serious(ann, "the dialog with names") == []
    ann.keyboard.press("Enter")
    ann.keyboard.press("Control+Enter")
    expect(ann.locator("r2c2r-comments")).to_contain_text("one drawer or two, @bea")

    # Bea was at the overview: news are shown there until she marks them as read
    news = bea.get_by_role("region", name="Since you were last here")
    expect(news).to_contain_text("ann 2 changes")
    bea.reload()
    expect(news).to_contain_text("commented: one drawer or two, @bea")
    expect(bea.get_by_label("Assigned to")).to_have_value("bea")
    leave, commands = (box_of(bea.get_by_role("button", name=name)) for name in ("Sign out", "Commands Ctrl K"))
    assert leave["x"] + leave["width"] <= commands["x"]
    picture(bea, "41-news")
    assert serious(bea, "overview with news") == []
    news.get_by_role("button", name="Mark as read").press("Enter")
    expect(news).to_be_hidden()

    expect(inbox).to_have_text("Inbox 2")
    inbox.press("Enter")
    expect(bea.get_by_role("region", name="Assigned to you: draft").get_by_role("link")).to_have_attribute(
        "href", address.removeprefix(address.split("/p/")[0])
    )
    picture(bea, "42-inbox")
    bea.set_viewport_size({"width": 390, "height": 800})
    assert bea.evaluate("document.documentElement.scrollWidth") <= 390
    bea.set_viewport_size({"width": 1280, "height": 720})
    assert serious(bea, "inbox") == []
    bea.get_by_role("link", name="one drawer or two, @bea").press("Enter")
    expect(bea).to_have_url(re.compile(r"/annotate\?frame=3"))
    bea.go_back()
    bea.get_by_role("button", name="Resolve: one drawer or two, @bea").press("Enter")
    expect(bea.get_by_role("region", name="Comments that mention you")).to_be_hidden()
    expect(inbox).to_have_text("Inbox 1")
