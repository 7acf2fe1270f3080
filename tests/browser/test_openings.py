"""Lane of a front that was filmed open, above its object's: states in words, angle over time, scrubbing."""

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of
from tests.browser.test_together import click_frame, sample
from tests.browser.together import Server, signed_in


def test_the_opening_lane_shows_the_state_of_the_front_in_the_frame(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate")
    page.get_by_label("Category of the next object").fill("cabinet")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)  # tests/app/fakes/live.py reports it as closed, opened and open
    lane = page.get_by_role("img", name="Opening of cabinet_1: seen up to 86°, at least")
    expect(lane).to_have_count(1)
    state = page.locator(".opening .state")
    page.keyboard.press("Home")
    expect(state).to_have_text("closed")
    page.keyboard.press("ArrowRight")
    expect(state).to_have_text("opening, 40° ± 6°")
    expect(page.locator(".opening .chip.at_least")).to_have_text("86°: ≥ at least")
    picture(page, "opening")
    box = box_of(lane)
    lane.click(position={"x": 0.9 * box["width"], "y": box["height"] / 2})  # its last third is the last frame
    expect(state).to_have_text("open, 86° ± 2°")
    expect(page.locator("r2c2r-film-strip .transport output")).to_contain_text("frame 7")
