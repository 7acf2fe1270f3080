"""Plain names of stages, models and roles on every page."""

import json

from playwright.sync_api import expect

from tests.app.nouns import finish
from tests.browser.looks import picture
from tests.browser.serving import NewContext
from tests.browser.test_together import pick, ready, sample
from tests.browser.together import Server, signed_in


def test_stages_models_and_roles_have_plain_names(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    folder = server.data / "projects" / project.split("/p/")[1]
    (folder / "behave.json").write_text(json.dumps({"warp": "hang"}))
    page.goto(f"{project}/run")
    expect(page.get_by_text("Nothing is computed yet")).to_be_visible()
    expect(page.get_by_text("several meshes of each object, of which the best is chosen")).to_be_visible()
    page.get_by_role("button", name="Run", exact=True).click()
    stages = page.locator("r2c2r-job .stages li")
    expect(stages.nth(4)).to_contain_text("running")
    said = [line.split("\n")[0] for line in stages.all_inner_texts()]
    assert said == [
        "Segment the objects",
        "Generate meshes",
        "Align to the scan",
        "Build the articulated scene",
        "Fit to the scan",
        "Export and certify",
    ]
    picture(page, "stages")
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator("r2c2r-job")).to_contain_text("cancelled")

    finish(folder / "work")
    page.goto(f"{project}/annotate?frame=3")
    ready(page)
    pick(page, "drawer_1")
    page.keyboard.press("g")
    expect(page.locator(".object-list .current")).to_contain_text("3 frames")
    page.goto(page.url.replace("annotate", "review"))
    models = page.get_by_role("group", name="Model").get_by_role("button")
    expect(models.last).to_have_text("After the fit")
    expect(models.first).to_have_text("Generated mesh")
    picture(page, "models")

    page.goto(f"{server.address}/people")
    expect(page.get_by_text("does that too; accepts, rejects and corrects results")).to_be_visible()
    expect(page.get_by_label("Password, at least 10 characters", exact=True)).to_be_visible()
