"""Long lists of objects and projects: search, order, and sticky headings."""

import re

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import rename, rows, sample
from tests.browser.together import Server, post, signed_in


def test_a_long_object_list_is_searchable_and_new_object_stays_visible(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    for number in range(14):
        category = "wall_cabinet" if number % 2 else "bottle"
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": category})
    page.goto(f"{project}/annotate")
    expect(rows(page)).to_have_count(16)
    page.locator(".objects-pane .scrolled").evaluate("pane => pane.scrollTo(0, 600)")
    expect(page.get_by_role("button", name="New object")).to_be_in_viewport()
    page.get_by_label("Find objects").fill("wall")
    expect(rows(page)).to_have_count(7)
    expect(rows(page).first).to_be_in_viewport()
    expect(page.locator(".find")).to_contain_text("7 of 16")
    expect(rows(page).first.locator(".badge")).to_have_text("4")  # its number on the picture
    picture(page, "many-objects")
    page.get_by_label("Find objects").fill("")
    expect(rows(page)).to_have_count(16)
    long = "double_sink_cabinet_by_the_window_on_the_left"
    rename(page, "drawer_1", long)
    pane = box_of(page.locator(".objects-pane"))
    for part in (page.get_by_role("button", name=f"Delete {long}"), page.get_by_label(f"Name of {long}")):
        part.scroll_into_view_if_needed()
        box = box_of(part)
        assert box["x"] + box["width"] <= pane["x"] + pane["width"]


def test_sixty_objects_are_grouped_locked_and_edited_together(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    project = sample(page)
    for number in range(58):
        category = ("wall_cabinet", "bottle", "mug", "chair")[number % 4]
        post(page, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": category})
    page.goto(f"{project}/annotate")
    expect(rows(page)).to_have_count(60)
    painted = "rows => rows.filter(row => row.querySelector('.head').checkVisibility({ contentVisibilityAuto: true })).length"
    assert rows(page).evaluate_all(painted) < 30  # only the visible ones

    first = page.locator(".object-list .pick").first
    first.evaluate("button => button.stays = true")
    page.get_by_role("button", name="Hide mug_1", exact=True).focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Show mug_1", exact=True)).to_be_focused()
    assert first.evaluate("button => button.stays")  # no other row was rebuilt
    stops = "rows => rows.filter(row => row.querySelector('.pick').tabIndex === 0).length"
    assert rows(page).evaluate_all(stops) == 1
    page.keyboard.press("ArrowDown")
    expect(page.get_by_role("button", name="Hide wall_cabinet_1", exact=True)).to_be_focused()

    page.get_by_label("Order of the objects").select_option("category")
    expect(page.locator(".object-list h2").first).to_have_text(re.compile(r"^bottle \d+"))
    page.locator(".objects-pane .scrolled").evaluate("pane => pane.scrollTo(0, 300)")
    expect(page.get_by_role("heading", name=re.compile("^bottle "))).to_be_in_viewport()  # the current group
    expect(page.get_by_role("heading", name="Objects", exact=True)).to_be_in_viewport()

    page.get_by_role("button", name=re.compile(", bottle_2$")).click()
    page.get_by_role("button", name="bottle_4", exact=True).click(modifiers=["Shift"])
    expect(page.get_by_label("Selected objects")).to_contain_text("3 objects")
    page.get_by_label("Name for all, numbered").fill("jar")
    page.get_by_label("Name for all, numbered").press("Enter")
    for number in (1, 2, 3):
        expect(page.get_by_role("button", name=f"jar_{number}", exact=True)).to_be_visible()
    page.get_by_label("Category for all").fill("sink")
    page.get_by_label("Category for all").press("Enter")
    expect(page.get_by_role("heading", name="sink 3")).to_be_visible()
    page.get_by_label("Selected objects").get_by_role("button", name="Lock").click()
    expect(page.get_by_label("Selected objects").get_by_role("button", name="Unlock")).to_be_visible()
    picture(page, "sixty-objects")
    page.get_by_label("Selected objects").get_by_role("button", name="Delete").click()
    wait_for_toast(page, "3 locked objects left out: jar_1 (by ann)")
    page.get_by_label("Which objects").select_option("locked")
    expect(page.locator(".object-list .pick")).to_have_count(3)
    page.reload()  # a lock is stored
    page.get_by_label("Which objects").select_option("locked")
    expect(page.locator(".object-list .pick")).to_have_count(3)
    page.get_by_role("button", name="jar_1", exact=True).click()
    page.keyboard.press("Shift+L")
    expect(page.get_by_label("Name of jar_1")).to_be_visible()
    page.get_by_role("button", name="Delete jar_1").click()
    wait_for_toast(page, "Deleted jar_1")
    page.get_by_label("Which objects").select_option("all")
    page.get_by_role("button", name="mug_1", exact=True).click()
    page.get_by_role("button", name="Delete mug_2", exact=True).click()
    wait_for_toast(page, "Deleted mug_2; undo brings it back")
    page.keyboard.press("Control+z")
    wait_for_toast(page, "Undone: deleted mug_2")  # not the chosen object's own last change
    page.get_by_role("button", name=re.compile(", mug_3$")).click()
    expect(page.get_by_role("button", name="mug_3", exact=True)).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_label("Name of mug_3")).to_be_visible()  # one object ticked by its circle is the chosen one


def test_projects_are_searched_and_sorted(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    for name in ("Cellar", "Attic", "Bath", "Attic two"):
        post(page, "/api/projects/sample", {"name": name})
    page.goto(server.address)
    names = page.locator(".card h2 a")
    expect(names).to_have_count(4)
    page.get_by_label("Order of the projects").select_option("name")
    expect(names).to_have_text(["Attic", "Attic two", "Bath", "Cellar"])
    page.get_by_label("Find projects").fill("attic")
    expect(names).to_have_text(["Attic", "Attic two"])
    picture(page, "many-projects")
