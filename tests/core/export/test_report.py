import re
from html.parser import HTMLParser

import numpy as np

from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.report import report_html, report_of
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.writers.table import FORMATS
from r2c2r_core.model.report import ALIKE, Blocker, Certificate, JointResult, LoaderResult, ThingResult
from r2c2r_core.robot.certificate import Grip, GripperCertificate, gripper_to_json
from tests.core.export.kitchen import kitchen, reconstruction

EVIL = '<script>alert("x")</script>'


def certificate(**changes: object) -> Certificate:
    values = {
        "passed": True,
        "likeness": ALIKE,
        "findings": (),
        "loaders": (LoaderResult(loader="PyBullet", state="not tried", detail=f"not installed {EVIL}"),),
        "joints": (JointResult(joint="cabinet_1_hinge", deepest_penetration_m=0.0001, travel_reached=1.0),),
        "rest_penetration_m": 0.0,
        "drift_m": 0.001,
        "realtime_factor": 12.0,
    }
    return Certificate(**(values | changes))  # type: ignore[arg-type]


def page(judged: Certificate, failures: dict[str, str] | None = None, **manifest_changes: object) -> str:
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None) | manifest_changes
    return report_html(manifest, report_of(manifest, judged, failures or {}), {"cabinet_1": "pictures/cabinet_1.jpg"})


class Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.seen: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))


def tags(text: str) -> Tags:
    parser = Tags()
    parser.feed(text)
    return parser


def test_data_is_html_escaped_in_the_report() -> None:
    hit = finding("tree", EVIL, EVIL)
    capture = {"name": EVIL, "sha256": EVIL, "format": EVIL, "frames": EVIL}
    text = page(certificate(findings=(hit,)), {EVIL: EVIL}, capture=capture, tool_version=EVIL, created=EVIL)
    names = [tag for tag, _ in tags(text).seen]
    assert "script" not in names
    assert not [attrs for _, attrs in tags(text).seen if any(key.startswith("on") for key in attrs)]
    assert "&lt;script&gt;" in text


def test_the_report_references_images_by_relative_path() -> None:
    sources = [attrs["src"] for tag, attrs in tags(page(certificate())).seen if tag == "img"]
    assert sources == ["preview.png", "pictures/cabinet_1.jpg"]
    assert not re.search(r"https?://", page(certificate()))


def test_the_report_shows_a_failed_certificate_with_its_reasons() -> None:
    hit = finding("travel", "drawer_1_slide", "opens 3 % of its range under 30 N")
    text = page(certificate(passed=False, findings=(hit,)), {"mug_1": "no frame shows it"})
    for words in ("failed", "opens 3 % of its range", "mug_1", "no frame shows it", "not tried"):
        assert words in text


def test_unmeasured_values_are_shown_as_a_dash() -> None:
    nan = float("nan")
    text = page(certificate(passed=False, joints=(), rest_penetration_m=nan, drift_m=nan, realtime_factor=nan))
    assert "nan" not in text.lower().replace("finance", "")
    assert "–" in text


def test_the_json_report_omits_the_realtime_factor() -> None:
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None)
    report = report_of(manifest, certificate(), {"mug_1": "not seen"})
    assert report["version"] == 1
    assert "realtime_factor" not in report["certificate"]
    assert [entry["name"] for entry in report["objects"]] == [item.name for item in kitchen().objects]
    assert report["failures"] == {"mug_1": "not seen"}
    assert set(report["losses"]) == {entry.file for entry in FORMATS}
    assert np.isfinite(report["objects"][0]["placement_rms_m"])


def test_the_report_lists_joint_blockers_and_object_stability() -> None:
    joint = JointResult(
        joint="cabinet_1_hinge",
        deepest_penetration_m=0.0,
        travel_reached=1.0,
        blocked_by=(
            Blocker(name="drawer_1_slide", kind="joint", position=1.6),
            Blocker(name="chair_body", kind="thing", position=0.5),
        ),
    )
    thing = ThingResult(name="mug_1_body", drift_m=0.0002, opening_free=0.97)
    text = page(certificate(joints=(joint,), things=(thing,))).replace("<wbr>", "")
    for words in ("drawer_1_slide</code> when open, from 92°", "chair_body</code>, from 29°", "mug_1_body", "0.2 mm", "97 %"):
        assert words in text


def test_the_report_groups_findings_by_rule_and_warnings_by_object() -> None:
    hits = (finding("together", "a_joint", "meets b"), finding("together", "c_joint", "meets d"))
    text = page(certificate(findings=hits))
    assert text.count("<strong>together</strong>") == 1
    assert text.count("<li><code>a_<wbr>joint</code> meets b</li><li><code>c_<wbr>joint</code> meets d</li>") == 1
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None)
    manifest["objects"][0]["warnings"] = [EVIL]
    noted = report_html(manifest, report_of(manifest, certificate(), {}), {})
    assert '<tr class="noted"><td rowspan="2">' in noted
    assert '<td colspan="9"><ul class="quiet"><li>&lt;script&gt;' in noted


def test_the_report_shows_why_the_gripper_tried_nothing_and_why_a_trial_has_no_result() -> None:
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None)
    text = report_html(manifest, report_of(manifest, certificate(), {}, {"why": f"a process was lost {EVIL}"}), {})
    assert "<h2>A gripper</h2><p>Not tried: a process was lost &lt;script&gt;" in text
    lost = gripper_to_json(GripperCertificate(grips=(Grip(kind="joint", name="a", method=None, passed=False, why="lost"),)))
    text = report_html(manifest, report_of(manifest, certificate(), {}, lost), {})
    assert "opened and closed 0 of 1 joints" in text
    assert "<td>lost</td>" in text


def test_the_report_shows_the_arm_map_or_why_it_was_not_tried() -> None:
    grip = {"kind": "joint", "name": "cabinet_1_hinge", "method": "pinch", "passed": True, "film": "cabinet_1_hinge", "why": ""}
    grip |= dict.fromkeys(("grip_n", "opened", "slip_m", "off_m", "force_n", "blame"))
    arm = {
        "arm": {"name": "Franka Panda", "source": "a wheel, Apache-2.0"},
        "joints_in_reach": 1,
        "joints": 2,
        "joints_opened": 1,
        "places": [{}],
        "grips": [grip],
    }
    manifest = manifest_of(reconstruction(), plan_bundle(kitchen()), None)
    text = report_html(manifest, report_of(manifest, certificate(), {}, arm=arm), {})
    assert "reaches 1 of 2 joints" in text
    assert {"arm/standing.svg", "arm/cabinet_1_hinge.jpg"} <= {attrs.get("src") for _, attrs in tags(text).seen}
    text = report_html(manifest, report_of(manifest, certificate(), {}, arm={"why": f"no extra {EVIL}"}), {})
    assert "Not tried: no extra &lt;script&gt;" in text
