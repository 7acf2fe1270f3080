"""A mask painted, confirmed, and marked as absent in one frame; undone, and in prompts.json."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from playwright.sync_api import Page, expect

from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import pick, ready, sample
from tests.browser.together import Server, signed_in
from tests.waiting import until


def opened(page: Page) -> tuple[float, float]:
    """Frame 3 of a sample with the drawer selected, whose masks are there: until then, painting is refused. The middle."""
    page.goto(f"{sample(page)}/annotate?frame=3")
    ready(page)
    pick(page, "drawer_1")
    expect(page.locator(".object-list .current")).to_contain_text("3 frames")
    box = box_of(page.locator("r2c2r-frame-canvas canvas"))
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def changed(page: Page) -> AbstractContextManager[object]:
    """Wait until the server has stored the change made within the block: before, the page still says that all is saved."""
    return page.expect_response(lambda answer: answer.request.method in ("PUT", "DELETE") and answer.ok)


def said(page: Page) -> list[dict[str, Any]]:
    """Corrections of the first object's frames in prompts.json."""
    project = page.url.split("/p/")[1].split("/")[0]
    file = page.evaluate(f"async () => (await fetch('/api/projects/{project}/prompts.json')).json()")
    frames: list[dict[str, Any]] = file["objects"][0].get("frames", [])
    return frames


def test_a_mask_is_painted_confirmed_and_marked_absent(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    x, y = opened(page)
    page.keyboard.press("b")
    expect(page.get_by_role("button", name="Brush")).to_have_attribute("aria-pressed", "true")
    page.mouse.move(x - 60, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=5)
    with changed(page):
        page.mouse.up()
    (painted,) = said(page)
    assert sum(painted["mask"]["runs"]) == painted["mask"]["width"] * painted["mask"]["height"]
    assert sum(painted["mask"]["runs"][1::2]) > 0
    page.keyboard.press("Escape")
    page.keyboard.press("a")
    wait_for_toast(page, "not visible")  # in addition to the 3D view's message about a stand-in
    until(lambda: said(page) == [{"frame": painted["frame"], "mask": None}])
    page.keyboard.press("Control+z")
    wait_for_toast(page, "Undone")
    until(lambda: said(page) == [painted])


def test_eraser_lasso_polygon_and_keep_each_correct_the_mask(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    x, y = opened(page)

    def drag(*path: tuple[float, float]) -> None:
        page.mouse.move(x + path[0][0], y + path[0][1])
        page.mouse.down()
        for dx, dy in path[1:]:
            page.mouse.move(x + dx, y + dy, steps=4)
        page.mouse.up()

    def area() -> int:
        (one,) = said(page)
        return sum(one["mask"]["runs"][1::2])

    def stored(act: Callable[[], None]) -> int:
        with changed(page):
            act()
        return area()

    page.keyboard.press("l")
    lassoed = stored(lambda: drag((-80, -60), (80, -60), (80, 60), (-80, 60), (-80, -60)))
    page.keyboard.press("Shift+B")
    erased = stored(lambda: drag((-70, 0), (70, 0)))
    assert 0 < erased < lassoed
    page.keyboard.press("o")
    for dx, dy in ((-120, -90), (120, -90), (120, 90), (-120, 90)):
        page.mouse.click(x + dx, y + dy)
    around = stored(lambda: page.keyboard.press("Enter"))
    assert around > lassoed
    page.keyboard.press("Escape")
    page.keyboard.press("Control+z")
    wait_for_toast(page, "Undone")
    until(lambda: area() == erased)
    page.keyboard.press("ArrowRight")
    expect(page.locator("r2c2r-film-strip output")).to_contain_text("frame 7 ")
    with changed(page):
        page.keyboard.press("w")  # the mask found in the next frame stays
    kept = said(page)
    assert len(kept) == 2
    assert all(one["mask"] is not None and sum(one["mask"]["runs"][1::2]) > 0 for one in kept)
