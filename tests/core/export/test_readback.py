"""Comparison of every value that a loader reads: a deviating file is detected in every loader that keeps the value."""

import json
import os
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.export.probes import mujoco_model, usd, yourdf
from r2c2r_core.export.readback import RESISTANCE, Readback, differences, expected_readback, readback_of
from r2c2r_core.export.reading import read_urdf
from tests.core.export.conftest import probe

SAPIEN = os.environ.get("R2C2R_SAPIEN_PYTHON", "")
JOINT, LINK = "drawer_1_slide", "drawer_1_drawer"


@pytest.fixture(scope="module")
def bundle(written_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(written_folder, tmp_path_factory.mktemp("readback") / "good"))


@pytest.fixture(scope="module")
def expected(bundle: Path) -> Readback:
    return expected_readback(read_urdf(bundle / "scene.urdf"))


def named(root: ET.Element, tag: str, name: str) -> ET.Element:
    return next(element for element in root.iter(tag) if element.get("name") == name)


def urdf_joint(tag: str, **values: str) -> Callable[[ET.Element], None]:
    return lambda root: element(named(root, "joint", JOINT), tag).attrib.update(values)


def urdf_link(tag: str, **values: str) -> Callable[[ET.Element], None]:
    return lambda root: element(named(root, "link", LINK), tag).attrib.update(values)


def element(parent: ET.Element, path: str) -> ET.Element:
    found = parent.find(path)
    assert found is not None
    return found


def less_solid(root: ET.Element) -> None:
    link = named(root, "link", LINK)
    link.remove(element(link, "collision"))


# deviating value, deviation, finding
URDF_EDITS: dict[str, tuple[Callable[[ET.Element], None], str]] = {
    "type": (lambda r: named(r, "joint", JOINT).set("type", "revolute"), f"{JOINT} is revolute, not prismatic"),
    "axis": (urdf_joint("axis", xyz="0 -0.8 0.6"), f"{JOINT} has the axis (0, -0.8, 0.6), not (0, -1, 0)"),
    "origin": (urdf_joint("origin", xyz="0 0.001 0"), f"{JOINT} lies at (0, 0.001, 0.67) m, not (0, 0, 0.67)"),
    "turn": (urdf_joint("origin", rpy="0 0.01 0"), f"{LINK} has another orientation"),
    "limits": (urdf_joint("limit", upper="0.43"), f"{JOINT} has limits 0 .. 0.43, not 0 .. 0.42"),
    "damping": (urdf_joint("dynamics", damping="4"), f"{JOINT} has damping 4, not 5"),
    "friction": (urdf_joint("dynamics", friction="0"), f"{JOINT} has friction 0, not 1"),
    "effort": (urdf_joint("limit", effort="500"), f"{JOINT} has effort 500, not 50"),
    "velocity": (urdf_joint("limit", velocity="9"), f"{JOINT} has velocity 9, not 1"),
    "mass": (urdf_link("inertial/mass", value="3"), f"{LINK} weighs 3 kg, not 2.192"),
    "centre of mass": (urdf_link("inertial/origin", xyz="0.001 -0.271 0"), f"{LINK} has its centre of mass at (0.001, -0.271"),
    "inertia": (urdf_link("inertial/inertia", ixx="0.02"), f"{LINK} has the moments (0.02, 0.06517, 0.08155) kg m2, not"),
    "inertia axes": (
        urdf_link("inertial/origin", rpy="0 0 0.3"),
        f"{LINK} has the moments (0.0165, 0.06517, 0.08155) kg m2 about",
    ),
    "colliders": (less_solid, f"{LINK} has 2 of 3 colliders"),
}
URDF_PROBES: dict[str, Callable[[Path], dict[str, Any]]] = {
    "yourdfpy": yourdf.read_back,
    "mujoco": mujoco_model.read_back,
    "pybullet": lambda path: probe("bullet").read_back(str(path)),
}


@pytest.mark.parametrize("loader", URDF_PROBES)
@pytest.mark.parametrize("what", URDF_EDITS)
def test_an_edited_urdf_value_is_detected_on_readback(bundle: Path, expected: Readback, loader: str, what: str) -> None:
    edit, says = URDF_EDITS[what]
    lines = differences(expected, readback_of(URDF_PROBES[loader](edited_urdf(bundle, what, edit))))
    if (loader, what) == ("mujoco", "velocity"):
        assert lines == []  # MuJoCo has no such limit: it is in the loss list of scene.xml
    else:
        assert any(line.startswith(says) for line in lines), lines
        assert all(line.split()[0] in (JOINT, LINK) for line in lines), lines


def edited_urdf(bundle: Path, what: str, edit: Callable[[ET.Element], None]) -> Path:
    document = ET.parse(bundle / "scene.urdf")
    edit(document.getroot())
    path = bundle / f"{what.replace(' ', '_')}.urdf"
    document.write(path)
    return path


@pytest.mark.skipif(not Path(SAPIEN).is_file(), reason="no SAPIEN environment: set R2C2R_SAPIEN_PYTHON to its python")
def test_sapien_keeps_all_values_except_friction_effort_and_velocity(bundle: Path, expected: Readback) -> None:
    def all_of_them(root: ET.Element) -> None:
        for what, (edit, _) in URDF_EDITS.items():
            if what not in ("type", "inertia axes"):  # a type hides later values, inertia axes hide earlier ones
                edit(root)

    answer = bundle / "sapien.json"
    broken = edited_urdf(bundle, "sapien", all_of_them)
    subprocess.run([SAPIEN, probe("sapien_probe").__file__, str(broken), str(answer)], check=True, capture_output=True)
    found = readback_of(json.loads(answer.read_text()))
    assert found.not_kept == ("friction", "effort", "velocity")
    lines = differences(expected, found)
    for says in ("has the axis", "lies at", "is turned", "has limits", "has damping", "weighs", "has its centre", "has 2 of 3"):
        assert any(says in line for line in lines), (says, lines)


def mjcf_joint(**values: str) -> Callable[[ET.Element], None]:
    return lambda root: named(root, "joint", JOINT).attrib.update(values)


def mjcf_inertial(**values: str) -> Callable[[ET.Element], None]:
    return lambda root: element(named(root, "body", LINK), "inertial").attrib.update(values)


def mjcf_ghost(root: ET.Element) -> None:
    body = named(root, "body", LINK)
    body.remove(next(geom for geom in body.findall("geom") if geom.get("class") == "collision"))


MJCF_EDITS: dict[str, tuple[Callable[[ET.Element], None], str]] = {
    "type": (mjcf_joint(type="hinge"), f"{JOINT} is revolute, not prismatic"),
    "axis": (mjcf_joint(axis="1 0 0"), f"{JOINT} has the axis (1, 0, 0), not (0, -1, 0)"),
    "origin": (mjcf_joint(pos="0 0.001 0"), f"{JOINT} lies at (0, 0.001, 0.67) m, not (0, 0, 0.67)"),
    "damping": (mjcf_joint(damping="4"), f"{JOINT} has damping 4, not 5"),
    "friction": (mjcf_joint(frictionloss="0"), f"{JOINT} has friction 0, not 1"),
    "effort": (mjcf_joint(actuatorfrcrange="-500 500"), f"{JOINT} has effort 500, not 50"),
    "mass": (mjcf_inertial(mass="3"), f"{LINK} weighs 3 kg"),
    "centre of mass": (mjcf_inertial(pos="0.001 -0.271 0"), f"{LINK} has its centre of mass at (0.001"),
    "inertia": (mjcf_inertial(fullinertia="0.02 0.06 0.08 0 0 0"), f"{LINK} has the moments (0.02, 0.06, 0.08)"),
    "pose": (lambda r: named(r, "body", LINK).set("pos", "0 0 0.01"), f"{LINK} stands at (0, 0, 0.68) m"),
    "colliders": (mjcf_ghost, f"{LINK} has 2 of 3 colliders"),
}


@pytest.mark.parametrize("what", MJCF_EDITS)
def test_an_edited_mjcf_value_is_detected_on_readback(bundle: Path, expected: Readback, what: str) -> None:
    edit, says = MJCF_EDITS[what]
    document = ET.parse(bundle / "scene.xml")
    edit(document.getroot())
    document.write(bundle / "edited.xml")
    lines = differences(expected, readback_of(mujoco_model.read_back(bundle / "edited.xml")))
    assert any(line.startswith(says) for line in lines), lines


SLIDE, BODY = f"/Scene/drawer_1/joints/{JOINT}", f"/Scene/drawer_1/{LINK}"
USD_EDITS: dict[str, tuple[str, str, object, str]] = {
    "axis": (SLIDE, "physics:axis", "Y", f"{JOINT} has the axis"),
    "limits": (SLIDE, "physics:upperLimit", 0.9, f"{JOINT} has limits 0 .. 0.9, not 0 .. 0.42"),
    "damping": (SLIDE, "drive:linear:physics:damping", 4.0, f"{JOINT} has damping 4, not 5"),
    "effort": (SLIDE, "drive:linear:physics:maxForce", 500.0, f"{JOINT} has effort 500, not 50"),
    "friction": (SLIDE, "physxJointAxis:linear:dynamicFrictionEffort", 0.0, f"{JOINT} has friction 0, not 1"),
    "velocity": (SLIDE, "physxJointAxis:linear:maxJointVelocity", 9.0, f"{JOINT} has velocity 9, not 1"),
    "no velocity": (SLIDE, "physxJointAxis:linear:maxJointVelocity", None, f"{JOINT} has velocity nan, not 1"),
    "mass": (BODY, "physics:mass", 3.0, f"{LINK} weighs 3 kg"),
    "centre of mass": (BODY, "physics:centerOfMass", (0.001, -0.271, 0.0), f"{LINK} has its centre of mass"),
    "inertia": (BODY, "physics:diagonalInertia", (0.02, 0.06, 0.08), f"{LINK} has the moments (0.02, 0.06, 0.08)"),
    "pose": (BODY, "xformOp:translate", (0.0, 0.0, 0.01), f"{LINK} stands at"),
}


@pytest.mark.parametrize("what", USD_EDITS)
def test_an_edited_usd_value_is_detected_on_readback(bundle: Path, expected: Readback, what: str) -> None:
    from pxr import Usd

    prim, attribute, value, says = USD_EDITS[what]
    stage = Usd.Stage.Open(Usd.Stage.Open(str(bundle / "scene.usda")).Flatten())  # prims under a reference cannot be edited
    found = stage.GetPrimAtPath(prim).GetAttribute(attribute)
    assert found, attribute
    if value is None:
        stage.GetPrimAtPath(prim).RemoveProperty(attribute)
    else:
        found.Set(value)
    stage.Export(str(bundle / "edited.usda"))
    lines = differences(expected, readback_of(usd.read_back(bundle / "edited.usda")))
    assert any(line.startswith(says) for line in lines), lines


def test_usd_hinge_values_in_degrees_match_the_urdf_in_radians(bundle: Path, expected: Readback) -> None:
    """USD counts a hinge's limits, damping and velocity in degrees; read back they are the URDF's radians."""
    held = readback_of(usd.read_back(bundle / "scene.usda")).joints["cabinet_1_hinge"]
    wanted = expected.joints["cabinet_1_hinge"]
    assert wanted.type == "revolute"
    for name in ("upper", *RESISTANCE):
        assert getattr(held, name) == pytest.approx(getattr(wanted, name), rel=1e-5)


def test_extra_and_missing_joints_and_links_are_reported(expected: Readback) -> None:
    without = Readback(
        version="",
        joints={k: v for k, v in expected.joints.items() if k != JOINT},
        bodies={k: v for k, v in expected.bodies.items() if k != LINK},
    )
    assert differences(expected, expected) == []
    assert differences(expected, without) == [f"joint {JOINT} is missing", f"link {LINK} is missing"]
    assert differences(without, expected) == [f"joint {JOINT} is not in scene.urdf", f"link {LINK} is not in scene.urdf"]


def test_nan_values_are_reported_as_differences(expected: Readback) -> None:
    from dataclasses import replace

    hollow = replace(expected.bodies[LINK], inertia_world=np.full((3, 3), np.nan), mass_kg=float("nan"))
    lines = differences(expected, replace(expected, bodies=expected.bodies | {LINK: hollow}))
    assert [line.split()[1] for line in lines] == ["weighs", "has"]


def test_a_link_merged_into_the_world_is_not_missing(expected: Readback) -> None:
    bodies = {name: body for name, body in expected.bodies.items() if name != "counter_1_slab"}
    found = replace(expected, bodies=bodies)
    assert differences(expected, found) == ["link counter_1_slab is missing"]
    assert differences(expected, replace(found, in_world=frozenset({"counter_1_slab"}))) == []
