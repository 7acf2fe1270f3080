"""Accounts, from the admin's page to the one they are about."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.test_journey import picture
from tests.browser.together import Server, signed_in


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("people")) as running:
        yield running


def test_who_is_added_may_work_and_who_is_removed_is_shown_out(browser: Browser, server: Server) -> None:
    contexts = [browser.new_context(viewport={"width": 1280, "height": 720}) for _ in range(2)]
    ann = signed_in(contexts[0], server, "ann")
    ann.get_by_role("link", name="People").click()
    ann.get_by_label("Name").fill("carl")
    ann.get_by_label("Password, from 10 characters", exact=True).fill("a password of carl")
    ann.get_by_role("button", name="Add").click()
    expect(ann.locator(".toast", has_text="carl may sign in now")).to_be_visible()

    carl = signed_in(contexts[1], server, "carl", "a password of carl")
    me = carl.locator("r2c2r-who").get_by_role("link", name="carl")
    expect(me).to_have_attribute("title", "annotator: accounts and your password")
    me.click()
    expect(carl.get_by_role("heading", name="Your own password")).to_be_visible()
    expect(carl.get_by_role("heading", name="Accounts")).to_be_hidden()

    ann.get_by_label("Role of carl").select_option("reviewer")
    expect(ann.locator(".toast", has_text="carl is reviewer now")).to_be_visible()
    expect(me).to_have_attribute("title", "reviewer: accounts and your password")  # by itself
    picture(ann, "21-people")

    ann.once("dialog", lambda dialog: dialog.accept())
    ann.get_by_role("button", name="Remove carl").click()
    expect(ann.get_by_role("row", name="carl")).to_have_count(0)
    expect(carl.get_by_role("button", name="Sign in")).to_be_visible()  # his open page is shown out
    carl.goto(server.address)
    expect(carl.get_by_role("button", name="Sign in")).to_be_visible()
    for context in contexts:
        context.close()
