"""Tag, archive, duplicate and delete projects from their list, with undo for each."""

from playwright.sync_api import expect

from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext
from tests.browser.test_together import say
from tests.browser.together import Server, post, signed_in


def test_tagged_archived_duplicated_and_deleted_projects_are_recoverable(new_context: NewContext, server: Server) -> None:
    context = new_context(bypass_csp=True)
    page = signed_in(context, server, "ann")
    for name in ("Cellar", "Attic"):
        post(page, "/api/projects/sample", {"name": name})
    page.goto(server.address)
    names = page.locator(".cards h2 a")
    expect(page.get_by_text("annotating")).to_have_count(2)
    expect(page.get_by_role("button", name="Tags: Cellar")).to_be_hidden()
    page.get_by_role("button", name="More: Cellar").click()
    page.get_by_role("button", name="Tags: Cellar").click()
    say(page, "Keep", "oak, Flat 3")
    page.get_by_role("button", name="oak", exact=True).click()
    expect(page.get_by_label("Find projects")).to_have_value("oak")
    expect(names).to_have_text(["Cellar"])
    page.get_by_label("Find projects").fill("")

    page.get_by_role("button", name="Rename: Cellar").click()
    say(page, "Rename", "Wine\n cellar ")
    expect(names.filter(has_text="Wine cellar")).to_have_count(1)
    page.get_by_role("button", name="Rename: Wine cellar").click()
    expect(page.get_by_label("Name of the project")).to_have_value("Wine cellar")
    say(page, "Rename", "Cellar")

    page.keyboard.press("Shift")  # only focus by keyboard stays when the list is drawn again
    page.get_by_role("button", name="Duplicate: Cellar").press("Enter")
    expect(names).to_have_count(3)
    expect(names.filter(has_text="Cellar (copy)")).to_have_count(1)
    expect(page.locator(".tag", has_text="oak")).to_have_count(2)

    page.get_by_role("button", name="More: Attic").click()
    page.get_by_role("button", name="Archive: Attic").click()
    expect(names).to_have_count(2)
    page.get_by_label("Which projects").select_option("Archived")
    expect(names).to_have_text(["Attic"])
    page.get_by_role("button", name="Unarchive: Attic").click()
    expect(page.get_by_text("Nothing is archived.")).to_be_visible()
    page.get_by_label("Which projects").select_option("In work")
    expect(names).to_have_count(3)
    picture(page, "projects-tagged")
    assert serious(page, "projects") == []

    page.get_by_role("button", name="More: Cellar", exact=True).click()
    page.get_by_role("button", name="Delete: Cellar", exact=True).click()
    deleted = page.locator(".toast", has_text="in the trash")
    deleted.hover()  # a hovered toast does not disappear
    expect(names).to_have_count(2)
    page.get_by_label("Which projects").select_option("Trash")
    expect(page.locator(".trash-list > li")).to_contain_text(["deleted by ann"])
    expect(page.locator(".trash-list > li")).to_contain_text(["2 objects"])
    picture(page, "projects-trash")
    assert serious(page, "trash") == []
    deleted.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("The trash is empty.")).to_be_visible()
    page.get_by_label("Which projects").select_option("In work")
    expect(names).to_have_count(3)
