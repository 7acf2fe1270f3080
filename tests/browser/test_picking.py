"""A click on a mask selects its object instead of creating another; dragging with Space pans the picture."""

from playwright.sync_api import Locator, expect

from tests.browser.looks import picture
from tests.browser.serving import STEADY, NewContext, box_of, wait_for_toast
from tests.browser.test_together import click_frame, on_canvas, ready, rows, sample
from tests.browser.together import Server, signed_in
from tests.waiting import until

PIXELS = """(canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((sum, value, k) => (sum * 31 + value * k) % 1e9, 0);
}"""


def pixels(canvas: Locator) -> int:
    """Checksum of the canvas once it is stable: a picture and its masks are drawn one after the other."""
    seen: list[int] = []

    def stays() -> bool:
        seen.append(canvas.evaluate(PIXELS))
        return len(seen) >= STEADY and len(set(seen[-STEADY:])) == 1

    until(stays)
    return seen[-1]


def test_a_click_on_a_mask_selects_its_object_instead_of_adding_one(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate")
    ready(page)
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)
    expect(page.get_by_label("Name of drawer_2")).to_be_visible()
    row = page.locator(".object-list > li.current")
    expect(row).to_contain_text("1 click · 3 frames")
    page.keyboard.press("Enter")
    expect(row).to_have_count(0)

    click_frame(page, 103, 42)
    wait_for_toast(page, "drawer_2 is chosen")
    expect(row).to_contain_text("drawer_2")
    expect(rows(page)).to_have_count(3)
    picture(page, "picking")
    click_frame(page, 103, 42)  # on the selected object it adds a click
    expect(row).to_contain_text("2 clicks")

    page.keyboard.press("Enter")
    page.locator("r2c2r-frame-canvas canvas").click(position=on_canvas(page, 98, 38), modifiers=["Control"])  # type: ignore[arg-type]
    expect(rows(page)).to_have_count(4)


def test_dragging_with_space_pans_and_tapping_space_plays(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate")
    ready(page)
    expect(rows(page)).to_have_count(2)
    counter = page.locator("r2c2r-film-strip output")
    expect(counter).to_contain_text("frame")
    page.keyboard.press("Home")
    expect(counter).to_contain_text(" 1 of ")
    first = counter.inner_text()
    canvas = page.locator("r2c2r-frame-canvas canvas").first
    before = pixels(canvas)
    start, end = on_canvas(page, 40, 60), on_canvas(page, 90, 90)
    box = box_of(canvas)
    page.mouse.move(box["x"] + start["x"], box["y"] + start["y"])
    page.keyboard.down("Space")
    page.mouse.down()
    page.mouse.move(box["x"] + end["x"], box["y"] + end["y"], steps=4)
    page.mouse.up()
    page.keyboard.up("Space")
    until(lambda: pixels(canvas) != before, "the picture did not move")
    expect(page.get_by_role("button", name="Play or pause")).not_to_have_attribute("aria-pressed", "true")
    expect(counter).to_have_text(first)  # playback does not start
    expect(rows(page)).to_have_count(2)  # and no box was drawn
    page.keyboard.press("Space")
    expect(counter).not_to_have_text(first)
