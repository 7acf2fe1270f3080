"""Access on a phone, at 200 % zoom, and by keyboard alone; toasts do not cover the lanes, nor each other."""

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of
from tests.browser.test_together import rows, sample
from tests.browser.together import Server, post, signed_in

ZOOMED = {"width": 640, "height": 360}  # 1280 × 720 at 200 %
PHONE = {"width": 390, "height": 844}


def test_the_frame_keeps_its_size_at_200_percent_zoom_and_on_a_phone(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    for name, size in (("zoomed", ZOOMED), ("phone", PHONE)):
        page.set_viewport_size(size)  # type: ignore[arg-type]
        page.goto(f"{project}/annotate?frame=3")
        expect(rows(page)).to_have_count(2)
        frame = box_of(page.locator("r2c2r-frame-canvas"))
        assert frame["height"] >= 240
        assert frame["width"] == size["width"]
        assert page.evaluate("document.documentElement.scrollWidth") == size["width"]
        header = box_of(page.locator(".topbar"))
        assert header["height"] <= 90  # two lines
        for button in page.locator(".topbar button").all():
            expect(button).to_be_in_viewport(ratio=1)
        rows(page).first.locator(".pick").click()  # the list is below, and reachable
        expect(page.get_by_label("Name of drawer_1")).to_be_visible()
        page.locator("main").evaluate("main => main.scrollTo(0, 0)")
        picture(page, name)


def test_the_skip_link_moves_the_focus_to_the_picture(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    page.goto(f"{project}/annotate?frame=3")
    expect(rows(page)).to_have_count(2)
    page.keyboard.press("Tab")
    skip = page.get_by_role("button", name="Skip to the picture")
    expect(skip).to_be_focused()
    expect(skip).to_be_in_viewport(ratio=1)
    page.keyboard.press("Enter")
    expect(page.locator("r2c2r-frame-canvas canvas")).to_be_focused()
    page.goto(project)
    expect(page.get_by_role("heading", name="The recording")).to_be_visible()
    expect(skip).to_have_count(0)  # there is no picture on this page


def test_toasts_do_not_cover_the_lanes_and_equal_ones_merge(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    for _ in range(9):
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "mug"})
    page.clock.install()
    page.goto(f"{project}/annotate?frame=3")
    expect(rows(page)).to_have_count(11)
    page.clock.pause_at(page.evaluate("Date.now()") / 1000 + 60)  # else the first toast may be gone before the last
    for name in ("mug_1", "mug_2", "mug_3", "mug_4"):
        page.get_by_role("button", name=name, exact=True).click()
        page.get_by_role("button", name=f"Delete {name}", exact=True).click()
    expect(page.locator(".toast")).to_have_count(4)
    lowest = box_of(page.locator(".toast").last)
    assert lowest["y"] + lowest["height"] <= box_of(page.locator("r2c2r-film-strip"))["y"]
    for _ in range(3):
        page.keyboard.press("g")
    expect(page.locator(".toast", has_text="Choose an object first.")).to_have_text("Choose an object first.3 times")
    expect(page.locator(".toast", has_text="Deleted")).to_have_count(3)  # equal ones take the place of one
