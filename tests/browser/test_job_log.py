"""The log of a job, shown even before its processes have written anything."""

import json

from playwright.sync_api import expect

from tests.browser.serving import NewContext
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in


def test_the_log_of_a_running_and_of_a_cancelled_job_is_shown(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    folder = server.data / "projects" / project.split("/p/")[1]
    (folder / "behave.json").write_text(json.dumps({"align": "hang"}))
    page.goto(f"{project}/run")
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.locator("r2c2r-job li", has_text="align")).to_contain_text("running")
    page.get_by_role("button", name="Show the log").click()
    log = page.get_by_label("Log")
    expect(log).to_contain_text("align")
    expect(log).not_to_contain_text("empty")
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator("r2c2r-job")).to_contain_text("cancelled")
    expect(log).to_contain_text("cancelled")
