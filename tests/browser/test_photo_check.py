"""Objects overlaid on their photos in Review: outlined, zoomed to fit, with the comments pinned to them."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.app.nouns import finish
from tests.app.test_photos import FILMED, drawer, store
from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import pick, ready, sample, say, viewed
from tests.browser.together import Server, signed_in


def test_the_object_is_zoomed_to_fit_and_its_comments_are_pins(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    finish(server.data / "projects" / project.split("/p/")[1] / "work")
    number = segmented(page, project)
    page.goto(f"{project}/review?object={number}")
    viewed(page)
    expect(page.get_by_role("button", name="Outline")).to_have_attribute("aria-pressed", "true")
    sheet = page.locator("r2c2r-photo-check .sheet")
    near = box_of(sheet)
    photo = page.get_by_role("button", name="Photo", exact=True)
    photo.click()
    expect(photo).to_have_attribute("aria-pressed", "true")
    whole = box_of(sheet)
    room = box_of(page.locator("r2c2r-photo-check .pictures"))
    assert near["width"] > 2 * whole["width"]  # the drawer is a twelfth of the photo
    assert whole["width"] <= room["width"] + 1
    assert whole["height"] <= room["height"] + 1
    at = whole["x"] + whole["width"] * 0.5, whole["y"] + whole["height"] * 0.25
    page.mouse.dblclick(*at)
    say(page, "Comment", "a scratch")
    pin = page.locator("r2c2r-photo-check .pin")
    expect(pin).to_have_count(1)
    drawn = pin.element_handle()
    page.keyboard.press("c")
    say(page, "Comment", "and a dent")
    expect(page.get_by_role("button", name="and a dent", exact=True)).to_be_visible()
    assert drawn.evaluate("pin => pin.isConnected")  # the hovered pin is not rebuilt
    shown = box_of(pin)
    assert shown["x"] + shown["width"] / 2 == pytest.approx(at[0], abs=2)
    assert shown["y"] + shown["height"] / 2 == pytest.approx(at[1], abs=2)
    picture(page, "photo-check")


def test_marking_a_leaf_open_or_closed_updates_its_overlay_at_once(new_context: NewContext, server: Server) -> None:
    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "ann")
    project = sample(page)
    work = server.data / "projects" / project.split("/p/")[1] / "work"
    finish(work)
    store(work, drawer(FILMED), FILMED)
    number = segmented(page, project)
    page.goto(f"{project}/review?object={number}")

    # measured values, and unknown ones
    said = page.locator(".opening-marks output")
    plot = page.get_by_role("img", name="Opening over the frames: up to 25 cm, at least; marked in 0")
    expect(plot).to_be_visible()
    seek(page, 3)
    expect(said).to_have_text("open, 25 cm ± 4 mm")
    expect(page.locator(".opening-marks .chip.measured")).to_be_visible()
    seek(page, 7)
    expect(said).to_have_text("not known in this photo")
    picture(page, "opening-marks-measured")

    # by keyboard: opened, marked, undone, redone
    drawn = page.locator("r2c2r-photo-check img.over").last
    before = drawn.get_attribute("src")
    for _ in range(3):
        page.keyboard.press("=")
    expect(page.get_by_role("button", name="Open here: 3 cm")).to_be_visible()
    expect(page.locator("r2c2r-photo-check line")).to_have_count(12)
    picture(page, "opening-marks-turned")
    page.keyboard.press("Shift+o")
    expect(said).to_have_text("opening, 3 cm")
    expect(page.locator(".opening-marks .chip.person")).to_be_visible()
    expect(page.get_by_role("img", name="marked in 1")).to_be_visible()
    assert drawn.get_attribute("src") != before  # the leaf over the photo is redrawn
    picture(page, "opening-marks")
    assert serious(page, "a marked leaf") == []
    page.keyboard.press("Control+z")
    expect(said).to_have_text("not known in this photo")
    expect(drawn).to_have_attribute("src", before or "")
    page.keyboard.press("Control+Shift+z")
    expect(said).to_have_text("opening, 3 cm")

    # a stop is stored and undone together with its mark
    override = f"{server.address}/api/projects/{project.split('/p/')[1]}/objects/{number}/override"
    page.keyboard.press("Shift+s")
    expect(page.get_by_role("button", name="Compute it again")).to_be_visible()
    assert page.request.get(override).json()["joint_upper"] == pytest.approx(0.03)
    picture(page, "opening-marks-stop")
    page.keyboard.press("Control+z")
    expect(page.get_by_role("button", name="Compute it again")).to_have_count(0)
    assert page.request.get(override).json()["joint_upper"] is None
    expect(said).to_have_text("opening, 3 cm")

    # dragged by its edge: in this picture a drawer opens upwards
    hold = box_of(page.locator("r2c2r-photo-check .hold"))
    x, y = hold["x"] + hold["width"] / 2, hold["y"] + hold["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 40, steps=4)
    expect(page.locator("r2c2r-photo-check line")).to_have_count(12)
    page.mouse.up()
    expect(said).to_have_text(re.compile(r"^open(ing)?, (?!3 )\d+ cm$"))

    # closed in every frame, one key after the other; removed again
    for frame in (0, 3, 7):
        seek(page, frame)
        page.keyboard.press("Shift+c")
    expect(page.get_by_role("img", name="marked in 3")).to_be_visible()
    expect(said).to_have_text("closed")
    expect(page.locator(".opening-marks .chip.person")).to_be_visible()
    page.get_by_role("button", name="Remove this mark").click()
    expect(page.get_by_role("img", name="marked in 2")).to_be_visible()
    stored = page.request.get(override).json()
    assert stored["states"] == {"front": [{"frame": 0, "state": 0.0}, {"frame": 3, "state": 0.0}]}

    # the lane of the annotate page shows the same
    page.goto(f"{project}/annotate?frame=3&object={number}")
    ready(page)
    expect(page.locator(".opening .state")).to_have_text("closed, set by a person")


def test_an_annotator_sees_opening_marks_but_cannot_make_any(new_context: NewContext, server: Server) -> None:
    context = new_context()
    ann = signed_in(context, server, "ann")
    project = sample(ann)
    work = server.data / "projects" / project.split("/p/")[1] / "work"
    finish(work)
    store(work, drawer(FILMED), FILMED)
    segmented(ann, project)
    other = new_context()
    cleo = signed_in(other, server, "cleo")
    cleo.goto(f"{project}/review")
    cleo.get_by_role("button", name="Photos").click()
    expect(cleo.get_by_role("button", name="Closed here")).to_be_disabled()
    expect(cleo.get_by_role("slider", name="How far it stands open in this photo")).to_be_disabled()
    expect(cleo.locator("r2c2r-photo-check .hold")).to_have_count(0)
    cleo.keyboard.press("Shift+c")
    wait_for_toast(cleo, "you can comment")


def segmented(page: Page, project: str) -> str:
    """Id of the drawer, once its masks exist."""
    page.goto(f"{project}/annotate?frame=3")
    ready(page)
    pick(page, "drawer_1")
    expect(page.locator(".object-list .current")).to_contain_text("3 frames")
    expect(page).to_have_url(re.compile(r"object=\d+"))  # after the list's redraw
    return str(page.evaluate("new URLSearchParams(location.search).get('object')"))


def seek(page: Page, frame: int) -> None:
    page.get_by_role("button", name=f"Photo {frame}", exact=True).click()
    expect(page.locator("r2c2r-photo-check .legend")).to_contain_text(f"Frame {frame},")
