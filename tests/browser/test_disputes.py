"""Two names on one panel get a mask each, and the page states whose front was cut; undo restores the whole front."""

import pytest
from playwright.sync_api import Page, expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import click_frame, on_canvas, sample
from tests.browser.together import Server, signed_in
from tests.waiting import until

LEFT, RIGHT, BESIDE = (15, 30), (65, 30), (120, 30)  # on the panel's halves and outside it
PIXEL = """(canvas, at) => {
  const scale = canvas.width / canvas.getBoundingClientRect().width;
  return [...canvas.getContext("2d").getImageData(at.x * scale, at.y * scale, 1, 1).data];
}"""


@pytest.fixture
def live() -> str:
    return "panels"


def alike(page: Page, one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two pixels of the frame, of equal colour in the picture, are drawn in equal colours."""
    canvas = page.locator("r2c2r-frame-canvas canvas").first
    colours = [canvas.evaluate(PIXEL, on_canvas(page, *point)) for point in (one, other)]
    return max(abs(a - b) for a, b in zip(*colours, strict=True)) < 20


def until_drawn(page: Page, *, whole: bool) -> None:
    """Wait until the panel has masks, of one object or of two."""

    def is_drawn() -> bool:
        return not alike(page, LEFT, BESIDE) and not alike(page, RIGHT, BESIDE) and alike(page, LEFT, RIGHT) is whole

    until(is_drawn, "not drawn")


def test_two_objects_on_one_panel_have_separate_masks(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/annotate")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 20, 60)
    expect(page.get_by_label("Name of drawer_2")).to_be_visible()
    until_drawn(page, whole=True)
    page.get_by_role("button", name="New object").click()
    click_frame(page, 60, 60)
    wait_for_toast(page, "drawer_2 now ends at the seam to drawer_3")
    until_drawn(page, whole=False)
    picture(page, "disputes-two")
    page.get_by_role("button", name="Delete drawer_3").click()
    wait_for_toast(page, "drawer_2 has its whole front again")
    until_drawn(page, whole=True)
    picture(page, "disputes-whole")
