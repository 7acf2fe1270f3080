"""The whole journey in a real Chromium: project, import, click, run, review, accept, download."""

import json
import re
import zipfile
from pathlib import Path

from playwright.sync_api import Page, expect

from tests.browser.looks import picture
from tests.browser.serving import box_of, drawn
from tests.browser.together import ask
from tests.waiting import PATIENCE_MS

LONG_MS = 4 * PATIENCE_MS  # the pipeline on two busy cores


def click_of(sample: Path, category: str) -> tuple[int, float, float]:
    for item in json.loads((sample / "prompts.json").read_text())["objects"]:
        if item["category"] == category:
            point = item["points"][0]
            return point["frame"], point["x"], point["y"]
    raise AssertionError(category)


def click_frame(page: Page, x: float, y: float, *, button: str = "left") -> None:
    """Click a pixel of the stored frame (320 x 240) on the canvas."""
    canvas = page.locator("r2c2r-frame-canvas canvas")
    box = box_of(canvas)
    scale = min(box["width"] / 320, box["height"] / 240)
    left, top = (box["width"] - 320 * scale) / 2, (box["height"] - 240 * scale) / 2
    canvas.click(position={"x": left + x * scale, "y": top + y * scale}, button=button)  # type: ignore[arg-type]


def seek(page: Page, frame: int) -> None:
    page.goto(re.sub(r"/annotate.*", f"/annotate?frame={frame}", page.url))
    expect(page.locator("r2c2r-film-strip output")).to_contain_text(f"frame {frame} ")


def test_a_kitchen_is_rendered_imported_clicked_run_reviewed_and_downloaded(page: Page, tmp_path: Path) -> None:
    # Projects: the empty state offers the sample, whose frames are shown as they are rendered
    small = json.dumps({"seed": 1, "frames": 10, "width": 320, "height": 240})
    page.route("**/api/projects/sample", lambda route: route.continue_(post_data=small))
    picture(page, "1-projects-empty")
    page.get_by_role("button", name="Open the sample kitchen").click()
    rendered = page.get_by_alt_text("The frame that was rendered last")
    expect(rendered).to_be_visible()
    assert rendered.evaluate("image => image.naturalWidth") == 480

    # Annotate: its objects have masks, without any click or request
    page.get_by_role("link", name="Annotate").click(timeout=PATIENCE_MS)
    expect(page.locator(".transport .chip").first).to_have_text("ready")
    rows = page.locator(".object-list > li")
    expect(rows.first).to_contain_text("frames")
    seen = rows.all_text_contents()  # includes the number of frames, shown for the selected one
    assert len(seen) > 5
    assert all("frame" in row for row in seen), seen

    # Its recording, uploaded: the scan is described once it is read
    kitchen, folder = page.url.split("/annotate")[0], next((tmp_path / "served" / "projects").iterdir())
    page.unroute_all()
    page.goto(page.url.split("/p/")[0])
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import a scan").first.click()
    chooser.value.set_files(next((folder / "source").glob("*.r3d")))
    page.wait_for_url(re.compile(r"/p/\w+"))
    page.get_by_role("link", name="Click objects").wait_for(timeout=LONG_MS)
    expect(page.get_by_text("320 × 240")).to_be_visible()
    expect(page.locator(".scan-pictures img")).to_have_count(2)
    expect(page.get_by_role("img", name=re.compile("Sharpness over the frames"))).to_be_visible()
    picture(page, "2-overview")
    ask(page, "DELETE", f"/api/projects/{page.url.split('/p/')[1]}")

    # Annotate: click, mask, name; a wrong click is undone
    page.goto(f"{kitchen}/annotate")
    for row in ask(page, "GET", f"/api/projects/{folder.name}/objects"):
        ask(page, "DELETE", f"/api/projects/{folder.name}/objects/{row['id']}")
    expect(page.get_by_text("Each object gets a lane here")).to_be_visible()
    page.locator(".chip", has_text=re.compile("^ready$")).wait_for(timeout=LONG_MS)
    frame, x, y = click_of(folder / "source", "drawer")
    seek(page, frame)
    page.locator(".chip", has_text=re.compile("^ready$")).wait_for(timeout=LONG_MS)
    click_frame(page, x, y)
    expect(page.get_by_role("button", name="drawer_1", exact=True)).to_be_visible()
    expect(page.locator("r2c2r-object-list")).to_contain_text(re.compile(r"1 click · \d+ frames"), timeout=LONG_MS)
    picture(page, "3-annotate")
    click_frame(page, 160, 14, button="right")
    expect(page.locator("r2c2r-object-list")).to_contain_text("2 clicks")
    page.keyboard.press("Control+z")
    expect(page.locator("r2c2r-object-list")).to_contain_text("1 click ")
    page.reload()  # everything is stored
    expect(page.get_by_role("button", name="drawer_1", exact=True)).to_be_visible()
    page.get_by_role("button", name="drawer_1", exact=True).click()
    page.get_by_label("Name of drawer_1").select_text()  # selecting text in a field keeps the object selected
    drawn(page)
    page.get_by_label("Name of drawer_1").fill("top_drawer")
    page.get_by_label("Name of drawer_1").press("Enter")
    expect(page.get_by_role("button", name="top_drawer", exact=True)).to_be_visible()

    # Run with live progress
    page.get_by_role("link", name="Run", exact=True).click()
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.locator("r2c2r-job")).to_contain_text("Segment")
    picture(page, "4-running")
    page.get_by_role("heading", name="Result").wait_for(timeout=LONG_MS)
    expect(page.get_by_role("row", name=re.compile("top_drawer"))).to_contain_text("Slides out, opens")
    limit = page.get_by_role("row", name=re.compile("top_drawer")).locator(".chip").first
    word = re.sub(r"^\W+", "", limit.inner_text())  # without the leading sign
    expect(limit).to_have_attribute("title", re.compile(f"limits: {word}"))
    expect(page.get_by_role("heading", name=re.compile("Certificate"))).to_contain_text("passed")
    picture(page, "5-result")

    # Review: the viewer shows through our own origin; accept
    page.get_by_role("link", name="Review").first.click()
    expect(page.locator("iframe")).to_have_attribute("src", re.compile(r"^/viewer/[\w-]"))
    expect(page.frame_locator("iframe").locator("canvas").first).to_be_visible()
    expect(page.get_by_label("top_drawer", exact=False).first).to_be_attached()
    page.get_by_role("button", name="Open all").wait_for()
    page.get_by_role("button", name="Open all").click()
    picture(page, "6-review-scene", still=True)
    page.get_by_role("button", name=re.compile("^Accept")).first.click()
    expect(page.get_by_text("1 of 1 object accepted")).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("2")
    picture(page, "7-review-aligned", still=True)

    # Download
    page.get_by_role("link", name="Download").first.click()
    with page.expect_download() as download:
        page.get_by_role("link", name=re.compile("^Bundle")).click()
    saved = tmp_path / "bundle.zip"
    download.value.save_as(saved)
    picture(page, "8-download")
    with zipfile.ZipFile(saved) as bundle:
        assert bundle.testzip() is None
        names = {name.removeprefix(f"{Path(bundle.namelist()[0]).parts[0]}/") for name in bundle.namelist()}
        assert {"scene.urdf", "scene.xml", "scene.glb", "manifest.json", "report.html"} <= names | set(bundle.namelist())


def test_a_file_that_is_no_recording_is_refused_with_its_name(page: Page, address: str, tmp_path: Path) -> None:
    page.goto(address)
    bad = tmp_path / "notes.r3d"
    bad.write_bytes(b"these are not the frames you are looking for")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import a scan").first.click()
    chooser.value.set_files(bad)
    message = page.get_by_role("alert").or_(page.locator(".toast.bad"))
    expect(message.first).to_contain_text("notes.r3d")
    picture(page, "9-refused")


def test_the_help_opens_by_key_and_dark_mode_survives_a_reload(page: Page, address: str) -> None:
    page.goto(address)
    page.keyboard.press("?")
    expect(page.get_by_role("heading", name="Keyboard and mouse")).to_be_visible()
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Dark or light").click()
    theme = page.evaluate("document.documentElement.dataset.theme")
    page.reload()
    expect(page.locator("html")).to_have_attribute("data-theme", theme)
