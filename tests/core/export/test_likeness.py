"""Plausibility check of the scene against the film, from the manifest alone."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from r2c2r_core.export.lint import lint
from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.rules.likeness import judge_likeness
from r2c2r_core.export.rules.table import LIKENESS_RULES, finding
from r2c2r_core.model.contradiction import Contradiction
from r2c2r_core.model.report import Finding
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.synthesize.clearance import open_freely
from tests.core.export.kitchen import cabinet, kitchen, reconstruction
from tests.core.export.kitchen import counter as counter_at

SAID = Contradiction(
    rule="same-thing", objects=("cabinet_1", "drawer_1"), message="both are on the same thing", mend="delete one"
)


def findings(folder: Path, document: dict[str, Any]) -> list[Finding]:
    (folder / "manifest.json").write_text(json.dumps(document))
    return [found for found in lint(folder) if found.rule in LIKENESS_RULES or found.rule == "manifest-schema"]


def document(scene: ArticulatedScene, *said: Contradiction) -> dict[str, Any]:
    return manifest_of(replace(reconstruction(scene), contradictions=said), plan_bundle(scene), None)


def test_a_segmenter_contradiction_is_a_finding(good_folder: Path) -> None:
    assert findings(good_folder, document(kitchen())) == []
    (found,) = findings(good_folder, document(kitchen(), SAID))
    assert (found.rule, found.severity, found.where) == ("same-thing", "error", "cabinet_1, drawer_1")
    assert found.message == "both are on the same thing; delete one"


def test_a_finding_about_one_object_does_not_repeat_its_name(good_folder: Path) -> None:
    unsure = Contradiction(rule="edge-unsure", objects=("cabinet_1",), message="cabinet_1 is 35 % sure", mend="draw it")
    (found,) = findings(good_folder, document(kitchen(), unsure))
    assert (found.where, found.message) == ("cabinet_1", "is 35 % sure; draw it")


def test_a_door_with_strongly_reduced_travel_is_a_finding(good_folder: Path) -> None:
    scene = kitchen()
    for share, count in ((0.6, 0), (0.4, 1)):
        cut = replace(scene, objects=tuple(_cut(item, share) for item in scene.objects))
        assert len(findings(good_folder, document(cut))) == count


def test_low_confidence_hinges_share_one_finding(good_folder: Path) -> None:
    said = document(kitchen())
    doors = [item["name"] for item in said["objects"] if item["joint"] and item["joint"]["type"] == "revolute"]
    for item in said["objects"]:
        for joint in item["joints"]:
            joint["confidence"] = 0.75 if item["name"] in doors else None
    (found,) = findings(good_folder, said)
    assert (found.rule, found.severity, found.where) == ("hinge-unsure", "warning", ", ".join(sorted(doors)))
    for item in said["objects"]:
        for joint in item["joints"]:
            joint["confidence"] = 0.98
    assert findings(good_folder, said) == []


def test_an_ambiguous_placement_is_reported_with_the_alternative_angle(good_folder: Path) -> None:
    said = document(kitchen())
    placement = next(item for item in said["objects"] if item["placement"])["placement"]
    placement |= {"unsure": True, "runner_up_turn_deg": 90.0}
    (found,) = findings(good_folder, said)
    assert found.rule == "place-unsure"
    assert "90°" in found.message


def test_likeness_ignores_other_rules_and_lists_each_object_once() -> None:
    about = [
        finding("hinge-unsure", "cabinet_1, cabinet_2", "no handle shows"),
        finding("travel", "drawer_1_slide", "a joint jams"),
    ]
    assert judge_likeness(about[1:]).state == "passed"
    assert judge_likeness(about).state == "doubtful"
    worse = judge_likeness([*about, finding("same-thing", "cabinet_2, mug_1", "one thing")])
    assert worse.state == "failed"
    assert worse.doubts == (("cabinet_2", "one thing"), ("mug_1", "one thing"), ("cabinet_1", "no handle shows"))


def test_a_joint_cut_by_clearance_keeps_its_uncut_limit() -> None:
    door = cabinet("cabinet_1")
    blocked = replace(counter_at("counter_1"), world_from_object=replace(door.world_from_object, translation=_before(door)))
    free, _ = open_freely([door, blocked], (), frozenset())
    assert free.joints[0].uncut == door.joints[0].upper > free.joints[0].upper
    (alone,) = open_freely([door], (), frozenset())
    assert alone.joints[0].uncut is None


def _cut(item: SceneObject, share: float) -> SceneObject:
    if item.name != "cabinet_1":
        return item
    return replace(item, joints=tuple(replace(j, upper=share * j.upper, uncut=j.upper) for j in item.joints))


def _before(door: SceneObject) -> Any:
    centre = door.world_from_object.translation.copy()
    centre[1] -= door.dimensions_m[1] / 2 + 0.62
    return centre
