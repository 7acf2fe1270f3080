"""Tools of the 3D view: selection by click, visibility, immediate preview of corrections, unclicked worktops."""

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, TimeoutError, expect

from app.viewer.assembly import Assembly, shapes_of
from app.viewer.camera import USUAL_FOV, from_axis
from r2c2r_core.export.plan import facing, plan_bundle
from tests.app.finished import keep_results
from tests.app.nouns import finish
from tests.browser.looks import picture, scroll_to
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import sample, viewed
from tests.browser.together import Server, ask, signed_in
from tests.core.export.kitchen import kitchen
from tests.core.export.test_report import certificate
from tests.waiting import until

HEARD_MS = 6000  # the page polls that long for the clicked object
CLICK = {"frame": 3, "x": 80, "y": 60, "label": 1}


def finished(page: Page, server: Server) -> str:
    """A project with the small kitchen, one bundle, and a next run that hangs; the address of its overview."""
    project = sample(page)
    name = project.split("/p/")[1]
    for category, number in (("cabinet", 1), ("double_door_cabinet", 1), ("bottle", 1)):
        called = {"double_door_cabinet": "double_1"}.get(category, f"{category}_{number}")
        ask(
            page, "POST", f"/api/projects/{name}/objects?infer=false", {"name": called, "category": category, "points": [CLICK]}
        )
    job = ask(page, "POST", f"/api/projects/{name}/run", {})["id"]
    until(lambda: ask(page, "GET", f"/api/jobs/{job}")["state"] == "done")
    work = server.data / "projects" / name / "work"
    finish(work)
    keep_results(work, certificate())
    (work.parent / "behave.json").write_text(json.dumps({"segment": "hang"}))
    return project


def drawn_in_3d(page: Page, server: Server) -> str:
    """Such a project, with its scene drawn in Review; the address of its overview."""
    project = finished(page, server)
    page.goto(f"{project}/review")
    page.get_by_role("button", name="Scene", exact=True).click()
    expect(page.locator(".joints strong")).to_contain_text("joint")
    viewed(page)
    return project


def front_camera() -> tuple[np.ndarray, np.ndarray]:
    """Position and target of a camera that looks from the front."""
    plan = plan_bundle(kitchen())
    shown = Assembly(None, plan, {body.name: list(shapes_of(body.link, "meshes")) for body in plan.bodies})
    ahead = facing(plan)
    assert ahead is not None
    return from_axis("front", ahead, shown.points)


def stands_in_front(page: Page) -> bool:
    camera = ask(page, "GET", f"/api/projects/{page.url.split('/p/')[1].split('/')[0]}/viewer/camera")
    return "position" in camera and np.allclose(camera["position"], front_camera()[0], atol=0.01)


def from_front(page: Page, name: str) -> tuple[float, float]:
    """Screen position of the centre of an object's front face, seen from the front."""
    place, target = front_camera()
    depth = (target - place) / np.linalg.norm(target - place)
    right = np.cross(depth, [0.0, 0.0, 1.0])
    item = next(item for item in kitchen().objects if item.name == name)
    front = item.world_from_object.apply(np.array([0.0, -item.dimensions_m[1] / 2, 0.0]))
    offset = front - place
    frame = box_of(page.get_by_title("3D view of the project"))
    scale = frame["height"] / 2 / np.tan(USUAL_FOV / 2) / (offset @ depth)
    across, down = offset @ right * scale, -(offset - (offset @ depth) * depth)[2] * scale
    return frame["x"] + frame["width"] / 2 + float(across), frame["y"] + frame["height"] / 2 + float(down)


@pytest.mark.parametrize("scenes", [True])
def test_objects_are_clicked_cut_coloured_and_commented_in_the_scene(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(), server, "ann")
    drawn_in_3d(page, server)
    page.keyboard.press("6")
    until(lambda: stands_in_front(page), "the view was not turned to the front")
    scene = page.get_by_role("button", name="Scene", exact=True)
    for name in ("cabinet_1", "double_1", "counter_1"):
        chosen = page.locator(".review nav button[aria-pressed=true]")
        expect(clicked(page, name)).to_contain_text(name)
        expect(chosen).to_have_count(1)
        expect(scene).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("0")
    expect(page.get_by_role("button", name="Parallel")).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Hide bottle_1 in the scene").click()
    expect(page.get_by_role("button", name="Show bottle_1 in the scene")).to_be_visible()
    page.get_by_label("Layers of the scene").select_option("both")
    picture(page, "scene-tools", still=True)
    page.keyboard.press("0")

    page.locator(".review nav").get_by_role("button", name="cabinet_1", exact=True).click()
    page.keyboard.press("z")
    section = page.get_by_role("group", name="Section")
    expect(section.locator("output").nth(1)).to_have_text(re.compile(r"0\.\d\d m to 0\.\d\d m from the front, of 0\.\d\d m"))
    section.get_by_role("button", name="Around the object").click()
    narrow = section.locator("output").nth(0).inner_text()
    left = section.get_by_label("Width from the left")
    left.press("ArrowRight")
    expect(section.locator("output").nth(0)).not_to_have_text(narrow)
    expect(left).to_be_focused()  # the next key continues, although the view has responded
    page.get_by_label("Layers of the scene").select_option("unobserved")
    expect(page.locator(".heat-legend")).to_contain_text("50 cm from any observation")
    picture(page, "section")

    share = left.input_value()
    page.keyboard.press("c")
    page.keyboard.type("this side was never filmed")  # the box is open before the key returns
    page.keyboard.press("Control+Enter")
    note = page.get_by_role("button", name="this side was never filmed", exact=True)
    expect(page.locator("r2c2r-comments")).to_contain_text("with a view")
    section.get_by_role("button", name="Show all").click()
    page.get_by_label("Layers of the scene").select_option("meshes")
    page.keyboard.press("5")
    note.click()
    expect(page.get_by_role("button", name="Scene", exact=True)).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_label("Layers of the scene")).to_have_value("unobserved")
    expect(left).to_have_value(share)

    page.get_by_label("Look from").select_option("run")
    page.keyboard.press("z")
    expect(section).to_be_hidden()


def clicked(page: Page, name: str) -> Any:
    """Click the object until the list shows it as selected: the view handles clicks only once it is drawn."""
    chosen = page.locator(".review nav button[aria-pressed=true]", has_text=name)

    def heard() -> bool:
        page.mouse.click(*from_front(page, name))
        with suppress(TimeoutError):
            chosen.first.wait_for(timeout=HEARD_MS)
        return chosen.count() > 0

    until(heard, f"no click chose {name}")
    return chosen


@pytest.mark.parametrize("scenes", [True])
def test_corrections_are_previewed_and_mark_results_stale(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(), server, "ann")
    project = drawn_in_3d(page, server)
    page.locator(".review nav").get_by_role("button", name="cabinet_1", exact=True).click()
    page.get_by_text("Correct it").click()
    page.get_by_label("Hinge of cabinet_1").select_option("right")
    expect(page.get_by_text("Preview: cabinet_1; certified by the next run")).to_be_visible()
    expect(page.get_by_text("before the last change")).to_be_visible()
    aside = page.locator(".review > aside")
    expect(aside).to_contain_text("Below: of the last run, before its last change")
    expect(aside.locator(".joint-lines.old")).to_contain_text("Hinged")
    why = aside.locator("details", has_text="Why this one")
    expect(why.get_by_text("Placed by")).to_be_hidden()
    why.locator("summary").click()
    expect(why.locator(".old")).to_contain_text("Placed by")
    picture(page, "preview")

    # a worktop that nobody clicked: resized, left out and brought back
    made = page.locator(".review nav section", has_text="Made from the scan")
    made.get_by_role("button", name="counter_1", exact=True).click()
    panel = page.locator(".review > aside")
    expect(panel).to_contain_text("nobody clicked it")
    panel.get_by_label("Width (cm)").fill("310")
    panel.get_by_role("button", name="Set size").click()
    expect(page.get_by_text(re.compile("Preview: .*counter_1.*; certified by the next run"))).to_be_visible()
    picture(page, "made")
    panel.get_by_role("button", name="Leave it out").click()
    expect(made.get_by_role("button", name="Bring back counter_1")).to_be_visible()
    made.get_by_role("button", name="Bring back counter_1").click()
    expect(made.get_by_role("button", name="counter_1", exact=True)).to_be_visible()

    page.goto(f"{project}/run")
    expect(page.get_by_role("heading", name="Certificate")).to_contain_text("stale")
    warning = page.get_by_text("still overlap by 12 mm")
    scroll_to(warning)
    expect(warning).to_be_in_viewport()
    picture(page, "warnings")
    assert Path(server.data / "projects" / project.split("/p/")[1] / "work" / "bundle.zip").is_file()  # nothing was recomputed

    finish(server.data / "projects" / project.split("/p/")[1] / "work")  # a run without a worktop
    page.goto(f"{project}/review")
    expect(made).to_contain_text("counter_1: corrected, but the last run did not make it. Click on it, or delete it.")
    picture(page, "not-made")
    made.get_by_role("link", name="counter_1").click()
    expect(page.get_by_role("button", name="Delete counter_1")).to_be_visible()


def test_a_hinge_is_copied_and_kind_and_custom_category_are_set_in_review(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = finished(page, server)
    page.goto(f"{project}/review")
    page.locator(".review nav").get_by_role("button", name="cabinet_1", exact=True).click()
    page.get_by_text("Correct it").click()
    page.get_by_label("Hinge of cabinet_1").select_option("right")
    wait_for_toast(page, "cabinet_1: hinge right")
    nav = page.locator(".review nav")
    page.keyboard.press("/")
    nav.get_by_role("button", name="double_1", exact=True).click(modifiers=["ControlOrMeta"])
    chosen = nav.get_by_role("group", name="Selected objects")
    expect(chosen).to_contain_text("2 objects selected")
    picture(page, "copy")
    chosen.get_by_role("button", name="Copy hinge of cabinet_1").click()
    wait_for_toast(page, "Copied hinge to double_1")
    chosen.get_by_role("button", name="None").click()
    expect(chosen).to_be_hidden()
    page.get_by_label("Order").select_option("risk")
    first = nav.locator("ul li").first
    expect(first.locator(".risk")).not_to_be_empty()
    name, second = (nav.locator("ul li .name").nth(k).inner_text() for k in (0, 1))
    first.get_by_role("button", name=name).first.click()
    page.keyboard.press("n")
    expect(nav.locator("button[aria-pressed=true]")).to_contain_text(second)
    picture(page, "risk")
    page.get_by_label("Order").select_option("")
    nav.get_by_role("button", name="cabinet_1", exact=True).click()
    page.get_by_label("How cabinet_1 opens").select_option("drawer")
    wait_for_toast(page, "cabinet_1: built as drawer")
    page.get_by_label("Category of cabinet_1").fill("spice_rack")
    page.get_by_label("Category of cabinet_1").press("Enter")
    wait_for_toast(page, "cabinet_1 is a spice_rack from the next run on")
    name = project.split("/p/")[1]
    objects = {one["name"]: one for one in ask(page, "GET", f"/api/projects/{name}/objects")}
    assert objects["cabinet_1"]["category"] == "spice_rack"
    override = ask(page, "GET", f"/api/projects/{name}/objects/{objects['cabinet_1']['id']}/override")
    assert override["built_as"] == "drawer"
    copied = ask(page, "GET", f"/api/projects/{name}/objects/{objects['double_1']['id']}/override")
    assert (copied["hinge"], copied["built_as"], copied["dimensions_m"]) == ("right", None, None)


def test_a_tape_measurement_reports_the_scan_error_and_rescales_it(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = finished(page, server)
    (server.data / "projects" / project.split("/p/")[1] / "behave.json").unlink()
    size = next(item.dimensions_m[0] for item in kitchen().objects if item.name == "cabinet_1")
    page.goto(project)
    card = page.locator("r2c2r-true-lengths")
    expect(card).to_contain_text("Measure one or two edges in the room with a tape")
    card.get_by_label("Object").select_option(label="cabinet_1")
    typed = card.get_by_label("True length, in mm")
    typed.fill("wide")
    typed.press("Enter")
    assert typed.evaluate("field => field.validationMessage").startswith("A length such as 596")
    typed.fill(f"{1010 * size:.1f} mm")
    typed.press("Enter")
    expect(card.locator("tbody tr")).to_contain_text("−1.0 %")
    expect(card).to_contain_text("The scan is too small by 1.0 %")
    card.get_by_role("button", name="Remove width of cabinet_1").click()
    card.get_by_role("button", name="Put it back").click()
    expect(card.locator("tbody tr")).to_have_count(1)
    picture(page, "lengths")

    with page.expect_download() as table:
        page.get_by_role("link", name="Clicks and minutes of each person and object").click()
    assert table.value.path().read_text().splitlines()[0].startswith("project,person,object,category,clicks")

    card.get_by_role("button", name="Rescale the recording").click()
    warning = page.get_by_role("dialog", name="Rescale the recording")
    expect(warning).to_contain_text("Every length of the recording changes by +1.0 %")
    expect(warning).to_contain_text("Only one true length supports this")
    picture(page, "rescale")
    warning.get_by_role("button", name=re.compile(r"Multiply every length by 1\.010\d")).click()
    expect(card).to_contain_text("Every length is multiplied by 1.010")
    expect(card.get_by_role("button", name="Read lengths as recorded")).to_be_visible()
