"""Projects are tagged, archived, duplicated and deleted from their list, and each of these is undone there."""

import pytest
from playwright.sync_api import expect

from tests.browser.serving import NewContext
from tests.browser.test_journey import picture
from tests.browser.test_many import post
from tests.browser.test_pages import serious
from tests.browser.test_together import say
from tests.browser.together import Server, signed_in


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_nothing_that_is_put_away_is_lost(new_context: NewContext, server: Server, theme: str) -> None:
    context = new_context(color_scheme=theme, bypass_csp=True)
    page = signed_in(context, server, "ann")
    for name in ("Cellar", "Attic"):
        post(page, "/api/projects/sample", {"name": name})
    names = page.locator(".cards h2 a")
    expect(page.get_by_text("annotating")).to_have_count(2)
    page.get_by_role("button", name="Tags: Cellar").click()
    say(page, "Keep", "oak, Flat 3")
    page.get_by_role("button", name="oak", exact=True).click()
    expect(page.get_by_label("Find projects")).to_have_value("oak")
    expect(names).to_have_text(["Cellar"])
    page.get_by_label("Find projects").fill("")

    page.get_by_role("button", name="Duplicate: Cellar").press("Enter")
    expect(names).to_have_count(3)
    expect(names.filter(has_text="Cellar (copy)")).to_have_count(1)
    expect(page.locator(".tag", has_text="oak")).to_have_count(2)

    page.get_by_role("button", name="Archive: Attic").click()
    expect(names).to_have_count(2)
    page.get_by_label("Which projects").select_option("Archived")
    expect(names).to_have_text(["Attic"])
    page.get_by_role("button", name="Take out: Attic").click()
    expect(page.get_by_text("Nothing is archived.")).to_be_visible()
    page.get_by_label("Which projects").select_option("In work")
    expect(names).to_have_count(3)
    picture(page, f"projects-tagged-{theme}")
    assert serious(page, "projects") == []

    page.get_by_role("button", name="Delete: Cellar", exact=True).click()
    deleted = page.locator(".toast", has_text="in the trash")
    deleted.hover()  # from under the mouse it does not go
    expect(names).to_have_count(2)
    page.get_by_label("Which projects").select_option("Trash")
    expect(page.locator(".trash-list > li")).to_contain_text(["deleted by ann"])
    expect(page.locator(".trash-list > li")).to_contain_text(["2 objects"])
    picture(page, f"projects-trash-{theme}")
    assert serious(page, "trash") == []
    deleted.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("The trash is empty.")).to_be_visible()
    page.get_by_label("Which projects").select_option("In work")
    expect(names).to_have_count(3)
