"""Questions about faint edges in the elevation, each answered by one key."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.looks import picture
from tests.browser.serving import NewContext
from tests.browser.test_elevation import fronts, stored
from tests.browser.test_together import click_frame, sample
from tests.browser.together import Server, signed_in


def clicked_cabinet(page: Page) -> None:
    """The elevation of a front whose right and lower edges are faint, as tests/app/fakes/live.py finds it."""
    page.goto(f"{sample(page)}/annotate")
    page.get_by_label("Category of the next object").fill("cabinet")
    page.get_by_role("button", name="New object").click()
    click_frame(page, 100, 40)
    expect(page.get_by_role("button", name="cabinet_1", exact=True)).to_be_visible()
    page.get_by_role("link", name="Elevation").click()
    expect(fronts(page)).to_have_count(1)


def corners(page: Page) -> Any:
    (front,) = stored(page)
    return front["front"]["corners_m"]


def test_questions_about_faint_edges_are_answered_by_key(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    clicked_cabinet(page)
    tip = page.locator(".elevation .tip")
    expect(tip).to_contain_text("2 edges hardly show: Q asks")
    page.keyboard.press("q")
    expect(tip).to_contain_text("Is there a seam at the right edge of cabinet_1 (10 % sure)?")
    picture(page, "question")
    page.keyboard.press("x")  # the front is extended to the next line of the plane
    expect(tip).to_contain_text("Is there a seam at the bottom edge of cabinet_1 (20 % sure)?")
    page.keyboard.press("y")
    expect(tip).to_be_hidden()
    expect(fronts(page).first).to_contain_text("1205 × 600")
    assert corners(page)[1][0] == pytest.approx(1.805, abs=0.001)
    page.keyboard.press("Control+z")
    expect(tip).to_contain_text("2 edges hardly show")
    expect(fronts(page).first).to_contain_text("600 × 600")
