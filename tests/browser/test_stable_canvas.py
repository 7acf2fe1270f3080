"""Layout of Annotate: a large picture that does not move, and panels resized by the person."""

from playwright.sync_api import FloatRect, Page, expect

from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, box_of
from tests.browser.test_together import FRAME, click_frame, ready, rows, sample
from tests.browser.together import Server, ask, signed_in


def share_of_window(page: Page) -> float:
    """Fraction of the window's pixels that show the frame."""
    box = box_of(page.locator("r2c2r-frame-canvas canvas"))
    scale = min(box["width"] / FRAME[0], box["height"] / FRAME[1])
    return scale**2 * FRAME[0] * FRAME[1] / page.evaluate("innerWidth * innerHeight")


def layout(page: Page) -> list[FloatRect]:
    """Boxes of the header and of the page below it."""
    return [box_of(page.locator(part)) for part in (".topbar", "main")]


def test_appearing_elements_do_not_move_the_picture(new_context: NewContext, own_server: Server) -> None:
    context = new_context(viewport={"width": 1280, "height": 720})
    page = signed_in(context, own_server, "ann")
    project = sample(page)
    others = {path: context.new_page() for path in ("run", "review")}
    for path, other in others.items():
        other.goto(f"{project}/{path}")
        expect(other.locator(".tabs a[aria-current]")).to_have_text(path.capitalize())
    page.goto(f"{project}/annotate?frame=3")
    canvas = page.locator("r2c2r-frame-canvas canvas")
    expect(page.locator("r2c2r-film-strip output")).to_contain_text("frame 3 ")
    first = box_of(canvas)
    assert share_of_window(page) >= 0.45
    ready(page)
    assert box_of(canvas) == first
    for k in range(6):
        page.get_by_role("button", name="New object").click()
        click_frame(page, 20 + 8 * k, 100)
        expect(rows(page)).to_have_count(3 + k)
    expect(page.locator(".transport .chip").nth(1)).to_contain_text("saved")
    page.keyboard.press("b")  # a tool of the selected object
    assert box_of(canvas) == first
    picture(page, "canvas-1280")
    pages = [page, *others.values()]
    before = [layout(each) for each in pages]
    own_server.kill()
    for each, (header, main) in zip(pages, before, strict=True):
        expect(each.get_by_text("The server does not answer")).to_be_visible()
        assert layout(each) == [header, main]
        assert (main["x"], main["width"]) == (0, 1280)
        banner = box_of(each.locator(".banner"))
        assert banner["y"] == main["y"]  # over the top of the page, on one line
        assert banner["height"] < header["height"]
        assert abs(banner["x"] + banner["width"] / 2 - 640) <= 1  # px
    assert box_of(canvas) == first
    picture(page, "offline")


def test_pages_opened_during_the_import_wake_when_it_ends(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(), server, "ann")
    project = sample(page)
    early = {"kind": "not-ready", "message": "the recording has not been read yet", "hint": "wait for the import"}
    for path, asked in (("annotate", "**/frames"), ("elevation", "**/live/open")):
        page.route(asked, lambda route: route.fulfill(status=409, json=early))
        page.goto(f"{project}/{path}")
        expect(page.locator(".tip")).to_contain_text("has not been read yet")
        page.unroute(asked)
        ask(page, "PATCH", f"/api/projects/{project.split('/p/')[1]}", {"tags": [path]})  # the end of an import is told so
        expect(page.locator(".tip")).not_to_contain_text("has not been read yet")
        ready(page)
        expect(page.locator(".toast.bad")).to_have_count(0)


def test_a_moved_panel_separator_keeps_its_position_after_a_reload(new_context: NewContext, server: Server) -> None:
    context = new_context(viewport={"width": 1280, "height": 720}, bypass_csp=True)
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate?frame=3")
    ready(page)
    pane, canvas = page.locator(".objects-pane"), page.locator("r2c2r-frame-canvas canvas")
    bar = page.get_by_role("separator", name="Width of the list of objects")
    before, at = box_of(pane)["width"], box_of(bar)
    page.mouse.move(at["x"] + 2, at["y"] + 200)
    page.mouse.down()
    page.mouse.move(at["x"] + 82, at["y"] + 200, steps=4)
    page.mouse.up()
    assert box_of(pane)["width"] == before + 80
    bar.focus()
    page.keyboard.press("ArrowLeft")
    assert box_of(pane)["width"] == before + 64
    page.reload()
    ready(page)
    assert box_of(pane)["width"] == before + 64
    bar.focus()
    page.keyboard.press("Enter")
    expect(pane).to_be_hidden()
    page.keyboard.press("Enter")
    assert box_of(pane)["width"] == before + 64
    share = share_of_window(page)
    canvas.focus()
    page.keyboard.press("\\")
    expect(pane).to_be_hidden()
    expect(page.get_by_role("complementary", name="Depth, shape and comments")).to_be_hidden()
    assert share_of_window(page) > share + 0.03
    picture(page, "canvas-alone")
    assert serious(page, "annotate, panels folded") == []
    page.keyboard.press("\\")
    assert box_of(pane)["width"] == before + 64
    assert serious(page, "annotate") == []


def test_the_toolbar_is_a_single_tab_stop_with_arrow_keys(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(viewport={"width": 1280, "height": 720}), server, "ann")
    page.goto(f"{sample(page)}/annotate?frame=3")
    ready(page)
    rail = page.get_by_role("toolbar", name="Tools")
    page.get_by_role("separator", name="Width of the list of objects").focus()
    while page.evaluate("!document.activeElement.closest('.rail')"):
        page.keyboard.press("Shift+Tab")
    expect(rail.get_by_role("slider", name="Mask opacity")).to_be_focused()
    page.keyboard.press("Shift+Tab")
    expect(rail.get_by_role("button", name="Add")).to_be_focused()
    page.keyboard.press("ArrowDown")
    expect(rail.get_by_role("button", name="Take away")).to_be_focused()
    page.keyboard.press("Enter")
    expect(rail.get_by_role("button", name="Take away")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("Shift+Tab")
    assert page.evaluate("!document.activeElement.closest('.rail')")
