"""Upload of a person's own mesh in Review: previewed before it is used."""

import trimesh
from playwright.sync_api import Page, expect

from tests.app.nouns import finish
from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_photo_check import segmented
from tests.browser.test_together import sample, viewed
from tests.browser.together import Server, signed_in


def send(page: Page, content: bytes) -> None:
    page.get_by_label("Mesh file").set_input_files({"name": "mine.glb", "mimeType": "model/gltf-binary", "buffer": content})


def stored(page: Page, server: Server, project: str, number: int) -> str | None:
    said = page.request.get(f"{server.address}/api/projects/{project.split('/p/')[1]}/objects/{number}/override").json()
    return said["candidate"]


def test_an_uploaded_mesh_is_previewed_with_size_and_repairs(new_context: NewContext, server: Server) -> None:
    page = signed_in(new_context(bypass_csp=True), server, "ann")
    project = sample(page)
    finish(server.data / "projects" / project.split("/p/")[1] / "work")
    number = segmented(page, project)
    page.goto(f"{project}/review?object={number}")
    viewed(page)
    dialog = page.get_by_role("dialog", name="A mesh for")

    send(page, b"unreadable")
    expect(dialog.get_by_role("alert")).to_contain_text("mine.glb: no triangles found")
    expect(dialog.get_by_role("button", name="Use this mesh")).to_be_disabled()
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

    box = bytes(trimesh.creation.box([1.0, 0.6, 0.4]).export(file_type="glb"))
    send(page, box)
    expect(dialog.get_by_role("img", name="mine.glb, as it would be used")).to_be_visible()
    expect(dialog.get_by_role("row", name="The mesh 1 × 0.6 × 0.4 in the file's unit")).to_be_visible()
    expect(dialog.get_by_role("row", name="The object in the scan")).to_be_visible()
    expect(dialog.get_by_text("small holes were filled")).to_be_visible()
    assert serious(page, "the mesh") == []
    picture(page, "mesh-look")
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)
    assert stored(page, server, project, number) is None

    send(page, box)  # the same file again
    expect(dialog.get_by_role("button", name="Use this mesh")).to_be_focused()
    page.keyboard.press("Enter")
    wait_for_toast(page, "candidate mine-")
    assert stored(page, server, project, number)
