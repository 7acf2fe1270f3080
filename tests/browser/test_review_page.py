"""review.html of a bundle, opened as a file: the scene is drawn, and joints move it."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, expect

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.review import review_html
from tests.browser.serving import NewContext
from tests.core.export.kitchen import kitchen
from tests.core.export.test_report import certificate
from tests.waiting import until


def shot(page: Page) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(page.locator("#view").screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(image, dtype=np.int32)


def shot_when(page: Page, shows: Callable[[np.ndarray], bool]) -> np.ndarray:
    """Screenshot of the view once the condition holds and two in a row are equal, as software GL is slow."""
    seen = [shot(page)]

    def still() -> bool:
        seen.append(shot(page))
        return shows(seen[-1]) and np.array_equal(seen[-1], seen[-2])

    until(still, "the view never showed it")
    return seen[-1]


def test_review_html_renders_the_scene_and_moves_joints_without_a_server(new_context: NewContext, tmp_path: Path) -> None:
    file = tmp_path / "review.html"
    file.write_text(review_html(plan_bundle(kitchen()), certificate(), np.array([0.0, -3.0, 1.5])), encoding="utf-8")
    page = new_context(viewport={"width": 900, "height": 600}).new_page()
    thrown: list[str] = []
    page.on("pageerror", lambda error: thrown.append(str(error)))
    page.goto(file.as_uri())
    closed = shot_when(page, lambda seen: seen[:, :500].std() > 15)  # not an empty sky
    page.get_by_label("cabinet_1_hinge").fill("1.5")
    shot_when(page, lambda seen: (np.abs(seen - closed)[:, :500].max(axis=2) > 30).mean() > 0.005)
    page.get_by_role("button", name="Close all").click()
    expect(page.locator("output").first).to_have_text("0°")
    assert thrown == []
