"""Semantic labels of parts, equal in every format."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import pytest

from tests.core.export.writers.test_glb import document_of

Said = dict[str, tuple[str, str, tuple[str, ...]]]
"""By link or handle: category, part, dispositions."""


def words(text: str) -> tuple[str, ...]:
    return tuple(word for word in text.split(",") if word)


def in_manifest(folder: Path) -> Said:
    entries = {}
    for item in json.loads((folder / "manifest.json").read_text())["objects"]:
        entries |= item["labels"]
        entries |= {h["name"]: h["labels"] for joint in item["joints"] for h in joint["handles"]}
    return {name: (e["category"], e["part"], tuple(e["disposition"])) for name, e in entries.items()}


def in_urdf(folder: Path) -> Said:
    extension = ET.parse(folder / "scene.urdf").getroot().find("r2c2r")
    assert extension is not None
    named = {e.get("link" if e.tag == "labels" else "name", ""): e.attrib for e in extension}
    return {name: (e["category"], e["part"], words(e["disposition"])) for name, e in named.items()}


def in_mjcf(folder: Path) -> Said:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    found = {}
    for number in range(model.ntext):
        start = int(model.text_adr[number])
        text = model.text_data[start : start + int(model.text_size[number])].rstrip(b"\0").decode()
        said = dict(pair.split("=") for pair in text.split(";"))
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXT, number)
        found[name] = (said["category"], said["part"], words(said["disposition"]))
    return found


def in_glb(folder: Path) -> Said:
    nodes = document_of(folder / "scene.glb")[0]["nodes"]
    return {n["name"]: (e["category"], e["part"], tuple(e["disposition"])) for n in nodes if (e := n.get("extras"))}


def in_usd(folder: Path) -> Said:
    from pxr import Usd, UsdSemantics

    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    names, found = in_manifest(folder), {}
    for prim in stage.Traverse():
        if prim.GetName() in names:
            category = UsdSemantics.LabelsQuery("category", Usd.TimeCode.Default()).ComputeUniqueInheritedLabels(prim)
            own = {t: UsdSemantics.LabelsAPI(prim, t).GetLabelsAttr().Get() or () for t in ("part", "disposition")}
            found[prim.GetName()] = (category[0], own["part"][0], tuple(own["disposition"]))
    return found


def test_links_are_labelled_by_category_part_and_affordance(good_folder: Path) -> None:
    said = in_manifest(good_folder)
    assert said["cabinet_1_door"] == ("cabinet", "door", ("openable",))
    assert said["cabinet_1_base"] == ("cabinet", "body", ())
    assert said["drawer_1_drawer"] == ("drawer", "drawer", ("openable",))
    assert said["bottle_1_body"] == ("bottle", "body", ("graspable",))
    assert said["drawer_1_drawer_handle"] == ("drawer", "handle", ("graspable",))


@pytest.mark.parametrize("read", [in_urdf, in_mjcf, in_glb, in_usd])
def test_every_format_has_the_manifests_labels(good_folder: Path, read: object) -> None:
    assert read(good_folder) == in_manifest(good_folder)  # type: ignore[operator]
