"""Side-by-side candidates in Review: synchronised rotation, marked differences, source crops."""

import re

from playwright.sync_api import expect

from tests.app.test_differences import with_a_deeper_one
from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in

SIDES = "[...document.querySelectorAll('.turntable')].map(one => getComputedStyle(one).backgroundPositionX)"
SHOWN = """async () => {
  const addresses = [...document.querySelectorAll('.turntable')].map(one => one.style.backgroundImage.slice(5, -2));
  const images = addresses.map((src) => Object.assign(new Image(), { src }));
  await Promise.all(images.map((image) => image.decode()));
  return images.map(i => i.naturalWidth / i.naturalHeight);
}"""


def test_compared_candidates_rotate_together_and_report_differences(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    with_a_deeper_one(server.data / "projects" / project.split("/p/")[1] / "work")
    page.goto(f"{project}/review")
    page.locator(".review nav").get_by_role("button", name="drawer_1", exact=True).click()
    page.keyboard.press("r")
    expect(page.get_by_role("button", name="Compare", exact=True)).to_have_attribute("aria-pressed", "true")
    compare = page.locator("r2c2r-candidate-compare")
    expect(compare.locator(".why")).to_have_text("closest to the others")
    expect(compare.get_by_role("article", name="c1")).to_contain_text(
        re.compile(r"Differs from c0 on \d+ % of its surface, by 10\d mm at most")
    )
    expect(compare.locator(".legend")).to_contain_text("Orange: more than 5 mm away from c0")
    expect(compare.locator(".turntable.waiting")).to_have_count(0)
    assert page.evaluate(SHOWN) == [24, 24]

    first = page.evaluate(SIDES)
    box = box_of(compare.locator(".turntable").first)
    page.mouse.move(box["x"] + 60, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 204, box["y"] + 60, steps=4)
    page.mouse.up()
    turned = page.evaluate(SIDES)
    assert len(set(turned)) == 1
    assert turned != first
    picture(page, "compare")
    compare.get_by_label("Turn all candidates").press("End")
    assert page.evaluate(SIDES) == ["100%", "100%"]

    compare.get_by_label("Compare with").select_option("c1")
    expect(compare.get_by_role("article", name="c0")).to_contain_text("Differs from c1")
    compare.get_by_role("button", name="Frame 7, of which c0, c1 were made").click()
    expect(page.locator("r2c2r-photo-check")).to_be_visible()
    page.keyboard.press("r")
    compare.get_by_role("article", name="c1").get_by_role("button", name="Show in 3D").click()
    expect(page.get_by_role("button", name="Candidate", exact=True)).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("r")
    compare.get_by_role("article", name="c1").get_by_role("button", name="Accept").click()
    wait_for_toast(page, "accepted c1 of drawer_1")
