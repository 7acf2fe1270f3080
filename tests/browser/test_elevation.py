"""Fronts on a plane of the scan: drawn, split, typed, merged and undone by mouse and by keyboard, and stored."""

from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, box_of
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in

MARGIN_PX = 16  # margin around the fitted plane
SIZE_M = (2.4, 0.9)  # of the stand-in's plane, with seams every 60 cm


def at(page: Page, x: float, y: float) -> tuple[float, float]:
    """Screen position of a point of the plane, given in metres from its top left corner."""
    box = box_of(page.locator("r2c2r-elevation-canvas canvas"))
    room = box["width"] - 2 * MARGIN_PX, box["height"] - 2 * MARGIN_PX
    scale = min(room[0] / SIZE_M[0], room[1] / SIZE_M[1])
    left = box["x"] + MARGIN_PX + (room[0] - SIZE_M[0] * scale) / 2
    top = box["y"] + MARGIN_PX + (room[1] - SIZE_M[1] * scale) / 2
    return left + x * scale, top + y * scale


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*at(page, *start))
    page.mouse.down()
    page.mouse.move(*at(page, *end), steps=6)
    page.mouse.up()


def fronts(page: Page) -> Locator:
    return page.locator(".front-list button")


def stored(page: Page) -> list[dict[str, Any]]:
    """Objects in prompts.json, once all is saved."""
    expect(page.locator(".stage-tools .chip").nth(1)).to_contain_text("saved")
    project = page.url.split("/p/")[1].split("/")[0]
    file: dict[str, Any] = page.evaluate(f"async () => (await fetch('/api/projects/{project}/prompts.json')).json()")
    return [entry for entry in file["objects"] if "front" in entry]


def test_fronts_are_drawn_split_resized_merged_and_undone(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/elevation")
    expect(page.locator(".planes li")).to_have_count(1)
    expect(page.locator(".elevation .tip")).to_contain_text("Drag over a front")
    page.get_by_role("button", name="Plane 1, 2.40 × 0.90 m").click()

    drag(page, (0.59, 0.1), (1.79, 0.8))  # both ends snap to seams half a centimetre off
    expect(fronts(page)).to_have_count(1)
    expect(fronts(page).first).to_contain_text("1200 × 700")
    page.mouse.move(*at(page, 1.19, 0.4))
    page.keyboard.press("s")
    expect(fronts(page)).to_have_count(2)
    expect(fronts(page).nth(1)).to_contain_text("600 × 700")
    page.mouse.move(*at(page, 1.5, 0.3))
    page.keyboard.press("Shift+S")
    expect(fronts(page)).to_have_count(3)
    picture(page, "elevation")

    page.keyboard.press("w")
    page.get_by_label("Width mm").fill("450")
    page.keyboard.press("Enter")
    expect(fronts(page).filter(has_text="450 × ")).to_have_count(1)
    page.keyboard.press("e")  # selects the left edge
    page.keyboard.press("Shift+ArrowRight")
    expect(fronts(page).filter(has_text="440 × ")).to_have_count(1)
    page.keyboard.press("Control+z")
    expect(fronts(page).filter(has_text="450 × ")).to_have_count(1)
    page.keyboard.press("Control+z")
    expect(fronts(page).filter(has_text="600 × ")).to_have_count(3)

    page.mouse.click(*at(page, 0.8, 0.4))
    page.mouse.move(*at(page, 0.63, 0.5))
    page.keyboard.press("j")
    page.mouse.move(*at(page, 1.15, 0.2))
    page.keyboard.press("k")
    expect(page.get_by_role("combobox", name="Hinge")).to_have_value("left")
    expect(page.get_by_role("combobox", name="Handle")).to_have_value("drawn")
    door = next(entry for entry in stored(page) if entry["front"]["hinge"] == "left")
    assert door["front"]["handle"]["top_m"] > door["front"]["handle"]["bottom_m"]

    page.mouse.click(*at(page, 1.5, 0.2))
    page.keyboard.down("Shift")
    page.mouse.click(*at(page, 1.5, 0.6))
    page.keyboard.up("Shift")
    page.keyboard.press("m")
    expect(fronts(page)).to_have_count(2)
    page.keyboard.press("Control+z")  # one gesture: both are restored
    expect(fronts(page)).to_have_count(3)
    page.keyboard.press("Control+Shift+z")
    expect(fronts(page)).to_have_count(2)
    page.keyboard.press("Delete")
    expect(fronts(page)).to_have_count(1)
    stored(page)
    page.reload()
    expect(fronts(page)).to_have_count(1)
    expect(fronts(page).first).to_contain_text("600 × 700")


def names(page: Page) -> list[str]:
    return fronts(page).locator(".what").all_inner_texts()


def test_a_row_of_fronts_is_divided_repeated_numbered_and_undone_by_keyboard(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/elevation")
    expect(page.locator(".elevation .tip")).to_contain_text("D divides it")
    drag(page, (0.1, 0.1), (1.0, 0.8))
    expect(fronts(page)).to_have_count(1)
    page.keyboard.press("d")
    page.keyboard.type("500")
    page.keyboard.press("Enter")
    expect(fronts(page)).to_have_count(2)
    expect(fronts(page).first).to_contain_text("500 × 700")
    page.mouse.click(*at(page, 0.3, 0.4))
    page.keyboard.press("Shift+D")
    page.keyboard.type("3 / 20")
    page.keyboard.press("Enter")
    expect(fronts(page)).to_have_count(4)
    expect(fronts(page).filter(has_text="500 × 220")).to_have_count(3)
    page.mouse.click(*at(page, 0.8, 0.4))
    page.keyboard.press("r")
    expect(fronts(page)).to_have_count(5)
    expect(fronts(page).filter(has_text="400 × 700")).to_have_count(2)

    drag_over = (0.02, 0.02), (1.1, 0.88)
    page.keyboard.down("Shift")
    drag(page, *drag_over)
    page.keyboard.up("Shift")
    expect(page.locator(".front-list [aria-pressed=true]")).to_have_count(4)
    page.keyboard.press("Control+a")
    expect(page.locator(".front-list [aria-pressed=true]")).to_have_count(5)
    stored(page)
    page.keyboard.press("t")
    page.keyboard.type("pantry door")
    page.keyboard.press("Enter")
    expect(fronts(page).first).to_contain_text("pantry_door_1")
    assert names(page) == [f"pantry_door_{number}" for number in range(1, 6)]
    assert sorted(entry["name"] for entry in stored(page)) == names(page)
    picture(page, "elevation-rows")
    page.mouse.click(*at(page, 0.8, 0.4))
    page.keyboard.press("t")
    page.keyboard.type("pan_1")
    page.keyboard.press("Control+Enter")  # and confirms the next one's
    page.keyboard.type("pan_2")
    page.keyboard.press("Enter")
    expect(fronts(page).nth(4)).to_contain_text("pan_2")
    assert names(page)[3:] == ["pan_1", "pan_2"]
    stored(page)
    page.get_by_role("combobox", name="Kind").select_option("sliding_door")
    page.get_by_role("combobox", name="Slides to").select_option("right")
    picture(page, "elevation-slides")
    stored(page)
    for _ in range(4):  # side, kind, one name, then the other
        page.keyboard.press("Control+z")
    expect(fronts(page).nth(3)).to_contain_text("pantry_door_4")
    page.keyboard.press("Control+z")  # all names at once
    expect(fronts(page).filter(has_text="pantry")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(fronts(page)).to_have_count(4)
    page.keyboard.press("Control+z")
    expect(fronts(page)).to_have_count(2)


def test_a_merge_keeps_the_handle_and_undo_skips_changes_without_effect(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/elevation")
    expect(page.locator(".elevation .tip")).to_contain_text("Drag over a front")
    with page.expect_response(lambda response: response.request.method == "POST"):  # its edges may snap
        drag(page, (0.6, 0.1), (1.2, 0.8))
    expect(fronts(page)).to_have_count(1)
    page.mouse.move(*at(page, 1.1, 0.4))
    page.keyboard.press("k")
    drag(page, (1.25, 0.1), (1.8, 0.8))
    expect(fronts(page)).to_have_count(2)
    page.mouse.click(*at(page, 0.8, 0.4))
    page.mouse.move(*at(page, 1.1, 0.4))
    page.keyboard.press("k")  # already shown
    page.keyboard.press("Control+z")
    expect(fronts(page)).to_have_count(1)
    page.keyboard.press("Control+Shift+z")
    expect(fronts(page)).to_have_count(2)
    alone = stored(page)[0]["front"]
    page.mouse.click(*at(page, 0.8, 0.4))
    page.keyboard.down("Shift")
    page.mouse.click(*at(page, 1.5, 0.4))
    page.keyboard.up("Shift")
    with page.expect_response(lambda response: response.request.method == "DELETE"):  # the last one
        page.keyboard.press("m")
    expect(fronts(page)).to_have_count(1)
    (merged,) = (entry["front"] for entry in stored(page))
    for side in ("left_m", "right_m"):
        assert merged["handle"][side] == pytest.approx(alone["handle"][side] - 0.3, abs=0.02)


def test_handle_and_hinge_of_one_front_are_copied_to_the_others(new_context: NewContext, server: Server) -> None:
    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/elevation")
    expect(page.locator(".elevation .tip")).to_contain_text("Drag over a front")
    drag(page, (0.02, 0.1), (0.6, 0.8))
    expect(fronts(page)).to_have_count(1)
    for count in (2, 3):
        page.keyboard.press("r")
        expect(fronts(page)).to_have_count(count)
    page.mouse.move(*at(page, 1.7, 0.4))
    page.keyboard.press("k")
    page.mouse.move(*at(page, 1.24, 0.5))
    page.keyboard.press("j")
    expect(page.get_by_role("combobox", name="Hinge")).to_have_value("left")
    copy = page.get_by_role("button", name="Copy handle and hinge")
    expect(copy).to_be_hidden()
    page.mouse.click(*at(page, 0.3, 0.4))
    for across in (0.9, 1.5):
        page.keyboard.down("Shift")
        page.mouse.click(*at(page, across, 0.4))
        page.keyboard.up("Shift")
    expect(copy).to_be_visible()
    picture(page, "copy-handle")
    assert serious(page, "elevation") == []
    page.keyboard.press("c")
    expect(page.locator(".stage-tools .chip").nth(1)).to_contain_text("saved")
    first, *others = (entry["front"] for entry in stored(page))
    for front in others:
        assert front["hinge"] == "left"
        for side in ("bottom_m", "top_m"):
            assert front["handle"][side] == pytest.approx(first["handle"][side], abs=0.01)
    page.keyboard.press("Control+z")  # one gesture
    expect(page.locator(".stage-tools .chip").nth(1)).to_contain_text("saved")
    assert [entry["front"]["hinge"] for entry in stored(page)] == [None, None, "left"]


def test_the_header_of_a_project_fits_a_phone_screen(new_context: NewContext, server: Server) -> None:
    context = new_context(viewport={"width": 420, "height": 800})
    page = signed_in(context, server, "ann")
    page.goto(f"{sample(page)}/elevation")
    expect(page.locator(".planes li")).to_have_count(1)
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    page.goto(page.url.replace("/elevation", "/download"))
    expect(page.locator(".tabs [aria-current]")).to_be_in_viewport(ratio=0.9)
    for name in ("Keyboard and mouse help", "Dark or light"):
        box = box_of(page.get_by_role("button", name=name))
        assert box["x"] + box["width"] <= 420
