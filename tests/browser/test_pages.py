"""Pages of a finished project: no serious finding of axe-core, a small first load, and no loss of changes while offline."""

import json
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.serve import register_finished
from tests.app.nouns import finish
from tests.browser.looks import AXE, scroll_to, serious
from tests.browser.serving import NewContext, printed_again, served, wait_for_toast
from tests.waiting import until

REPORT = {
    "certificate": {"passed": True, "findings": [{"rule": "r", "severity": "warning", "where": "drawer_1", "message": "m"}]}
}
OPENED = {
    "kind": "joint",
    "name": "drawer_1_joint",
    "method": "pinch",
    "passed": True,
    "grip_n": 20.0,
    "opened": 0.9,
    "why": "",
}
PLACE = {"x_m": 1.9, "y_m": 0.6, "lift_m": 0.1, "joints": ["drawer_1_joint"]}
ROBOTS = {
    "gripper": {"joints": 1, "joints_opened": 1, "grips": [OPENED | {"film": "drawer_1_joint"}]},
    "arm": {"arm": {"name": "Franka Panda"}, "joints": 1, "joints_opened": 1, "places": [PLACE], "grips": [OPENED]},
}
MAP = '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="30"><rect width="40" height="30" fill="#888"/></svg>'
VARIANTS = {
    "count": 2,
    "seed": 0,
    "sha256": "ab" * 32,
    "size": 3,
    "created": 1.0,
    "rejected": {"an object collides with something": 1},
    "checked": 2,
    "failed": ["00001"],
}
PROMPTS = {
    "version": 1,
    "objects": [{"name": "drawer_1", "category": "drawer", "points": [{"frame": 3, "x": 80, "y": 60, "label": 1}]}],
}
SIZES = (1280, 720), (1024, 768)  # pixels of a laptop and of a tablet
PAGES = ("", "/annotate", "/run", "/review", "/download")
FIRST_LOAD_BYTES = 200_000
IMPORT = "((name) => import(new URL(name, document.querySelector('script[type=module]').src)))"  # the page's own module


@contextmanager
def served_with_finished(data: Path) -> Iterator[tuple[str, str]]:
    """A served app with one finished project: its address and the project's id."""
    work = data / "kitchen" / "work"
    finish(work)
    (data / "prompts.json").write_text(json.dumps(PROMPTS))
    with zipfile.ZipFile(work / "bundle.zip", "w") as archive:
        archive.writestr("manifest.json", json.dumps({"stages": []}))
        archive.writestr("scene.xml", "<mujoco/>")
        archive.writestr("report.json", json.dumps(REPORT | ROBOTS))
        archive.writestr("gripper/drawer_1_joint.jpg", cv2.imencode(".jpg", np.zeros((30, 40, 3), np.uint8))[1].tobytes())
        archive.writestr("arm/standing.svg", MAP)
    scan = work.parent / "scan.r3d"
    project = register_finished(data, name="kitchen", source=scan, prompts=data / "prompts.json", workdir=work)
    variants = data / "projects" / project / "variants" / "v1-n2-s0"
    variants.mkdir(parents=True)
    (variants / "facts.json").write_text(json.dumps(VARIANTS))
    (variants / "wall.jpg").write_bytes(cv2.imencode(".jpg", np.zeros((30, 40, 3), np.uint8))[1].tobytes())
    with served(data, stand_ins=True) as address:
        yield address, project


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """A finished project shared by tests that only read it."""
    with served_with_finished(tmp_path_factory.mktemp("finished")) as found:
        yield found


@pytest.fixture
def changed(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """A finished project for one test, which may change it."""
    with served_with_finished(tmp_path) as found:
        yield found


def signed_in(new_context: NewContext, address: str, path: str = "/", **looks: Any) -> Page:
    """A page of a separate browser that opened the printed address, whose key signs in on every path."""
    page = new_context(**looks).new_page()
    page.goto(printed_again(address).replace("/?", f"{path}?"))
    return page


@pytest.mark.skipif(not AXE.is_file(), reason="npm ci was not run in static/")
def test_no_page_has_a_serious_accessibility_finding(new_context: NewContext, finished: tuple[str, str]) -> None:
    address, project = finished
    base = address.split("/?")[0]
    page = signed_in(new_context, address, bypass_csp=True)

    def of_every_size(where: str) -> list[str]:
        found: list[str] = []
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            found += serious(page, f"{where}, {width} px wide")
        return found

    found = of_every_size("projects")
    page.goto(f"{base}/people")
    page.get_by_role("heading", name="Add somebody").wait_for()
    found += of_every_size("people")
    for name in PAGES:
        page.goto(f"{base}/p/{project}{name}")
        page.locator("h1, h2").first.wait_for()
        found += of_every_size(name or "overview")
        if name == "/review":
            for key, shown in (("r", "candidates side by side"), ("3", "scene"), ("z", "section")):
                page.keyboard.press(key)
                found += of_every_size(shown)
    page.evaluate("document.body.append(document.createElement('button'))")
    assert any("button-name" in line for line in serious(page, "spoilt"))  # axe does check the page
    assert found == []


def test_the_first_page_load_is_small(new_context: NewContext, finished: tuple[str, str]) -> None:
    address, _ = finished
    page = new_context().new_page()
    sizes: dict[str, int] = {}
    page.on("response", lambda answer: sizes.update({answer.url: len(answer.body())}) if "/static/" in answer.url else None)
    page.goto(printed_again(address))
    page.get_by_role("link", name="kitchen").wait_for()
    assert 0 < sum(sizes.values()) < FIRST_LOAD_BYTES, sizes


def test_simulator_code_is_copied_by_keyboard_and_grasps_are_shown(new_context: NewContext, finished: tuple[str, str]) -> None:
    address, project = finished
    allowed = ["clipboard-read", "clipboard-write"]
    page = signed_in(new_context, address, f"/p/{project}/download", permissions=allowed)
    page.locator("summary", has_text="PyBullet").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_text("pip install pybullet")).to_be_visible()
    expect(page.get_by_text("pip install mujoco", exact=True)).to_be_hidden()  # only one is open at a time
    summary = page.locator("summary", has_text="PyBullet")
    drawn = summary.element_handle()
    page.evaluate(f"{IMPORT}('live.js').then(({{ live }}) => live.dispatchEvent(new Event('project')))")
    page.wait_for_function("summary => !summary.isConnected", arg=drawn)  # an event of the project rebuilds the page
    expect(page.get_by_text("pip install pybullet")).to_be_visible()
    expect(summary).to_be_focused()
    page.get_by_role("button", name="Copy the lines for PyBullet").focus()
    page.keyboard.press("Enter")
    wait_for_toast(page, "Copied")
    assert page.evaluate("navigator.clipboard.readText()").startswith("import pybullet")
    expect(page.get_by_text("x 1.9, y 0.6 m, lifted 0.1 m: drawer_1_joint")).to_be_visible()
    for name in ("A parallel gripper at drawer_1_joint", "The floor plan with the places where it may stand"):
        picture = page.get_by_role("img", name=name)
        scroll_to(picture)
        until(partial(picture.evaluate, "image => image.naturalWidth > 0"), f"{name!r} is not loaded")
    play = page.get_by_role("button", name="Play A parallel gripper at drawer_1_joint")
    for playing in (True, False):
        play.press("Enter")
        expect(play).to_have_attribute("aria-pressed", str(playing).lower())
        assert page.locator(".film img").evaluate("sheet => sheet.getAnimations().length") == playing


def test_a_button_pressed_while_its_list_rerenders_is_still_clicked(new_context: NewContext, finished: tuple[str, str]) -> None:
    page = signed_in(new_context, finished[0])
    page.evaluate(
        f"{IMPORT}('dom.js')"
        """.then(({ h, renew }) => {
        const list = h("div"), button = (text) => h("button", { onclick: () => (window.clicked = text) }, text);
        document.body.prepend(list);
        renew(list, button("Held down"));
        window.change = () => renew(list, button("Changed"));
    })"""
    )
    held = page.get_by_role("button", name="Held down")
    held.hover()
    page.mouse.down()
    page.evaluate("change()")
    expect(held).to_be_visible()
    page.mouse.up()
    expect(page.get_by_role("button", name="Changed")).to_be_visible()
    assert page.evaluate("clicked") == "Held down"


def test_an_error_stays_until_another_page_is_opened(new_context: NewContext, finished: tuple[str, str]) -> None:
    page = signed_in(new_context, finished[0])
    page.get_by_role("link", name="kitchen").wait_for()
    error = page.locator(".toast.bad")
    said = f"{IMPORT}('elements/toasts.js').then(({{ say }}) => say('it broke', {{ kind: 'bad' }}))"
    for leave in (page.get_by_role("link", name="kitchen").click, page.go_back):
        page.evaluate(said)
        expect(error).to_have_text("it broke")
        leave()
        expect(error).to_have_count(0)


def test_an_offline_change_is_stored_after_reconnecting(changed: tuple[str, str], new_context: NewContext) -> None:
    address, project = changed
    page = signed_in(new_context, address, f"/p/{project}/annotate")
    page.get_by_role("button", name="drawer_1", exact=True).click()
    page.context.set_offline(True)
    page.get_by_label("Name of drawer_1").fill("top_drawer")
    page.get_by_label("Name of drawer_1").press("Enter")
    expect(page.locator(".banner")).to_contain_text("1 change not stored yet")
    page.context.set_offline(False)
    expect(page.get_by_role("button", name="top_drawer", exact=True)).to_be_visible()
    expect(page.locator(".banner")).to_be_hidden()


def test_a_second_tab_sends_queued_changes_only_after_the_first_closes(
    changed: tuple[str, str], new_context: NewContext
) -> None:
    address, project = changed
    first = signed_in(new_context, address)
    second = first.context.new_page()
    first.route("**/api/projects/**", lambda route: route.abort() if route.request.method == "PATCH" else route.continue_())
    first.goto(f"{address.split('/?')[0]}/p/{project}/annotate")
    first.locator(".object-list .pick").first.click()
    first.get_by_label("Category of").last.fill("door")
    first.get_by_label("Category of").last.press("Enter")
    expect(first.locator(".banner")).to_contain_text("1 change not stored yet")
    sent: list[str] = []
    second.on("request", lambda asked: sent.append(asked.url) if asked.method == "PATCH" else None)
    second.goto(first.url)
    second.wait_for_function("async () => (await navigator.locks.query()).pending.length > 0")  # waits for the first tab
    assert sent == []
    first.close()
    second.locator(".object-list .pick").first.click()
    expect(second.get_by_label("Category of").last).to_have_value("door")
    assert len(sent) == 1


def test_keyboard_focus_in_a_list_is_kept_after_a_change(new_context: NewContext, finished: tuple[str, str]) -> None:
    address, project = finished
    page = signed_in(new_context, address, f"/p/{project}/annotate")
    hide, show = (page.get_by_role("button", name=re.compile(f"^{word} ")).first for word in ("Hide", "Show"))
    hide.focus()
    for button in (show, hide):
        page.keyboard.press("Enter")
        expect(button).to_be_focused()


def test_keys_operate_the_focused_control_instead_of_shortcuts(new_context: NewContext, finished: tuple[str, str]) -> None:
    address, project = finished
    page = signed_in(new_context, address)
    page.goto(f"{address.split('/?')[0]}/p/{project}/annotate?frame=3")
    expect(page.locator("r2c2r-film-strip output")).to_contain_text("frame 3 ")
    for key, name in (("Enter", "Take away"), ("Space", "Add")):  # does not: finish the object, play
        page.get_by_role("button", name=name).focus()
        page.keyboard.press(key)
        expect(page.get_by_role("button", name=name)).to_have_attribute("aria-pressed", "true")
    page.get_by_label("Mask opacity").focus()
    page.keyboard.press("ArrowRight")  # does not: step to the next frame
    expect(page.get_by_label("Mask opacity")).to_have_value("43")
    expect(page.locator("r2c2r-film-strip output")).to_contain_text("frame 3 ")
