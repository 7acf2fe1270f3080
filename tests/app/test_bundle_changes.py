"""Choice of bundle formats, re-checks of a bundle, and differences between two."""

import io
import zipfile
from pathlib import Path

from app.services.bundle_changes import changes
from app.services.bundles import _with_formats

HINGE = {"name": "a_door", "type": "revolute", "axis": [0, 0, 1], "origin": [0, 0, 0], "upper": 1.5}
DOOR = {
    "name": "a",
    "category": "cabinet",
    "dimensions_m": [0.5, 0.6, 0.7],
    "world_from_object": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
    "joints": [HINGE],
    "chosen": {"candidate": "c0"},
}


def said(older: dict, newer: dict) -> set[str]:  # type: ignore[type-arg]
    return {f"{c.object}: {c.text}" for c in changes({"objects": [older]}, {"objects": [newer]})}


def test_bundles_with_the_same_objects_have_no_differences() -> None:
    assert said(DOOR, DOOR) == set()


def test_visible_differences_are_listed_with_both_values() -> None:
    moved = {**DOOR, "world_from_object": [[1, 0, 0, 0.03], [0, 1, 0, 0.04], [0, 0, 1, 0], [0, 0, 0, 1]]}
    assert said(DOOR, moved) == {"a: moved by 50 mm"}
    assert said(DOOR, {**DOOR, "dimensions_m": [0.5, 0.6, 0.72]}) == {"a: size 50.0 × 60.0 × 70.0 → 50.0 × 60.0 × 72.0 cm"}
    assert said(DOOR, {**DOOR, "joints": [{**HINGE, "upper": 2.0}]}) == {"a: a_door opens 86° → 115°"}
    assert said(DOOR, {**DOOR, "joints": [{**HINGE, "origin": [0.4, 0, 0]}]}) == {"a: a_door: hinge moved"}
    assert said(DOOR, {**DOOR, "chosen": {"candidate": "c1"}}) == {"a: candidate c0 → c1"}
    assert said(DOOR, {**DOOR, "name": "b"}) == {"a: taken out", "b: new: cabinet"}


def test_a_bundle_limited_to_formats_has_their_scenes_manifest_and_report(tmp_path: Path) -> None:
    whole = tmp_path / "whole.zip"
    scenes = {"scene.urdf", "scene.srdf", "scene.xml", "scene.usda", "scene.usdz", "scene.glb", "package.xml", "ros/scene.urdf"}
    assets = {f"assets/a/a{suffix}" for suffix in (".urdf", ".xml", ".usda", ".glb")}
    names = {*scenes, *assets, "manifest.json", "report.html", "assets/a/meshes/a.obj"}
    with zipfile.ZipFile(whole, "w") as archive:
        for name in sorted(names):
            archive.writestr(name, "{}" if name == "manifest.json" else name)

    def members(*formats: str) -> set[str]:
        return set(zipfile.ZipFile(io.BytesIO(_with_formats(whole, frozenset(formats)))).namelist())

    proof = {"manifest.json", "report.html"}
    assert members("urdf") == {"scene.urdf", "scene.srdf", "assets/a/a.urdf", "assets/a/meshes/a.obj", *proof}
    assert members("mjcf") == {"scene.xml", "assets/a/a.xml", "assets/a/meshes/a.obj", *proof}
    assert members("usd") == {"scene.usda", "scene.usdz", "assets/a/a.usda", "assets/a/meshes/a.obj", *proof}
    assert members("ros") == {"package.xml", "ros/scene.urdf", "assets/a/meshes/a.obj", *proof}
    assert members("glb") == {"scene.glb", *proof}  # the GLB of an asset refers to textures beside it
    assert members("urdf", "mjcf", "usd", "glb", "ros") == names
