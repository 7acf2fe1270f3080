"""A project's names and categories are stored as a template, and adopted as a list of objects to click."""

from playwright.sync_api import expect

from tests.browser.looks import picture, scroll_to, serious
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import click_frame, pick, ready, rows, sample, say, viewed
from tests.browser.together import Server, signed_in


def test_a_template_is_saved_edited_adopted_and_clicked(new_context: NewContext, own_server: Server) -> None:
    context = new_context(bypass_csp=True)  # bypass_csp for axe
    page = signed_in(context, own_server, "ann")
    page.goto(own_server.address)
    expect(page.get_by_label("Objects to click")).to_be_hidden()  # there is no template yet
    page.goto(sample(page))
    viewed(page)
    page.get_by_role("button", name="Keep this project's objects as a template…").press("Enter")
    expect(page.get_by_role("dialog")).to_contain_text("2 objects: names and categories, no clicks")
    say(page, "Keep", "Flat 3")
    wait_for_toast(page, "Flat 3 is a template")

    page.get_by_role("region", name="Objects to click").get_by_role("link", name="Templates").press("Enter")
    page.locator("summary", has_text="Flat 3").press("Enter")
    objects = page.get_by_label("Objects of Flat 3")
    expect(objects).to_have_value("drawer_1, drawer\nmug_1, mug")
    objects.press("Control+End")
    objects.press_sequentially("\noven_1, oven\nrange hood; hood")
    page.get_by_role("button", name="Save").press("Enter")
    expect(page.locator("summary", has_text="4 objects")).to_be_visible()
    page.locator("summary", has_text="Flat 3").press("Enter")
    expect(objects).to_have_value("drawer_1, drawer\nmug_1, mug\noven_1, oven\nrange_hood, hood")
    picture(page, "templates")
    assert serious(page, "templates") == []
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.set_viewport_size({"width": 1280, "height": 720})

    page.goto(own_server.address)  # when creating a project
    page.get_by_label("Objects to click").select_option("Flat 3")
    picture(page, "templates-projects")
    page.get_by_role("button", name="Sample kitchen", exact=True).click()
    page.wait_for_url("**/p/*")
    project = page.url
    todo = page.get_by_role("region", name="Objects to click")
    expect(todo).to_contain_text("2 of 4 are clicked. Still to click: oven_1, range_hood.")
    scroll_to(todo)
    picture(page, "templates-overview")
    assert serious(page, "overview with objects to click") == []

    page.goto(f"{project}/annotate?frame=3")
    ready(page)
    name, category = (page.get_by_label(f"{what} of the next object") for what in ("Name", "Category"))
    left = page.locator(".checklist")
    expect(left).to_contain_text("Still to click: 2 of 4")
    expect(name).to_have_value("oven_1")
    expect(category).to_have_value("oven")
    picture(page, "templates-annotate")
    assert serious(page, "annotate with objects to click") == []
    click_frame(page, 30, 60)
    expect(page.get_by_label("Name of oven_1")).to_have_value("oven_1")
    expect(page.get_by_label("Category of oven_1")).to_have_value("oven")
    expect(left).to_contain_text("Still to click: 1 of 4")
    expect(name).to_have_value("range_hood")
    page.keyboard.press("Control+z")
    expect(left).to_contain_text("Still to click: 2 of 4")
    page.keyboard.press("Control+Shift+z")
    expect(left).to_contain_text("Still to click: 1 of 4")

    page.keyboard.press("Shift+N")  # none of the list
    expect(name).to_have_value("")
    category.fill("bottle")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 130, 30)
    expect(page.get_by_label("Name of bottle_1")).to_be_visible()
    expect(left).to_contain_text("Still to click: 1 of 4")
    page.keyboard.press("Shift+N")
    expect(name).to_have_value("range_hood")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 130, 100)
    pick(page, "range_hood")
    expect(page.get_by_label("Category of range_hood")).to_have_value("hood")
    expect(rows(page)).to_have_count(5)
    expect(left).to_be_hidden()
    expect(name).to_be_hidden()

    page.goto(project)  # and later
    expect(todo).to_contain_text("4 of 4 are clicked.")
    page.get_by_label("Take the objects of").select_option("none")
    expect(todo).to_contain_text("Annotate offers them")
    page.get_by_label("Take the objects of").select_option("Flat 3 (4)")
    expect(todo).to_contain_text("4 of 4 are clicked.")
