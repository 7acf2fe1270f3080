"""Download of a project as one file and its import elsewhere, with its recording or with the recording added later."""

from pathlib import Path

from playwright.sync_api import Page, expect

from tests.app.test_imports import R3D
from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext
from tests.browser.together import Server, post, signed_in

CLICK = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}


def import_file(page: Page, name: str, content: bytes) -> str:
    """Choose a file to import; return the id of the resulting project."""
    page.get_by_label("Recording", exact=True).set_input_files({"name": name, "mimeType": "application/zip", "buffer": content})
    page.wait_for_url("**/p/*")
    return page.url.rsplit("/", 1)[-1]


def downloaded(page: Page, to: Path) -> bytes:
    with page.expect_download() as started:
        page.get_by_role("link", name="Download,").press("Enter")
    started.value.save_as(to / started.value.suggested_filename)
    assert started.value.suggested_filename == "Kitchen.r2c2r.zip"
    return (to / "Kitchen.r2c2r.zip").read_bytes()


def test_a_project_is_exported_and_imported_as_one_file(new_context: NewContext, server: Server, tmp_path: Path) -> None:
    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "ann")
    page.goto(server.address)
    project = import_file(page, "Kitchen.r3d", R3D)
    expect(page.get_by_role("link", name="Click objects")).to_be_visible()
    post(page, f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]})
    post(page, f"/api/projects/{project}/comments", {"text": "a scratch"})
    page.get_by_role("button", name="Export…").press("Enter")
    dialog = page.get_by_role("dialog", name="Export Kitchen")
    expect(dialog).to_contain_text("approvals are not exported")
    expect(dialog.get_by_label("With the recording")).to_be_checked()
    picture(page, "export")
    assert serious(page, "export") == []
    whole = downloaded(page, tmp_path)
    expect(dialog).to_have_count(0)

    page.goto(server.address)
    page.get_by_role("button", name="More: Kitchen").press("Enter")
    page.get_by_role("button", name="Export: Kitchen").press("Enter")
    page.get_by_label("With the recording").press("Space")
    light = downloaded(page, tmp_path)
    assert R3D in whole
    assert R3D not in light

    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "cleo")
    page.goto(server.address)
    import_file(page, "Kitchen.r2c2r.zip", light)
    expect(page.get_by_role("heading", name="The recording is missing")).to_be_visible()
    expect(page.get_by_role("alert")).to_contain_text("choose the recording it was made from")
    expect(page.get_by_text("Waiting for the recording: 1 object")).to_be_visible()
    picture(page, "recording-missing")
    assert serious(page, "overview") == []
    page.locator("r2c2r-overview > input").set_input_files({"name": "scan.r3d", "mimeType": "application/zip", "buffer": R3D})
    expect(page.get_by_role("link", name="Run on 1 object")).to_be_visible()
    expect(page.get_by_text("imported from Kitchen.r2c2r.zip (objects: 1, comments: 1)")).to_be_visible()
    picture(page, "recording-given")

    page.goto(server.address)
    import_file(page, "Kitchen.r2c2r.zip", whole)
    expect(page.get_by_role("link", name="Run on 1 object")).to_be_visible()
