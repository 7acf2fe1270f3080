import json
import shutil
import xml.etree.ElementTree as ET
from collections import defaultdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from r2c2r_core.errors import BundleError, StageError
from r2c2r_core.export.simulate import compiled
from r2c2r_core.robot.handles import part_of
from r2c2r_core.robot.view import aimed, look, surfaces_of
from r2c2r_core.variants.draw import Change, Variation, draw
from r2c2r_core.variants.judge import unfit
from r2c2r_core.variants.overlay import varied
from r2c2r_core.variants.stage import Variants, base_of, make_variants
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import kitchen

COUNT = 4


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(kitchen(), tmp_path_factory.mktemp("base") / "bundle")


@pytest.fixture(scope="module")
def made(bundle: Path, tmp_path_factory: pytest.TempPathFactory) -> Variants:
    return make_variants(bundle, COUNT, 0, tmp_path_factory.mktemp("made") / "v")


def test_every_variant_loads_in_mujoco_with_textures_and_start_keyframe(made: Variants) -> None:
    for name in made.names:
        model = mujoco.MjModel.from_xml_path(str(made.folder / "variants" / f"{name}.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
        mujoco.mj_forward(model, data)
        assert model.ntex > 0


def test_every_variant_of_the_sample_is_certified(made: Variants) -> None:
    assert made.certified == dict.fromkeys(made.names, True)


def test_variants_are_deterministic_per_seed_and_differ_between_seeds(bundle: Path, made: Variants, tmp_path: Path) -> None:
    again = make_variants(bundle, 2, 0, tmp_path / "again")
    other = make_variants(bundle, 2, 1, tmp_path / "other")
    for name in again.names:
        file = f"variants/{name}.xml"
        assert (again.folder / file).read_bytes() == (made.folder / file).read_bytes()
        assert (other.folder / file).read_bytes() != (made.folder / file).read_bytes()


def test_variants_share_meshes_and_textures(made: Variants) -> None:
    each = [(made.folder / "variants" / f"{name}.xml").stat().st_size for name in made.names]
    assert {path.suffix for path in (made.folder / "variants").iterdir()} == {".xml"}
    assert max(each) < 100_000  # text only


def test_the_variants_manifest_lists_changes_and_rejections(made: Variants) -> None:
    document = json.loads((made.folder / "variants.json").read_text())
    assert document["rejected"] == made.rejected
    assert sum(entry["draws"] - 1 for entry in document["variants"]) == sum(made.rejected.values())
    first = document["variants"][0]
    assert {change["name"] for change in first["changes"]} == {item.name for item in kitchen().objects}
    assert set(first["joints"]["drawer_1_slide"]) == {"damping", "friction", "armature", "upper"}


def test_a_variant_that_fails_the_certificate_is_drawn_again(
    bundle: Path, made: Variants, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdicts = iter([False, False, True, *[False] * 5])  # the first passes at its third draw, the second at none of five
    monkeypatch.setattr("r2c2r_core.variants.stage._passes", lambda scene: next(verdicts))
    again = make_variants(bundle, 2, 0, tmp_path / "again")
    assert again.certified == {"00000": True, "00001": False}
    assert again.rejected["it fails the certificate"] == 2 + 4
    entries = json.loads((again.folder / "variants.json").read_text())["variants"]
    assert sum(entry["draws"] - 1 for entry in entries) == sum(again.rejected.values())
    assert (again.folder / "variants/00000.xml").read_bytes() != (made.folder / "variants/00000.xml").read_bytes()


def test_a_scaled_object_keeps_its_front_and_bottom_planes(bundle: Path, tmp_path: Path) -> None:
    base = base_of(bundle)
    change = Change(name="cabinet_1", scale=(1.01, 1.05, 0.98), mass=1.2)
    rest = [Change(name=name) for name in base.halves if name != "cabinet_1"]
    variation = Variation(changes=(change, *rest), joints={}, ajar={})
    folder = tmp_path / "v" / "variants"
    folder.mkdir(parents=True)
    shutil.copytree(bundle, tmp_path / "v" / "base")
    (folder / "0.xml").write_text(ET.tostring(varied(base.scene, variation, base.halves, base.links), encoding="unicode"))
    before, after = compiled(bundle / "scene.xml"), compiled(folder / "0.xml")
    low, high = _box(before)
    low_after, high_after = _box(after)
    size, size_after = high - low, high_after - low_after
    np.testing.assert_allclose(size_after[[0, 2]], size[[0, 2]] * [1.01, 0.98], atol=2e-4)
    assert low_after[1] == pytest.approx(low[1], abs=2e-3)  # the front board's own thickness grows by 5 % of 18 mm
    assert low_after[2] == pytest.approx(low[2], abs=1e-6)
    grip, grip_after = (_grip(model) for model in (before, after))
    np.testing.assert_allclose(grip_after, grip * change.scale, rtol=1e-6)  # the site has other axes: x is vertical
    mass, mass_after = (model.body("cabinet_1_base").mass[0] for model in (before, after))
    assert mass_after == pytest.approx(1.2 * mass)


def test_a_scaled_box_has_the_inertia_of_its_new_size(tmp_path: Path) -> None:
    size, scale = np.array([0.4, 0.5, 0.6]), np.array([1.1, 0.9, 1.2])
    inertia = 12.0 / 12 * ((size**2).sum() - size**2)
    body = ET.fromstring(
        f'<mujoco><compiler/><asset/><worldbody><body name="a_b" pos="0 0 0" quat="1 0 0 0"><inertial pos="0 0 0" mass="12" '
        f'fullinertia="{inertia[0]} {inertia[1]} {inertia[2]} 0 0 0"/></body></worldbody></mujoco>'
    )
    change = Change(name="a", scale=tuple(scale), mass=1.5)
    variation = Variation(changes=(change,), joints={}, ajar={})
    inertial = varied(body, variation, {"a": size / 2}, {"a_b": "a"}).find(".//inertial")
    assert inertial is not None
    stretched = size * scale
    expected = 1.5 * ((stretched**2).sum() - stretched**2)
    given = [float(value) for value in inertial.get("fullinertia", "").split()][:3]
    np.testing.assert_allclose(given, expected, rtol=1e-6)


def test_everything_is_drawn_from_the_whole_of_the_range_in_the_manifest(bundle: Path) -> None:
    objects = {entry["name"]: entry for entry in base_of(bundle).objects}
    joints = {joint["name"]: joint["randomize"] for entry in objects.values() for joint in entry["joints"]}
    ranges, drawn = dict[tuple[str, ...], dict[str, Any]](), defaultdict[tuple[str, ...], list[float]](list)
    for variation in (draw(np.random.default_rng(seed), list(objects.values())) for seed in range(1000)):
        for change in variation.changes:
            like = objects[change.shape or change.name]
            stated = like["randomize"]
            numbers = {"mass_kg": change.mass * like["mass_kg"], "friction": change.friction}
            numbers |= {f"colour {channel}": tint - 1 for channel, tint in enumerate(change.tint)}
            numbers |= {
                f"size {side}": s * size for side, (s, size) in enumerate(zip(change.scale, like["dimensions_m"], strict=True))
            }
            for name, number in numbers.items():
                what, _, side = name.partition(" ")
                ranges[change.name, name] = stated["dimensions_m"][int(side)] if what == "size" else stated[what]
                drawn[change.name, name].append(number)
        for joint, values in variation.joints.items():
            for name, value in values.items():
                ranges[joint, name] = joints[joint][name]
                drawn[joint, name].append(value)
    assert {name for _, name in drawn} >= {"mass_kg", "friction", "size 2", "colour 0", "damping", "armature", "upper"}
    free = {entry["name"] for entry in objects.values() if entry["movable"]}
    for key, numbers in drawn.items():
        low, high = ranges[key]["low"], ranges[key]["high"]
        assert low - 1e-9 <= min(numbers), key
        assert max(numbers) <= high + 1e-9, key
        if not (key[0] in free and key[1].startswith("size")):  # its least uncertain side decides
            assert max(numbers) - min(numbers) >= 0.9 * (high - low), key


def test_a_written_variant_has_the_drawn_masses_frictions_and_limits(made: Variants) -> None:
    said = json.loads((made.folder / "variants.json").read_text())["variants"][0]
    model = compiled(made.folder / "variants" / f"{said['name']}.xml")
    for name, drawn in said["joints"].items():
        joint = model.joint(name)
        dof = int(joint.dofadr[0])
        found = [model.dof_damping[dof], model.dof_frictionloss[dof], model.dof_armature[dof], joint.range[1]]
        assert found == pytest.approx([drawn[key] for key in ("damping", "friction", "armature", "upper")], abs=1e-5)
    for entry, change in zip(base_of(made.folder / "base").objects, said["changes"], strict=True):
        bodies = [b for b in range(model.nbody) if model.body(b).name.startswith(f"{change['name']}_")]
        assert model.body_mass[bodies].sum() == pytest.approx(change["mass"] * entry["mass_kg"], rel=1e-3)
        geoms = np.isin(model.geom_bodyid, bodies)
        assert model.geom_friction[geoms, 0] == pytest.approx(change["friction"], abs=1e-5)
        assert (model.geom_friction[geoms, 1:] == [0.01, 0.001]).all()


def test_a_normal_range_is_drawn_with_its_standard_deviation(bundle: Path) -> None:
    entry = base_of(bundle).objects[0]
    (width, *_), ranges = entry["dimensions_m"], entry["randomize"]
    normal = {"distribution": "normal", "low": width - 0.006, "high": width + 0.006, "sigma": 0.002}
    entry = entry | {"randomize": ranges | {"dimensions_m": [normal, *ranges["dimensions_m"][1:]]}}
    drawn = [width * draw(np.random.default_rng(seed), [entry]).changes[0].scale[0] for seed in range(300)]
    assert np.mean(drawn) == pytest.approx(width, abs=0.0005)
    assert np.std(drawn) == pytest.approx(0.002, rel=0.15)


def test_tints_lighten_and_darken_photographed_surfaces(bundle: Path, tmp_path: Path) -> None:
    base, folder, brightness = base_of(bundle), tmp_path / "v" / "variants", []
    folder.mkdir(parents=True)
    shutil.copytree(bundle, tmp_path / "v" / "base")
    for tint in (0.9, 1.0, 1.1):
        changes = tuple(Change(name=name, tint=(tint, tint, tint)) for name in base.halves)
        root = varied(base.scene, Variation(changes=changes, joints={}, ajar={}), base.halves, base.links)
        (folder / "0.xml").write_text(ET.tostring(root, encoding="unicode"))
        model = mujoco.MjModel.from_xml_path(str(folder / "0.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        surfaces = surfaces_of(model)
        photographed = [g for g, texture in zip(surfaces.geoms, surfaces.textures, strict=True) if texture is not None]
        camera = aimed(model.stat.center + np.array([0.0, -3.0, 1.0]), model.stat.center, (160, 120), 0.8)
        seen = look(surfaces, model, data, *camera)
        brightness.append(seen.rgb[np.isin(seen.body, model.geom_bodyid[photographed])].mean())
    assert brightness == pytest.approx(brightness[1] * np.array([0.9, 1.0, 1.1]), rel=0.03)  # but for white pixels


def test_a_range_of_one_number_is_that_number(bundle: Path) -> None:
    """A joint without friction has a logarithmic range from zero to zero."""
    entry = next(entry for entry in base_of(bundle).objects if entry["joints"])
    joint = entry["joints"][0]
    for distribution in ("uniform", "loguniform", "normal"):
        still = {"distribution": distribution, "low": 0.0, "high": 0.0, "sigma": 0.0}
        varied_joint = joint | {"randomize": joint["randomize"] | {"friction": still}}
        drawn = draw(np.random.default_rng(0), [entry | {"joints": [varied_joint]}])
        assert drawn.joints[joint["name"]]["friction"] == 0.0


def test_a_bundle_without_ranges_is_refused(bundle: Path, tmp_path: Path) -> None:
    old = shutil.copytree(bundle, tmp_path / "old")
    manifest = json.loads((old / "manifest.json").read_text())
    del manifest["objects"][0]["randomize"]
    (old / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(BundleError, match="states no ranges to vary within"):
        base_of(old)


def test_a_bundle_with_overlapping_parts_raises_a_stage_error(bundle: Path, tmp_path: Path) -> None:
    broken = shutil.copytree(bundle, tmp_path / "broken")
    scene = ET.parse(broken / "scene.xml")
    box = next(geom for geom in scene.iter("geom") if geom.get("name", "").startswith("drawer_1_drawer_col"))
    box.set("size", "0.6 0.6 0.6")
    scene.write(broken / "scene.xml")
    with pytest.raises(StageError, match="none of 40 draws is valid"):
        make_variants(broken, 1, 0, tmp_path / "none")


def _grip(model: object) -> np.ndarray:
    """Side lengths of the cabinet's handle, in its door's frame."""
    part = part_of(model, "cabinet_1_hinge")
    assert part is not None
    assert part.bar is not None
    return part.bar.size


def _box(model: object) -> tuple[np.ndarray, np.ndarray]:
    """Extent of the cabinet's colliders in the world; it is not rotated."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    own = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name.startswith("cabinet_1")]  # type: ignore[attr-defined]
    half = np.array([np.abs(data.geom_xmat[g].reshape(3, 3)) @ model.geom_aabb[g][3:] for g in own])  # type: ignore[attr-defined]
    return (data.geom_xpos[own] - half).min(axis=0), (data.geom_xpos[own] + half).max(axis=0)


@pytest.mark.parametrize(("gap_mm", "reason"), [(0.3, None), (15.0, "an object hangs over an edge")])
def test_an_object_must_stand_on_its_support(gap_mm: float, reason: str | None) -> None:
    """A mesh whose bounding box is not centred on its centre of mass, as most are."""
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <asset><mesh name="cone" vertex="0.03 0.03 0  -0.03 0.03 0  0.03 -0.03 0  -0.03 -0.03 0  0 0 0.2"/></asset>
  <worldbody>
    <geom type="box" size="0.3 0.3 0.02" pos="0 0 -0.02"/>
    <body pos="0 0 {gap_mm / 1000}"><freejoint/><geom type="mesh" mesh="cone"/></body>
  </worldbody>
</mujoco>""")
    assert unfit(model, {}) == reason


@pytest.mark.parametrize(("above_mm", "reason"), [(0.1, None), (-0.2, "a joint collides with something")])
def test_a_drawer_that_scrapes_along_a_board_is_rejected(above_mm: float, reason: str | None) -> None:
    """Friction jams it long before the overlap is visible."""
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <worldbody>
    <body pos="0 0 {0.1 + above_mm / 1000}"><geom type="box" size="0.2 0.2 0.02" pos="0 0 0.02"/></body>
    <body><joint name="slide" type="slide" axis="0 -1 0" range="0 0.3"/><geom type="box" size="0.1 0.2 0.1"/></body>
  </worldbody>
</mujoco>""")
    assert unfit(model, {}) == reason


def test_bottles_exchange_their_shapes_and_stay_on_their_support(bundle: Path) -> None:
    free = next(entry for entry in base_of(bundle).objects if entry["movable"])
    categories = {"bottle_1": "bottle", "bottle_2": "bottle", "mug_1": "mug"}
    objects = [free | {"name": name, "category": category} for name, category in categories.items()]
    drawn = [draw(np.random.default_rng(seed), objects) for seed in range(10)]
    shapes = [{change.name: change.shape for change in variation.changes} for variation in drawn]
    assert {"bottle_1": "bottle_2", "bottle_2": "bottle_1", "mug_1": None} in shapes
    assert {"bottle_1": None, "bottle_2": None, "mug_1": None} in shapes

    halves = {"bottle_1": np.array([0.03, 0.03, 0.1]), "bottle_2": np.array([0.04, 0.04, 0.15])}
    bodies = "".join(
        f'<body name="{name}_base" pos="{x} 0 {half[2]}" quat="1 0 0 0">'
        f'<inertial pos="0 0 0" mass="{x}" fullinertia="0.01 0.01 0.01 0 0 0"/><freejoint name="{name}_free"/>'
        f'<geom name="{name}_base_col_0" type="box" size="{half[0]} {half[1]} {half[2]}"/></body>'
        for x, (name, half) in enumerate(halves.items(), start=1)
    )
    scene = ET.fromstring(f"<mujoco><compiler/><asset/><worldbody>{bodies}</worldbody></mujoco>")
    swapped = {"bottle_1": "bottle_2", "bottle_2": "bottle_1"}
    changes = tuple(Change(name=name, shape=shape) for name, shape in swapped.items())
    variation = Variation(changes=changes, joints={}, ajar={})
    root = varied(scene, variation, halves, {f"{name}_base": name for name in halves})
    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    for name, shape in swapped.items():
        np.testing.assert_allclose(model.geom(f"{name}_base_col_0").size, halves[shape])
        assert model.body(f"{name}_base").mass[0] == {"bottle_1": 2.0, "bottle_2": 1.0}[name]
        assert model.body(f"{name}_base").pos[0] == {"bottle_1": 1.0, "bottle_2": 2.0}[name]
        assert model.body(f"{name}_base").pos[2] == pytest.approx(halves[shape][2])
