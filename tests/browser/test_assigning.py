"""Assignment of objects to people: shown and searchable in the list, and in their inbox."""

import re

from playwright.sync_api import expect

from tests.browser.looks import picture, serious
from tests.browser.serving import NewContext, box_of, wait_for_toast
from tests.browser.test_together import both, pick, rows, sample
from tests.browser.together import Server, post


def test_assigned_objects_are_counted_in_the_inbox_of_the_assignee(new_context: NewContext, server: Server) -> None:
    ann, bea = both(new_context, server, bypass_csp=True)  # for axe
    project = sample(ann)
    for _ in range(10):
        post(ann, f"/api/projects/{project.split('/p/')[1]}/objects", {"category": "bottle"})
    ann.goto(f"{project}/annotate")
    bea.goto(server.address)
    inbox = bea.locator("r2c2r-who").get_by_role("link", name="Inbox")

    # one object, by keyboard, in the list; undone and redone
    pick(ann, "drawer_1")
    whose = ann.get_by_label("drawer_1 is assigned to")
    whose.focus()
    whose.press("b")
    expect(whose).to_have_value("bea")
    wait_for_toast(ann, "drawer_1: assigned to bea")
    expect(inbox).to_have_text("Inbox 1")
    expect(rows(ann).first).to_contain_text("@bea")
    ann.get_by_role("button", name="Undo", exact=True).click()
    expect(whose).to_have_value("")
    expect(inbox).to_have_text("Inbox")
    ann.get_by_role("button", name="Redo", exact=True).click()
    expect(inbox).to_have_text("Inbox 1")

    # several objects, from the bar and from the command palette
    ann.get_by_role("button", name="bottle_1", exact=True).click(modifiers=["Control"])
    ann.get_by_role("button", name="bottle_3", exact=True).click(modifiers=["Shift"])
    ann.get_by_label("Assign all to").select_option("bea")
    wait_for_toast(ann, "3 objects: assigned to bea")
    expect(inbox).to_have_text("Inbox 4")
    picture(ann, "objects-assigned")
    assert serious(ann, "objects assigned") == []
    ann.get_by_label("Selected objects").get_by_role("button", name="None").click()
    ann.get_by_role("button", name="bottle_3", exact=True).click()
    ann.keyboard.press("Control+k")
    ann.keyboard.type("assign to nobody")
    ann.keyboard.press("Enter")
    expect(inbox).to_have_text("Inbox 3")

    # search by assignee
    ann.get_by_label("Which objects").select_option("nobodys")
    expect(rows(ann)).to_have_count(9)
    ann.get_by_label("Which objects").select_option("all")
    ann.get_by_label("Find objects").fill("@bea")
    expect(rows(ann)).to_have_count(4)  # the selected one stays visible

    # from the inbox to the object, and done
    inbox.click()
    mine = bea.get_by_role("region", name=re.compile("^Objects assigned to you"))
    expect(mine.get_by_role("link")).to_have_text(["drawer_1", "bottle_1", "bottle_2"])
    picture(bea, "objects-inbox")
    assert serious(bea, "inbox with objects") == []
    bea.set_viewport_size({"width": 390, "height": 800})
    assert bea.evaluate("document.documentElement.scrollWidth") <= 390
    bea.set_viewport_size({"width": 1280, "height": 720})
    mine.get_by_role("button", name="Done: bottle_1").press("Enter")
    expect(mine.get_by_role("link")).to_have_text(["drawer_1", "bottle_2"])
    expect(inbox).to_have_text("Inbox 2")
    mine.get_by_role("link", name="drawer_1").press("Enter")
    expect(bea.get_by_label("drawer_1 is assigned to")).to_have_value("bea")
    bea.get_by_label("Which objects").select_option("mine")
    expect(rows(bea)).to_have_count(2)
    lock, eye = (box_of(rows(bea).first.get_by_role("button", name=name)) for name in ("Lock drawer_1", "Hide drawer_1"))
    assert lock["y"] == eye["y"]
