"""An admin puts a sample kitchen into somebody's queue, and sees the score."""

import csv
from pathlib import Path

from playwright.sync_api import expect

from tests.app.test_honeypots import write_truth
from tests.browser.looks import picture, scroll_to, serious
from tests.browser.serving import NewContext, wait_for_toast
from tests.browser.test_together import click_frame, ready, rows, sample
from tests.browser.together import Server, signed_in


def test_a_honeypot_is_assigned_annotated_and_scored(new_context: NewContext, own_server: Server) -> None:
    contexts = [new_context(bypass_csp=True) for _ in range(2)]  # bypass_csp for axe
    ann, cleo = (signed_in(context, own_server, name) for context, name in zip(contexts, ("ann", "cleo"), strict=True))
    project = sample(ann).split("/p/")[1]
    write_truth(own_server.data / "projects" / project / "source")

    ann.goto(f"{own_server.address}/people")
    ann.get_by_role("combobox", name="For", exact=True).select_option("cleo")
    ann.get_by_label("Called", exact=True).fill("Flat 7")
    ann.get_by_role("button", name="Add to the inbox").press("Enter")
    wait_for_toast(ann, "Flat 7 is in the inbox of cleo")
    line = ann.get_by_role("region", name="Honeypots").locator("tbody tr")
    expect(line).to_contain_text("0 of 2")

    cleo.goto(own_server.address)
    cleo.locator("r2c2r-who").get_by_role("link", name="Inbox").press("Enter")
    cleo.get_by_role("link", name="Flat 7").press("Enter")
    cleo.get_by_role("link", name="Click objects").press("Enter")
    ready(cleo)
    cleo.goto(f"{cleo.url.split('?')[0]}?frame=3")
    ready(cleo)
    cleo.get_by_label("Category of the next object").fill("cabinet")
    click_frame(cleo, 140, 20)  # on no object
    expect(rows(cleo)).to_have_count(1)
    expect(rows(cleo).last).to_contain_text("3 frames")
    cleo.goto(f"{own_server.address}/people")
    expect(cleo.get_by_role("heading", name="Your own password")).to_be_visible()
    expect(cleo.get_by_role("heading", name="Honeypots")).to_be_hidden()

    ann.reload()
    expect(line.locator("td").nth(1)).to_have_text("0 of 2")
    expect(line.locator("td").nth(2)).to_have_text("1")
    expect(line.locator("th")).to_have_text("cleo")
    scroll_to(line)
    picture(ann, "honeypots")
    assert serious(ann, "people with honeypots") == []
    ann.set_viewport_size({"width": 390, "height": 800})
    assert ann.evaluate("document.documentElement.scrollWidth") <= 390
    ann.set_viewport_size({"width": 1280, "height": 720})
    with ann.expect_download() as waiting:
        ann.get_by_role("link", name="Table of effort of Flat 7").press("Enter")
    told = list(csv.DictReader(Path(waiting.value.path()).read_text().splitlines()))
    assert [one["true object"] for one in told if one["true object"]] == ["front_1", "oven_1"]
