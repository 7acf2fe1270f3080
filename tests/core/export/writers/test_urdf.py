"""scene.urdf compared semantically with a golden file: element by element, numbers within 1e-6."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from r2c2r_core.export.handles import with_handles
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.writers.urdf import urdf_text
from tests.core.export.kitchen import kitchen

GOLDEN = Path(__file__).parents[3] / "golden" / "kitchen.urdf"


def test_the_urdf_matches_the_golden_file() -> None:
    """To accept a wanted change: write `text` over the golden file and review the difference."""
    text = urdf_text(with_handles(plan_bundle(kitchen())))
    assert_same(ET.fromstring(text), ET.fromstring(GOLDEN.read_text()), "robot")


def assert_same(found: ET.Element, expected: ET.Element, where: str) -> None:
    assert found.tag == expected.tag, where
    assert set(found.attrib) == set(expected.attrib), where
    for key, value in expected.attrib.items():
        try:
            numbers = [float(word) for word in value.split()]
        except ValueError:
            assert found.get(key) == value, f"{where}/{key}"
        else:
            assert [float(w) for w in found.attrib[key].split()] == pytest.approx(numbers, abs=1e-6), f"{where}/{key}"
    children = sorted(expected, key=label), sorted(found, key=label)
    assert [label(e) for e in children[1]] == [label(e) for e in children[0]], where
    for wanted, got in zip(*children, strict=True):
        assert_same(got, wanted, f"{where}/{label(wanted)}")


def label(element: ET.Element) -> str:
    return f"{element.tag} {element.get('name', '')}"


def test_links_have_inertials_and_mesh_paths_are_relative() -> None:
    root = ET.fromstring(urdf_text(with_handles(plan_bundle(kitchen()))))
    for link in root.findall("link"):
        assert (link.find("inertial") is not None) == (link.get("name") != "world")
    for mesh in root.iter("mesh"):
        assert mesh.attrib["filename"].startswith("assets/")
        assert "scale" not in mesh.attrib


def test_free_objects_are_fixed_in_urdf_and_free_in_mjcf() -> None:
    from r2c2r_core.export.writers.mjcf import mjcf_text

    plan = plan_bundle(kitchen())
    urdf, mjcf = ET.fromstring(urdf_text(plan)), ET.fromstring(mjcf_text(plan))
    joint = next(j for j in urdf.findall("joint") if j.find("child").get("link") == "bottle_1_body")
    assert joint.get("type") == "fixed"
    body = next(b for b in mjcf.iter("body") if b.get("name") == "bottle_1_body")
    assert body.find("freejoint") is not None
