"""People without the right to decide see no button that would be refused, and can comment."""

from playwright.sync_api import Page, Route, expect

from tests.app.nouns import finish
from tests.browser.looks import picture
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import sample
from tests.browser.together import Server, ask, signed_in


class Review:
    """The views in the centre of the review page, of which one is shown."""

    def __init__(self, page: Page) -> None:
        self.scene, self.photos, self.compare = (
            page.locator(f".review .centre > r2c2r-{name}") for name in ("viewer", "photo-check", "candidate-compare")
        )


def test_an_annotator_sees_disabled_review_buttons_and_can_comment(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "cleo")
    project = sample(page)
    review = Review(page)
    early = {"kind": "not-ready", "message": "there is no finished scene yet", "hint": "run the project first"}
    page.route("**/viewer/show", lambda route: route.fulfill(status=409, json=early))
    page.goto(f"{project}/review")
    expect(review.scene).to_contain_text("there is no finished scene yet")  # said where the scene will be
    expect(page.locator(".toast.bad")).to_have_count(0)
    page.unroute("**/viewer/show")
    held: list[Route] = []
    page.route("**/candidates", lambda route: held.append(route))
    finish(server.data / "projects" / project.split("/p/")[1] / "work")
    for address, shown in ((f"{project}/review", review.scene), (f"{project}/review?object=1", review.photos)):
        page.goto(address)
        expect(page.locator(".review > .objects")).to_contain_text("Loading the objects…")
        expect(shown.locator(".spinner")).to_be_visible()
        for part in {review.scene, review.photos, review.compare} - {shown}:
            expect(part).to_be_hidden()  # one view, and no heap of parts
    picture(page, "review-loading")
    page.unroute("**/candidates")
    page.route("**/api/projects", lambda route: held.append(route))
    page.goto(project.split("/p/")[0])
    expect(page.get_by_text("Loading the projects…")).to_be_visible()
    page.unroute("**/api/projects")
    page.goto(f"{project}/review")
    expect(page.get_by_text("A reviewer accepts, rejects and corrects; you can comment.")).to_be_visible()
    for name in ("Accept", "Reject", "More candidates", "Upload a mesh…"):
        expect(page.get_by_role("button", name=name, exact=True).first).to_be_disabled()
    ask(page, "POST", f"/api/projects/{project.split('/p/')[1]}/review", {"from_state": "draft", "to": "ready"})
    start = page.get_by_role("button", name="Start the review")
    expect(start).to_be_disabled()
    expect(page.get_by_role("region", name="State of the review")).to_contain_text("A reviewer does this.")
    expect(page.get_by_role("button", name="Take back")).to_be_enabled()
    page.get_by_text("Correct it").click()
    expect(page.locator(".review > aside").get_by_role("combobox").first).to_be_disabled()
    expect(page.get_by_role("button", name="Comment", exact=True)).to_be_enabled()
    page.keyboard.press("y")
    wait_for_toast(page, "A reviewer accepts")
    picture(page, "annotator")
