"""Accounts, from the admin's page to the person's own."""

import json
import re
import shutil
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import expect

from app.files import project_files
from tests.browser.looks import picture
from tests.browser.serving import NewContext, printed_again, served, wait_for_toast
from tests.browser.test_together import both, sample
from tests.browser.together import Server, ask, signed_in
from tests.waiting import until


@pytest.fixture
def webhooks_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("R2C2R_WEBHOOKS_TO", "127.0.0.0/8")


def test_an_added_account_signs_in_and_a_removed_one_is_signed_out(new_context: NewContext, own_server: Server) -> None:
    contexts = [new_context() for _ in range(2)]
    ann = signed_in(contexts[0], own_server, "ann")
    ann.goto(own_server.address)
    ann.get_by_role("link", name="People").click()
    ann.get_by_label("Name").fill("carl")
    ann.get_by_label("Password, at least 10 characters", exact=True).fill("carl123456")
    ann.get_by_role("button", name="Add").click()
    wait_for_toast(ann, "is little more than the account's own name")
    ann.get_by_label("Password, at least 10 characters", exact=True).fill("a password of carl")
    ann.get_by_role("button", name="Add").click()
    wait_for_toast(ann, "carl may sign in now")

    carl = contexts[1].new_page()
    carl.goto(f"{own_server.address}/login")
    carl.get_by_label("Name").fill("carl")
    carl.get_by_label("Password").fill("a password of carl")
    carl.get_by_role("button", name="Sign in").click()
    carl.get_by_role("heading", name="Projects").wait_for()
    me = carl.locator("r2c2r-who").get_by_role("link", name="carl")
    expect(me).to_have_attribute("title", "annotator: your account")
    me.click()
    expect(carl.get_by_role("heading", name="Your own password")).to_be_visible()
    expect(carl.get_by_role("heading", name="Your account")).to_be_visible()
    expect(carl.get_by_role("heading", name="Accounts")).to_be_hidden()

    ann.get_by_label("Role of carl").select_option("reviewer")
    wait_for_toast(ann, "carl is reviewer now")
    expect(me).to_have_attribute("title", "reviewer: your account")  # updated without reload
    ann.reload()
    record = ann.locator("r2c2r-audit-record")
    expect(record.get_by_role("row", name="role annotator → reviewer carl ann")).to_be_visible()
    expect(record.get_by_role("row", name="signed in by password carl carl")).to_be_visible()
    picture(ann, "21-people")

    ann.once("dialog", lambda dialog: dialog.accept())
    ann.get_by_role("button", name="Remove carl").click()
    expect(ann.get_by_label("Role of carl")).to_have_count(0)
    expect(carl.get_by_role("button", name="Sign in")).to_be_visible()  # his open page is signed out
    carl.goto(own_server.address)
    expect(carl.get_by_role("button", name="Sign in")).to_be_visible()


def test_used_printed_addresses_and_wrong_passwords_are_explained(
    new_context: NewContext, tmp_path: Path, own_server: Server
) -> None:
    context = new_context()
    page = context.new_page()
    other = tmp_path / "other"
    other.mkdir()
    with served(other) as address:
        page.goto(address)
        expect(page.get_by_role("heading", name="Projects")).to_be_visible()
        stranger = new_context()
        late = stranger.new_page()
        late.goto(address)
        expect(late.get_by_text("each printed address works once, in one browser")).to_be_visible()
        assert "token" not in late.url
        picture(late, "22-address-used")
        late.goto(printed_again(address))
        expect(late.get_by_role("heading", name="Projects")).to_be_visible()
        stranger.close()
    page.goto(f"{own_server.address}/login")
    page.get_by_label("Name").fill("ann")
    page.get_by_label("Password").fill("not hers at all")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert")).to_contain_text("the name or the password is wrong")
    expect(page.get_by_role("button", name="Sign in")).to_be_enabled()


@pytest.mark.usefixtures("webhooks_here")
def test_webhooks_are_added_tested_and_removed_by_keyboard(new_context: NewContext, own_server: Server) -> None:
    heard: list[str] = []

    class Listening(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            heard.append(json.loads(self.rfile.read(int(self.headers["content-length"])))["event"])
            self.send_response(503 if len(heard) == 1 else 204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Silence the log."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Listening) as listening:
        threading.Thread(target=listening.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{listening.server_port}/r2c2r"
        context = new_context()
        ann = signed_in(context, own_server, "ann")
        ann.goto(own_server.address)
        ann.keyboard.press("Control+k")
        ann.keyboard.type("Webhooks")
        ann.keyboard.press("Enter")
        expect(ann.get_by_role("heading", name="Webhooks")).to_be_visible()
        ann.get_by_label("Address").focus()
        ann.keyboard.type(url)
        ann.keyboard.press("Enter")
        secret = ann.get_by_label("Secret", exact=True)
        expect(secret).to_be_focused()
        assert len(secret.input_value()) > 30
        for _ in range(2):
            ann.keyboard.press("Tab")
        expect(ann.get_by_role("button", name="I have it")).to_be_focused()
        ann.keyboard.press("Enter")
        expect(secret).to_be_hidden()

        test = ann.get_by_role("button", name=f"Send a test to {url}")
        answers = ann.get_by_role("region", name="Answers")
        for answer in ("503 given up", "204 delivered"):
            test.focus()
            ann.keyboard.press("Enter")
            expect(answers.get_by_role("row", name=f"test {answer}")).to_be_visible()
        expect(test).to_be_focused()  # the list was rebuilt meanwhile
        expect(ann.get_by_role("row", name=url)).to_contain_text("204, delivered just now")
        picture(ann, "25-webhooks")
        ann.get_by_role("button", name=f"Answers of {url}").press("Enter")
        expect(answers).to_be_hidden()

        ann.once("dialog", lambda dialog: dialog.accept())
        ann.get_by_role("button", name=f"Remove {url}").press("Enter")
        expect(ann.get_by_text("None yet.")).to_be_visible()
        assert heard == ["test", "test"]
        context.close()
        listening.shutdown()


def test_a_project_is_restricted_to_members_chosen_by_its_owner(new_context: NewContext, server: Server) -> None:
    ann, bea = both(new_context, server)
    bea.goto(server.address)
    ann.goto(sample(ann))
    card = bea.locator(".cards > li").get_by_role("link")
    expect(card).to_have_count(1)

    panel = ann.get_by_role("region", name="Who sees this project")
    nobody = panel.get_by_text("No members yet")
    panel.get_by_label("Everybody who may sign in").press("ArrowDown")
    expect(nobody).to_be_visible()
    expect(panel.get_by_label("Only these people")).to_be_focused()
    expect(card).to_have_count(0)  # removed without reload

    name = panel.get_by_label("Name")
    name.fill("zoe")
    name.press("Enter")
    wait_for_toast(ann, "there is no account zoe")
    name.press("Control+a")
    panel.get_by_role("group").evaluate("choices => (choices.dataset.before = '')")
    ask(ann, "PATCH", f"/api/projects/{ann.url.split('/p/')[1]}", {"tags": ["north"]})
    expect(panel.locator("[data-before]")).to_have_count(0)  # rebuilt after changes by others
    ann.keyboard.insert_text("al")
    expect(name).to_have_value("al")
    name.fill("bea")
    name.press("Enter")
    expect(panel.get_by_role("listitem")).to_have_text(re.compile("bea"))
    expect(name).to_be_focused()
    expect(name).to_have_value("")
    below = "card => card.parentElement.nextElementSibling.getBoundingClientRect().top - card.getBoundingClientRect().bottom"
    ann.wait_for_function(f"({below})(document.activeElement.closest('section')) >= 12")  # px between the card and what follows
    picture(ann, "23-members")

    card.click()  # it is shown again
    told = bea.get_by_role("region", name="Who sees this project")
    expect(told).to_contain_text("Only ann, bea and admins see it")
    expect(told.get_by_role("radio")).to_have_count(0)

    panel.get_by_role("button", name="Remove bea").press("Enter")  # while she has it open
    expect(name).to_be_focused()
    wait_for_toast(bea, "Sample kitchen is kept to its members now")
    expect(bea.get_by_role("heading", name="Projects")).to_be_visible()
    expect(card).to_have_count(0)
    panel.get_by_label("Everybody who may sign in").check()
    expect(card).to_have_count(1)


def test_an_admin_leaves_or_adopts_a_folder_set_aside(new_context: NewContext, server: Server) -> None:
    context = new_context()
    ann = signed_in(context, server, "ann")
    project = sample(ann).rsplit("/", 1)[1]
    files = project_files(server.data, project)
    until(lambda: files.description.exists() and "mug_1" in files.description.read_text())  # written with a short delay
    shutil.copytree(files.root, server.data / "unknown" / project)
    for place in ("projects", "trash"):
        address = f"{server.address}/api/{place}/{project}"
        assert ann.request.delete(address, headers={"X-Requested-With": "tests", "Origin": server.address}).ok

    ann.goto(server.address)
    aside = ann.get_by_role("region", name="Set aside")
    expect(aside).to_contain_text(str(server.data / "unknown" / project))
    picture(ann, "24-set-aside")
    aside.get_by_role("button", name="Leave it there").click()
    wait_for_toast(ann, "stays where it is")
    aside.get_by_text("1 folder left in place").click()
    card = ann.locator(f".cards a[href='/p/{project}']")
    expect(card).to_have_count(0)
    aside.get_by_role("button", name="Adopt Sample kitchen").click()
    expect(card).to_have_count(1)
    expect(aside).to_be_hidden()
    card.click()
    ann.get_by_role("link", name="Run on 2 objects").wait_for()
