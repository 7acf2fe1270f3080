"""A click on a mask chooses its object instead of making a second one there; Space held moves the picture."""

from playwright.sync_api import Browser, expect

from tests.browser.serving import box_of
from tests.browser.test_journey import picture
from tests.browser.test_together import click_frame, on_canvas, ready, rows, sample
from tests.browser.together import Server, signed_in

PIXELS = """(canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((sum, value, k) => (sum * 31 + value * k) % 1e9, 0);
}"""


def test_a_click_on_a_mask_chooses_its_object_and_a_second_one_there_is_asked_for(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = signed_in(context, server, "ann")
    sample(page)
    page.get_by_role("link", name="Annotate").click()
    ready(page)
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)
    expect(page.get_by_label("Name of drawer_2")).to_be_visible()
    row = page.locator(".object-list > li.current")
    expect(row).to_contain_text("1 click · 3 frames")
    page.keyboard.press("Enter")
    expect(row).to_have_count(0)

    click_frame(page, 103, 42)
    expect(page.locator(".toast", has_text="drawer_2 is chosen")).to_be_visible()
    expect(row).to_contain_text("drawer_2")
    expect(rows(page)).to_have_count(3)
    picture(page, "picking")
    click_frame(page, 103, 42)  # on the chosen one it is a click more
    expect(row).to_contain_text("2 clicks")

    page.keyboard.press("Enter")
    page.locator("r2c2r-frame-canvas canvas").click(position=on_canvas(page, 98, 38), modifiers=["Control"])  # type: ignore[arg-type]
    expect(rows(page)).to_have_count(4)
    context.close()


def test_space_held_moves_the_picture_and_tapped_plays(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = signed_in(context, server, "ann")
    sample(page)
    page.get_by_role("link", name="Annotate").click()
    ready(page)
    count = rows(page).count()
    page.keyboard.press("Home")
    counter = page.locator("r2c2r-film-strip output")
    first = counter.inner_text()
    canvas = page.locator("r2c2r-frame-canvas canvas").first
    before = canvas.evaluate(PIXELS)
    start, end = on_canvas(page, 40, 60), on_canvas(page, 90, 90)
    box = box_of(canvas)
    page.mouse.move(box["x"] + start["x"], box["y"] + start["y"])
    page.keyboard.down("Space")
    page.mouse.down()
    page.mouse.move(box["x"] + end["x"], box["y"] + end["y"], steps=4)
    page.mouse.up()
    page.keyboard.up("Space")
    page.wait_for_timeout(400)
    assert canvas.evaluate(PIXELS) != before
    assert counter.inner_text() == first  # nothing plays
    assert rows(page).count() == count  # and no box was drawn
    page.keyboard.press("Space")
    expect(counter).not_to_have_text(first)
    context.close()
