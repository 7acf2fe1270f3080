"""Import of a recording on the server's machine: a refused path stays with its reason, one in an allowed folder is imported."""

from playwright.sync_api import expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext, box_of
from tests.browser.together import Server, signed_in


def test_a_refused_import_path_stays_with_the_reason_and_the_remedy(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    page.goto(server.address)
    page.get_by_role("button", name="From this machine…").click()
    field = page.get_by_label("Path on this machine")
    box = box_of(field)
    assert box["width"] > 480  # some 60 characters
    field.fill("/usr/share/kitchen.r3d")
    field.press("Enter")
    alert = page.get_by_role("dialog").get_by_role("alert")
    expect(alert).to_contain_text("/usr/share/kitchen.r3d is outside the folders that recordings may be imported from")
    expect(alert).to_contain_text("--import-from DIR")
    expect(field).to_have_value("/usr/share/kitchen.r3d")
    picture(page, "import-refused")
