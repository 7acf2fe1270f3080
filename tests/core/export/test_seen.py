"""Observed fraction of each side of an object, and its description in words."""

from dataclasses import replace

import pytest

from r2c2r_core.export.looks import looks_of
from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.report import report_html, report_of
from r2c2r_core.export.review import review_html
from r2c2r_core.export.seen import Seen, seen_sides, unseen_words
from r2c2r_core.model.reconstruction import Reconstruction
from tests.core.export.kitchen import kitchen, reconstruction
from tests.core.export.test_report import certificate
from tests.core.export.test_scan_fit import filmed


def seen_in(item: Reconstruction) -> dict[str, Seen]:
    plan = plan_bundle(item.scene)
    return seen_sides(item, plan, looks_of(item.capture, plan))


def test_a_unit_filmed_frontally_is_observed_from_the_front_only() -> None:
    seen = seen_in(filmed(0.0))["drawer_1"]
    assert seen.sides["front"] > 0.95
    assert seen.sides["back"] == 0.0
    assert "back" in seen.unseen
    assert "front" not in seen.unseen
    assert min(seen.sides.values()) < seen.share < max(seen.sides.values())


def test_surface_hidden_by_an_unsegmented_object_is_not_observed() -> None:
    item = filmed(0.0)
    mask = item.tracks[0].masks[0]
    name = item.tracks[0].name
    covered = filmed(0.0, hidden_columns=mask.left + mask.box_width // 2)
    assert seen_in(covered)[name].sides["front"] == pytest.approx(seen_in(item)[name].sides["front"] / 2, abs=0.1)


def test_an_object_without_clicks_or_masks_has_no_coverage() -> None:
    item = filmed(0.0)
    unseen = replace(item.tracks[0], masks={})
    found = seen_in(replace(item, tracks=(unseen, item.tracks[1])))
    assert set(found) == {item.tracks[1].name}


@pytest.mark.parametrize(
    ("unseen", "words"),
    [
        ((), ""),
        (("back",), "not seen: back"),
        (("back", "left", "right"), "seen from the front only"),
        (("back", "left", "right", "top"), "seen from the front only"),
        (("front", "back", "left", "right"), "not seen: front, back, left, right"),
    ],
)
def test_unobserved_sides_are_described_in_plain_words(unseen: tuple[str, ...], words: str) -> None:
    assert unseen_words(unseen) == words


def test_manifest_report_and_review_mark_unobserved_sides() -> None:
    item, plan = reconstruction(), plan_bundle(kitchen())
    name = item.tracks[0].name
    seen = {name: Seen(share=0.314, sides={"front": 0.9, "back": 0.0, "left": 0.1, "right": 0.2, "top": 0.4})}
    manifest = manifest_of(item, plan, None, seen=seen)
    entry = next(entry for entry in manifest["objects"] if entry["name"] == name)
    assert entry["seen"]["share"] == 0.314
    assert entry["seen"]["unseen"] == ["back", "left", "right"]
    assert all(other["seen"] is None for other in manifest["objects"] if other is not entry)
    report = report_of(manifest, certificate(), {})
    assert next(row for row in report["objects"] if row["name"] == name)["seen"] == entry["seen"]
    page = report_html(manifest, report, {})
    assert "31 %" in page
    assert page.count("seen from the front only") == 1
    assert f"{name}: " in (review := review_html(plan, certificate(), None, seen))
    assert review.count("seen from the front only") == 1
