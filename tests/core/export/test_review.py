"""review.html contains the whole scene and no external resources."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.review import review_html
from r2c2r_core.model.report import Finding
from tests.core.export.kitchen import kitchen
from tests.core.export.test_report import certificate


def scene_of(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found.group(1))


@pytest.fixture(scope="module")
def page() -> str:
    return review_html(plan_bundle(kitchen()), certificate(), np.array([0.0, -3.0, 1.5]))


def test_review_bodies_are_listed_parents_first_with_their_joints(page: str) -> None:
    plan, scene = plan_bundle(kitchen()), scene_of(page)
    assert [body["name"] for body in scene["bodies"]] == [body.name for body in plan.bodies]
    for k, (said, body) in enumerate(zip(scene["bodies"], plan.bodies, strict=True)):
        assert said["parent"] < k
        np.testing.assert_allclose(np.reshape(said["pose"], (4, 4)).T, body.parent_from_body.matrix, atol=1e-6)
        assert (said["joint"] is None) == (body.joint is None)
        if body.joint is not None:
            assert (said["joint"]["name"], said["joint"]["kind"]) == (body.joint_name, body.joint.type)
            np.testing.assert_allclose(said["joint"]["axis"], body.axis_body)
            assert (said["joint"]["lower"], said["joint"]["upper"]) == (body.joint.lower, body.joint.upper)


def test_review_meshes_are_accurate_to_a_tenth_of_a_millimetre(page: str) -> None:
    for said, body in zip(scene_of(page)["bodies"], plan_bundle(kitchen()).bodies, strict=True):
        if body.link.visual is None:
            continue
        packed = said["surface"]
        steps = np.frombuffer(base64.b64decode(packed["positions"]), "<u2").reshape(-1, 3) / 65535
        np.testing.assert_allclose(np.array(packed["low"]) + steps * packed["span"], body.link.visual.vertices, atol=1e-4)
        faces = np.frombuffer(base64.b64decode(packed["indices"]), "<u4").reshape(-1, 3)
        np.testing.assert_array_equal(faces, body.link.visual.faces)


def test_findings_link_to_their_object_and_names_cannot_close_the_script() -> None:
    findings = (
        Finding(rule="travel", severity="error", where="drawer_1_slide", message="jams"),
        Finding(rule="name", severity="error", where="</script><b>", message="<img src=x>"),
    )
    page = review_html(plan_bundle(kitchen()), replace(certificate(), findings=findings), None)
    scene = scene_of(page)
    assert [finding["object"] for finding in scene["findings"]] == ["drawer_1", None]
    assert "</script><b>" not in page
    assert "<img src=x>" not in page


def test_the_review_page_loads_no_external_resources(page: str) -> None:
    assert "default-src 'none'" in page
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", page)
