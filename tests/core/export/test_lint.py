"""Every lint rule fires on its planted defect, with no other findings than the defect implies."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from r2c2r_core.errors import BundleError
from r2c2r_core.export.lint import lint
from r2c2r_core.export.rules.table import RULES

Plant = Callable[[Path], None]
DOOR_MESH = "assets/cabinet_1/meshes/cabinet_1_door_vis.obj"
BOTTLE_HULL = "assets/bottle_1/meshes/bottle_1_body_col_0.obj"


def urdf(edit: Callable[[ET.Element], object]) -> Plant:
    return xml("scene.urdf", edit)


def xml(name: str, edit: Callable[[ET.Element], object]) -> Plant:
    def plant(folder: Path) -> None:
        document = ET.parse(folder / name)
        edit(document.getroot())
        document.write(folder / name)

    return plant


def manifest(edit: Callable[[dict], object]) -> Plant:
    def plant(folder: Path) -> None:
        document = json.loads((folder / "manifest.json").read_text())
        edit(document)
        (folder / "manifest.json").write_text(json.dumps(document))

    return plant


def text(name: str, old: str, new: str) -> Plant:
    return lambda folder: edit_text(folder / name, old, new)


def both(*plants: Plant) -> Plant:
    def plant(folder: Path) -> None:
        for one in plants:
            one(folder)

    return plant


def named(root: ET.Element, tag: str, name: str) -> ET.Element:
    return next(element for element in root.iter(tag) if element.get("name") == name)


def joint(name: str = "cabinet_1_hinge") -> Callable[[ET.Element], ET.Element]:
    return lambda root: named(root, "joint", name)


def door(root: ET.Element) -> ET.Element:
    return named(root, "link", "cabinet_1_door")


def without(parent: ET.Element, tag: str) -> None:
    parent.remove(next(child for child in parent if child.tag == tag))


def set_inertia(root: ET.Element, **entries: str) -> None:
    door(root).find("inertial/inertia").attrib.update(entries)


def first_mesh(root: ET.Element, kind: str = "visual") -> ET.Element:
    return next(
        link.find(f"{kind}/geometry/mesh") for link in root.iter("link") if link.find(f"{kind}/geometry/mesh") is not None
    )


def write(name: str, text: str) -> Plant:
    return lambda folder: (folder / name).write_text(text) and None


def renamed_mesh(new: str) -> Plant:
    """Move the door's mesh to another path, in URDF and manifest."""

    def plant(folder: Path) -> None:
        (folder / new).parent.mkdir(parents=True, exist_ok=True)
        old = folder / DOOR_MESH
        for suffix in (".obj", ".mtl", ".png"):
            target = (folder / new).with_name(old.with_suffix(suffix).name) if suffix != ".obj" else folder / new
            old.with_suffix(suffix).rename(target)
        urdf(lambda root: door(root).find("visual/geometry/mesh").set("filename", new))(folder)
        manifest(lambda d: d["objects"][0]["meshes"].update(visual=[new]))(folder)
        scene = folder / "scene.xml"
        scene.write_text(scene.read_text().replace(DOOR_MESH, new))

    return plant


def referring_to(path: str) -> Plant:
    """Make the URDF and the manifest refer to another path; nothing is moved."""
    return both(
        urdf(lambda root: door(root).find("visual/geometry/mesh").set("filename", path)),
        manifest(lambda d: d["objects"][0]["meshes"].update(visual=[path])),
    )


def ball(count: int) -> np.ndarray:
    points = np.random.default_rng(0).normal(size=(count, 3))
    return 0.03 * points / np.linalg.norm(points, axis=1, keepdims=True)


def tin(sides: int) -> np.ndarray:
    angles = 2 * np.pi * np.arange(sides) / sides
    rings = [np.column_stack([np.cos(angles), np.sin(angles), np.full(sides, z)]) for z in (-1.0, 1.0)]
    return 0.03 * np.concatenate(rings)


def obj_of_hull(points: np.ndarray) -> str:
    hull = trimesh.convex.convex_hull(points)
    lines = [f"v {x} {y} {z}" for x, y, z in hull.vertices] + [f"f {a} {b} {c}" for a, b, c in hull.faces + 1]
    return "\n".join(lines) + "\n"


def obj_of_boxes(*offsets: float) -> str:
    """Cubes with sides of 10 cm side by side, all in one `o` group."""
    corners = [(x, y, z) for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = []
    for number, offset in enumerate(offsets):
        lines += [f"v {x + offset} {y} {z}" for x, y, z in corners]
        lines += ["f " + " ".join(str(c + 8 * number) for c in quad) for quad in quads]
    return "\n".join(lines) + "\n"


FLAT = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nf 1 2 3\nf 1 3 4\n"
DENTED = """v 0 0 0
v 0.1 0 0
v 0.1 0.1 0
v 0 0.1 0
v 0.05 0.05 0.02
v 0.05 0.05 0.1
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
f 1 6 2
f 2 6 3
f 3 6 4
f 4 6 1
"""
PARTS = obj_of_boxes(0.0) + "o second\n" + "f 1 2 3\n"

CASES: list[tuple[str, str, Plant, set[str]]] = [
    ("number", "not a number", urdf(lambda r: joint()(r).find("dynamics").set("damping", "much")), set()),
    (
        "number",
        "not finite",
        urdf(lambda r: named(r, "link", "bottle_1_body").find("inertial/origin").set("xyz", "nan 0 0")),
        set(),
    ),
    (
        "name",
        "a space in a name",
        urdf(lambda r: r.findall("joint")[0].set("name", "cabinet 1")),
        set(),
    ),
    (
        "duplicate-link",
        "two links of one name",
        urdf(lambda r: r.append(ET.fromstring(ET.tostring(door(r))))),
        {"manifest-mass"},
    ),
    (
        "duplicate-joint",
        "two joints of one name",
        urdf(lambda r: r.findall("joint")[0].set("name", "cabinet_1_hinge")),
        {"mjcf-joint"},
    ),
    ("root", "a loose link", urdf(lambda r: r.append(loose("bottle_1_loose"))), {"manifest-mass", "mjcf-mass"}),
    ("tree", "a joint to nowhere", urdf(lambda r: joint()(r).find("parent").set("link", "nowhere")), {"root"}),
    ("tree", "two parents", urdf(lambda r: r.append(second_parent())), {"manifest-joint"}),
    ("joint-type", "floating", urdf(lambda r: named(r, "joint", "bottle_1_body_to_world").set("type", "floating")), set()),
    ("mujoco-block", "no block", urdf(lambda r: without(r, "mujoco")), set()),
    ("mujoco-block", "paths stripped", urdf(lambda r: r.find("mujoco/compiler").set("strippath", "true")), set()),
    ("limit-missing", "no limit", urdf(lambda r: without(joint()(r), "limit")), {"manifest-joint", "mjcf-joint"}),
    ("limit-incomplete", "no effort", urdf(lambda r: joint()(r).find("limit").attrib.pop("effort")), set()),
    ("limit-incomplete", "no velocity", urdf(lambda r: joint()(r).find("limit").attrib.pop("velocity")), set()),
    (
        "limit-order",
        "lower above upper",
        urdf(lambda r: joint()(r).find("limit").set("lower", "2")),
        {"manifest-joint", "mjcf-joint"},
    ),
    ("limit-order", "no travel", urdf(lambda r: joint()(r).find("limit").set("upper", "0")), {"manifest-joint", "mjcf-joint"}),
    ("limit-zero", "0 outside", urdf(lambda r: joint()(r).find("limit").set("lower", "0.3")), {"manifest-joint", "mjcf-joint"}),
    ("limit-effort", "thousand", urdf(lambda r: joint()(r).find("limit").set("effort", "1000")), set()),
    ("axis-unit", "long axis", urdf(lambda r: joint()(r).find("axis").set("xyz", "0 0 -2")), {"manifest-joint"}),
    ("axis-unit", "no axis", urdf(lambda r: joint()(r).find("axis").set("xyz", "0 0 0")), {"manifest-joint"}),
    ("dynamics-missing", "no dynamics", urdf(lambda r: without(joint()(r), "dynamics")), set()),
    ("inertial-missing", "no inertial", urdf(lambda r: without(door(r), "inertial")), {"manifest-mass"}),
    (
        "mass-positive",
        "zero mass",
        urdf(lambda r: door(r).find("inertial/mass").set("value", "0")),
        {"manifest-mass", "mjcf-mass"},
    ),
    (
        "mass-positive",
        "negative mass",
        urdf(lambda r: door(r).find("inertial/mass").set("value", "-1")),
        {"manifest-mass", "mjcf-mass"},
    ),
    ("inertia-positive", "zero inertia", urdf(lambda r: set_inertia(r, ixx="0", iyy="0", izz="0")), set()),
    ("inertia-positive", "negative", urdf(lambda r: set_inertia(r, ixx="-0.1")), set()),
    ("inertia-triangle", "A + B < C", urdf(lambda r: set_inertia(r, ixx="0.01", iyy="0.01", izz="0.5")), set()),
    (
        "inertia-impossible",
        "identity",
        urdf(lambda r: named(r, "link", "bottle_1_body").find("inertial/inertia").attrib.update(ixx="1", iyy="1", izz="1")),
        set(),
    ),
    ("com-outside", "a metre away", urdf(lambda r: door(r).find("inertial/origin").set("xyz", "0.3 -1 0")), set()),
    ("mesh-path", "package", referring_to("package://cab/x.obj"), set()),
    ("mesh-path", "absolute", referring_to("/tmp/x.obj"), set()),
    ("mesh-path", "out of the bundle", referring_to("../x.obj"), set()),
    ("mesh-path", "drive letter", referring_to("C:\\x.obj"), set()),
    (
        "mesh-path",
        "material out of the bundle",
        lambda f: edit_text(f / DOOR_MESH, "mtllib cabinet_1_door_vis.mtl", "mtllib ../../../x.mtl"),
        set(),
    ),
    ("mesh-spaces", "a space", renamed_mesh("assets/cabinet_1/meshes/my door.obj"), {"asset-missing"}),
    ("mesh-missing", "no file", lambda f: (f / DOOR_MESH).unlink(), set()),
    ("mesh-format", "glb", renamed_mesh("assets/cabinet_1/meshes/door.glb"), {"asset-missing"}),
    ("mesh-scale", "millimetres", urdf(lambda r: first_mesh(r).set("scale", "0.001 0.001 0.001")), {"mesh-size"}),
    ("mesh-scale", "mirrored", urdf(lambda r: first_mesh(r).set("scale", "-1 1 1")), {"com-outside"}),
    (
        "mesh-basename",
        "same name twice",
        both(
            urdf(lambda r: same_basename(r)),
            lambda f: copy_mesh(f),
            manifest(lambda d: d["objects"][0]["meshes"]["visual"].append("assets/other/meshes/cabinet_1_door_vis.obj")),
        ),
        set(),
    ),
    ("mesh-unreadable", "empty", write(DOOR_MESH, ""), set()),
    ("mesh-unreadable", "index out of range", write(DOOR_MESH, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), set()),
    ("mesh-unreadable", "index beyond 64 bits", write(DOOR_MESH, f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {10**30}\n"), set()),
    ("mesh-size", "too long", write(BOTTLE_HULL, obj_of_boxes(0.0).replace("0.1", "100")), set()),
    ("texture-missing", "no picture", lambda f: (f / DOOR_MESH).with_suffix(".png").unlink(), set()),
    ("texture-missing", "no material", lambda f: (f / DOOR_MESH).with_suffix(".mtl").unlink(), set()),
    ("collider-missing", "a ghost", urdf(lambda r: [door(r).remove(c) for c in door(r).findall("collision")]), set()),
    ("collision-flat", "a sheet", write(BOTTLE_HULL, FLAT), set()),
    ("collision-concave", "a dent", write(BOTTLE_HULL, DENTED), set()),
    ("collision-concave", "two boxes in one", write(BOTTLE_HULL, obj_of_boxes(0.0, 0.2)), {"com-outside"}),
    ("collision-vertices", "a ball", write(BOTTLE_HULL, obj_of_hull(ball(80))), {"com-outside"}),
    ("collision-coplanar", "a tin", write(BOTTLE_HULL, obj_of_hull(tin(24))), {"com-outside"}),
    ("collision-parts", "two groups", write(BOTTLE_HULL, PARTS), set()),
    ("box-size", "zero", urdf(lambda r: door(r).find("collision/geometry/box").set("size", "0.1 0 0.1")), set()),
    ("box-size", "negative", urdf(lambda r: door(r).find("collision/geometry/box").set("size", "0.1 -1 0.1")), set()),
    ("file-missing", "no preview", lambda f: (f / "preview.png").unlink(), set()),
    ("file-missing", "no manifest", lambda f: (f / "manifest.json").unlink(), set()),
    ("manifest-schema", "not JSON", write("manifest.json", "{"), set()),
    ("manifest-schema", "a list", write("manifest.json", "[]"), set()),
    ("manifest-schema", "another version", manifest(lambda d: d.update(schema=2)), set()),
    ("manifest-schema", "an object without joint", manifest(lambda d: d["objects"][0].pop("joint")), set()),
    ("manifest-schema", "a category that is no text", manifest(lambda d: d["objects"][0].update(category=3)), set()),
    ("manifest-schema", "a key that nobody knows", manifest(lambda d: d["objects"][0].update(weight_kg=3.0)), set()),
    ("manifest-object", "an object nobody built", manifest(lambda d: d["objects"][0].update(name="elsewhere")), set()),
    ("manifest-object", "an object forgotten", manifest(lambda d: d["objects"].pop()), set()),
    ("manifest-joint", "another limit", manifest(lambda d: d["objects"][0]["joints"][0].update(upper=3.0)), set()),
    ("manifest-joint", "another type", manifest(lambda d: d["objects"][0]["joints"][0].update(type="prismatic")), set()),
    ("manifest-joint", "another axis", manifest(lambda d: d["objects"][0]["joints"][0].update(axis=[0, 0, 1])), set()),
    ("manifest-joint", "another hinge", manifest(lambda d: d["objects"][0]["joints"][0].update(origin=[0, 0, 0])), set()),
    ("manifest-joint", "a joint forgotten", manifest(lambda d: d["objects"][2]["joints"].pop()), set()),
    (
        "manifest-joint",
        "a joint too many",
        manifest(lambda d: d["objects"][0]["joints"].append(dict(d["objects"][0]["joint"], name="x"))),
        set(),
    ),
    ("manifest-mesh", "a mesh forgotten", manifest(lambda d: d["objects"][0]["meshes"]["visual"].clear()), set()),
    ("manifest-mass", "another mass", manifest(lambda d: d["objects"][0].update(mass_kg=1.0)), set()),
    ("mjcf-parse", "not XML", write("scene.xml", "<mujoco"), set()),
    ("mjcf-parse", "a robot", write("scene.xml", "<robot/>"), set()),
    ("mjcf-path", "absolute", xml("scene.xml", lambda r: next(r.iter("mesh")).set("file", "/etc/passwd")), set()),
    ("mjcf-path", "an include", xml("scene.xml", lambda r: ET.SubElement(r, "include", file="other.xml")), set()),
    (
        "mjcf-path",
        "a mesh folder elsewhere",
        xml("scene.xml", lambda r: r.find("compiler").set("meshdir", "../elsewhere")),
        set(),
    ),
    ("mjcf-joint", "another range", xml("scene.xml", lambda r: named(r, "joint", "drawer_1_slide").set("range", "0 9")), set()),
    (
        "mjcf-joint",
        "no number",
        xml("scene.xml", lambda r: named(r, "joint", "drawer_1_slide").set("range", "0 1e308.42")),
        set(),
    ),
    ("mjcf-joint", "no range", xml("scene.xml", lambda r: named(r, "joint", "drawer_1_slide").set("range", "")), set()),
    (
        "mjcf-mass",
        "no number",
        xml("scene.xml", lambda r: named(r, "body", "bottle_1_body").find("inertial").set("mass", "1,5")),
        set(),
    ),
    ("mjcf-joint", "a joint gone", xml("scene.xml", lambda r: without(named(r, "body", "drawer_1_drawer"), "joint")), set()),
    (
        "mjcf-mass",
        "another mass",
        xml("scene.xml", lambda r: named(r, "body", "bottle_1_body").find("inertial").set("mass", "9")),
        set(),
    ),
    ("format", "a cut web scene", write("scene.glb", "glTF"), set()),
    ("usd-parse", "a binary layer", write("scene.usda", "PXR-USDC"), set()),
    ("usd-path", "an asset elsewhere", text("scene.usda", "@./assets/", "@../assets/"), set()),
    (
        "asset-path",
        "a texture elsewhere",
        text("assets/cabinet_1/cabinet_1.usda", "@./meshes/", "@../../../meshes/"),
        set(),
    ),
    ("asset-missing", "another mesh", text("assets/bottle_1/bottle_1.xml", "_col_0.obj", "_col_7.obj"), set()),
    ("asset-unreadable", "half a file", write("assets/cabinet_1/cabinet_1.glb", "glTF"), set()),
    ("asset-differs", "more travel", text("assets/drawer_1/drawer_1.urdf", 'upper="0.42"', 'upper="0.43"'), set()),
    ("usd-path", "a layer by its address", text("scene.usda", "upAxis", "subLayers = [@@@/etc/x.usda@@@]\n    upAxis"), set()),
]


def loose(name: str) -> ET.Element:
    return ET.fromstring(f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>')


def second_parent() -> ET.Element:
    return ET.fromstring(
        '<joint name="cabinet_1_again" type="fixed"><parent link="world"/><child link="cabinet_1_door"/></joint>'
    )


def same_basename(root: ET.Element) -> None:
    visual = ET.SubElement(named(root, "link", "cabinet_1_base"), "visual", name="again")
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(geometry, "mesh", filename="assets/other/meshes/cabinet_1_door_vis.obj")


def copy_mesh(folder: Path) -> None:
    (folder / "assets/other/meshes").mkdir(parents=True)
    for suffix in (".obj", ".mtl", ".png"):
        source = (folder / DOOR_MESH).with_suffix(suffix)
        (folder / "assets/other/meshes" / source.name).write_bytes(source.read_bytes())


def edit_text(path: Path, old: str, new: str) -> None:
    path.write_text(path.read_text().replace(old, new))


def test_the_good_bundle_has_no_lint_findings(good_folder: Path) -> None:
    assert lint(good_folder) == ()


@pytest.mark.parametrize(("rule", "what", "plant", "implied"), CASES, ids=[f"{c[0]}: {c[1]}" for c in CASES])
def test_a_planted_defect_is_reported_by_its_rule(
    good_folder: Path, rule: str, what: str, plant: Plant, implied: set[str]
) -> None:
    plant(good_folder)
    found = lint(good_folder)
    assert rule in {f.rule for f in found}, f"{what}: {found}"
    assert {f.rule for f in found} <= {rule} | implied, found
    for one in found:
        assert one.severity == RULES[one.rule].severity
        assert "\n" not in one.message


def test_every_rule_of_the_table_has_a_planted_defect() -> None:
    assert {case[0] for case in CASES} == set(RULES)


@pytest.mark.parametrize("content", ["", "<robot", "<mujoco/>", "not xml at all"])
def test_an_unreadable_urdf_raises_a_one_line_error(good_folder: Path, content: str) -> None:
    (good_folder / "scene.urdf").write_text(content)
    with pytest.raises(BundleError, match=r"^scene\.urdf") as caught:
        lint(good_folder)
    assert "\n" not in str(caught.value)


def test_object_names_with_a_common_prefix_cause_no_findings(tmp_path: Path) -> None:
    from r2c2r_core.model.scene import ArticulatedScene
    from tests.core.export.conftest import write_folder
    from tests.core.export.kitchen import cabinet

    objects = (cabinet("unit"), cabinet("unit_1", x=0.7), cabinet("unit_10", x=1.4))
    scene = ArticulatedScene(name="t", objects=objects, layout_moves_m={}, warnings=())
    assert lint(write_folder(scene, tmp_path / "b")) == ()
