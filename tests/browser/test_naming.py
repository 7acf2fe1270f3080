"""Names of objects: words are joined to a valid name, categories are suggested, and hints are shown once."""

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext
from tests.browser.test_together import rows, sample
from tests.browser.together import Server, post, signed_in


def test_names_are_normalised_and_an_unknown_category_is_reported_once(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    for _ in range(3):
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "gizmo"})
    page.goto(f"{project}/annotate?frame=3")
    expect(rows(page)).to_have_count(5)
    offered = page.locator("#categories option").evaluate_all("options => options.map(option => option.value)")
    assert {"bottle", "mug", "chair", "sink", "drawer", "wall_cabinet"} <= set(offered)

    notices = page.locator(".object-list li > .muted:not(.row)")
    expect(notices).to_have_count(1)
    expect(notices).to_contain_text("'gizmo' is not a known category")
    page.get_by_role("button", name="gizmo_3", exact=True).click()
    expect(notices).to_have_count(2)  # for the first, and for the current object

    page.get_by_label("Name of gizmo_3").fill("mom's cook books")
    page.get_by_label("Name of gizmo_3").press("Enter")
    expect(page.get_by_role("button", name="mom_s_cook_books", exact=True)).to_be_visible()
    page.get_by_label("Category of mom_s_cook_books").fill("book")
    page.get_by_label("Category of mom_s_cook_books").press("Enter")
    expect(notices).to_have_count(1)
    expect(page.get_by_label("Category of the next object")).to_have_value("")  # unaffected by the other object

    proposals = page.get_by_label("Proposals", exact=True)
    expect(proposals.get_by_role("button", name="Confirm 2", exact=True)).to_be_enabled()
    expect(proposals.get_by_label("Least confidence")).to_have_value("0.8")
    assert "at least" in proposals.inner_text()
    page.get_by_label("Least confidence").select_option("95 % sure")
    expect(proposals.get_by_role("button", name="Confirm 1", exact=True)).to_be_enabled()
    picture(page, "naming")
