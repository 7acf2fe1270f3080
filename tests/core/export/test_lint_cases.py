"""The loader torture test by number: 27 ways in which a cabinet's URDF breaks some loader, each planted and detected.

Rows of the measured table with several variants (limits without effort, without velocity; inertias that are impossible, zero,
the default identity) are one case each; cases 14-17 and 25-27 are the conventions measured with it.
"""

from pathlib import Path
from typing import NamedTuple

import pytest

from r2c2r_core.export.lint import lint
from tests.core.export.test_lint import (
    BOTTLE_HULL,
    DENTED,
    DOOR_MESH,
    FLAT,
    Plant,
    both,
    copy_mesh,
    door,
    first_mesh,
    joint,
    loose,
    manifest,
    named,
    obj_of_boxes,
    referring_to,
    renamed_mesh,
    same_basename,
    set_inertia,
    urdf,
    without,
    write,
)


class Case(NamedTuple):
    number: int
    what: str
    code: str
    plant: Plant


def five_groups() -> str:
    """One OBJ with five `o` groups side by side."""
    lines = obj_of_boxes(0.0, 0.2, 0.4, 0.6, 0.8).splitlines()
    vertices, faces = [x for x in lines if x.startswith("v")], [x for x in lines if x.startswith("f")]
    groups = [line for k in range(5) for line in (f"o part_{k}", *faces[6 * k : 6 * k + 6])]
    return "\n".join([*vertices, *groups]) + "\n"


def edit_door(path: str, **values: str) -> Plant:
    return urdf(lambda r: door(r).find(path).attrib.update(values))


def edit_hinge(tag: str, **values: str) -> Plant:
    return urdf(lambda r: joint()(r).find(tag).attrib.update(values))


CASES = (
    Case(1, "relative meshes, but MuJoCo 3 strips their folders", "mujoco-block", urdf(lambda r: without(r, "mujoco"))),
    Case(2, "../meshes, as ROS lays packages out", "mesh-path", referring_to("../meshes/x.obj")),
    Case(3, "package://", "mesh-path", referring_to("package://cab/meshes/x.obj")),
    Case(4, "a .glb visual", "mesh-format", renamed_mesh("assets/cabinet_1/meshes/door.glb")),
    Case(5, "no <inertial>", "inertial-missing", urdf(lambda r: without(door(r), "inertial"))),
    Case(6, "A + B < C", "inertia-triangle", urdf(lambda r: set_inertia(r, ixx="0.01", iyy="0.01", izz="0.5"))),
    Case(7, "a mover without mass", "mass-positive", edit_door("inertial/mass", value="0")),
    Case(8, "a mover without inertia", "inertia-positive", urdf(lambda r: set_inertia(r, ixx="0", iyy="0", izz="0"))),
    Case(
        9,
        "the identity as inertia, as stock exporters write it",
        "inertia-impossible",
        urdf(lambda r: named(r, "link", "bottle_1_body").find("inertial/inertia").attrib.update(ixx="1", iyy="1", izz="1")),
    ),
    Case(10, "a hinge without <limit>", "limit-missing", urdf(lambda r: without(joint()(r), "limit"))),
    Case(11, "<limit> without effort", "limit-incomplete", urdf(lambda r: joint()(r).find("limit").attrib.pop("effort"))),
    Case(12, "<limit> without velocity", "limit-incomplete", urdf(lambda r: joint()(r).find("limit").attrib.pop("velocity"))),
    Case(13, "lower above upper", "limit-order", edit_hinge("limit", lower="2")),
    Case(14, "closed outside the limits: jumps on the first step", "limit-zero", edit_hinge("limit", lower="0.3")),
    Case(15, "an effort of 1000", "limit-effort", edit_hinge("limit", effort="1000")),
    Case(16, "no <dynamics>: doors drift and slam", "dynamics-missing", urdf(lambda r: without(joint()(r), "dynamics"))),
    Case(17, "an axis that is not of length one", "axis-unit", edit_hinge("axis", xyz="0 0 -2")),
    Case(18, "a flat collision mesh", "collision-flat", write(BOTTLE_HULL, FLAT)),
    Case(19, "a concave mesh as one collision", "collision-concave", write(BOTTLE_HULL, DENTED)),
    Case(20, "one OBJ with five groups as collision", "collision-parts", write(BOTTLE_HULL, five_groups())),
    Case(
        21,
        "two files of one basename",
        "mesh-basename",
        both(
            urdf(same_basename),
            copy_mesh,
            manifest(lambda d: d["objects"][0]["meshes"]["visual"].append("assets/other/meshes/cabinet_1_door_vis.obj")),
        ),
    ),
    Case(22, "two roots: a loose link", "root", urdf(lambda r: r.append(loose("bottle_1_loose")))),
    Case(23, "two links of one name", "duplicate-link", urdf(lambda r: r.append(door(r)))),
    Case(24, "a mesh that is not there", "mesh-missing", lambda folder: (folder / DOOR_MESH).unlink()),
    Case(
        25, "scale= instead of metres in the file", "mesh-scale", urdf(lambda r: first_mesh(r).set("scale", "0.01 0.01 0.01"))
    ),
    Case(26, "a negative scale", "mesh-scale", urdf(lambda r: first_mesh(r).set("scale", "-1 1 1"))),
    Case(27, "a space in a path", "mesh-spaces", renamed_mesh("assets/cabinet_1/meshes/my door.obj")),
)


def test_there_are_27_unique_lint_cases() -> None:
    assert [case.number for case in CASES] == list(range(1, 28))
    assert len({case.what for case in CASES}) == 27


@pytest.mark.parametrize("case", CASES, ids=[f"{case.number}: {case.what}" for case in CASES])
def test_the_linter_reports_the_planted_case(good_folder: Path, case: Case) -> None:
    assert case.code not in {found.rule for found in lint(good_folder)}
    case.plant(good_folder)
    assert case.code in {found.rule for found in lint(good_folder)}


def test_a_cabinet_base_has_five_collision_shapes_and_no_findings(good_folder: Path) -> None:
    """The only row of the table that every loader opens."""
    from r2c2r_core.export.reading import read_urdf

    base = next(link for link in read_urdf(good_folder / "scene.urdf").links if link.name == "cabinet_1_base")
    assert sum(shape.kind == "collision" for shape in base.shapes) == 5
    assert lint(good_folder) == ()
