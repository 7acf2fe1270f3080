"""People without the right to decide see no button that would be refused, and can comment."""

from playwright.sync_api import expect

from tests.app.nouns import finish
from tests.browser.looks import picture
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import sample
from tests.browser.together import Server, signed_in


def test_an_annotator_sees_disabled_review_buttons_and_can_comment(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "cleo")
    project = sample(page)
    finish(server.data / "projects" / project.split("/p/")[1] / "work")
    page.goto(f"{project}/review")
    expect(page.get_by_text("A reviewer accepts, rejects and corrects; you can comment.")).to_be_visible()
    for name in ("Accept", "Reject", "More candidates", "Upload a mesh…"):
        expect(page.get_by_role("button", name=name, exact=True).first).to_be_disabled()
    page.get_by_text("Correct it").click()
    expect(page.locator(".review > aside").get_by_role("combobox").first).to_be_disabled()
    expect(page.get_by_role("button", name="Comment", exact=True)).to_be_enabled()
    page.keyboard.press("y")
    wait_for_toast(page, "A reviewer accepts")
    picture(page, "annotator")
