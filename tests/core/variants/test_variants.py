import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.errors import StageError
from r2c2r_core.export.simulate import compiled
from r2c2r_core.robot.handles import part_of
from r2c2r_core.variants.draw import MASS, SURFACE, Change, Variation, draw
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
    assert SURFACE[0] <= first["surface"] <= SURFACE[1]


def test_a_scaled_object_keeps_its_front_and_bottom_planes(bundle: Path, tmp_path: Path) -> None:
    base = base_of(bundle)
    change = Change(name="cabinet_1", scale=(1.01, 1.05, 0.98), mass=1.2)
    rest = [Change(name=name) for name in base.halves if name != "cabinet_1"]
    joints: dict[str, float] = {}
    variation = Variation(changes=(change, *rest), damping=joints, friction=joints, ajar=joints, surface=0.5)
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
    assert mass_after == pytest.approx(1.2 * 1.01 * 1.05 * 0.98 * mass)


def test_a_scaled_box_has_the_inertia_of_its_new_size(tmp_path: Path) -> None:
    size, scale = np.array([0.4, 0.5, 0.6]), np.array([1.1, 0.9, 1.2])
    inertia = 12.0 / 12 * ((size**2).sum() - size**2)
    body = ET.fromstring(
        f'<mujoco><compiler/><asset/><worldbody><body name="a_b" pos="0 0 0" quat="1 0 0 0"><inertial pos="0 0 0" mass="12" '
        f'fullinertia="{inertia[0]} {inertia[1]} {inertia[2]} 0 0 0"/></body></worldbody></mujoco>'
    )
    change = Change(name="a", scale=tuple(scale))
    variation = Variation(changes=(change,), damping={}, friction={}, ajar={}, surface=0.5)
    inertial = varied(body, variation, {"a": size / 2}, {"a_b": "a"}).find(".//inertial")
    assert inertial is not None
    stretched = size * scale
    expected = 12.0 * np.prod(scale) / 12 * ((stretched**2).sum() - stretched**2)
    given = [float(value) for value in inertial.get("fullinertia", "").split()][:3]
    np.testing.assert_allclose(given, expected, rtol=1e-6)


def test_measured_dimensions_vary_less_than_inferred_ones() -> None:
    entry = {
        "name": "cabinet_1",
        "category": "cabinet",
        "movable": False,
        "placement": {"spread": {"scale": 0.002}},
        "dimension_source": ["measured", "inferred", "default"],
        "joints": [{"name": "cabinet_1_door_joint"}],
    }
    drawn = [draw(np.random.default_rng(seed), [entry]).changes[0] for seed in range(300)]
    width, depth, height = np.array([change.scale for change in drawn]).std(axis=0)
    assert width == pytest.approx(0.002, rel=0.2)
    assert depth > 5 * width
    assert height > 5 * width
    assert all(MASS[0] <= change.mass <= MASS[1] for change in drawn)


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


@pytest.mark.parametrize(("gap_mm", "reason"), [(0.5, None), (15.0, "an object hangs over an edge")])
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


def test_bottles_exchange_their_shapes_and_stay_on_their_support() -> None:
    free = {"movable": True, "placement": None, "dimension_source": ["measured"] * 3, "joints": []}
    categories = {"bottle_1": "bottle", "bottle_2": "bottle", "mug_1": "mug"}
    objects = [{"name": name, "category": category, **free} for name, category in categories.items()]
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
    joints: dict[str, float] = {}
    variation = Variation(changes=changes, damping=joints, friction=joints, ajar=joints, surface=0.5)
    root = varied(scene, variation, halves, {f"{name}_base": name for name in halves})
    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    for name, shape in swapped.items():
        np.testing.assert_allclose(model.geom(f"{name}_base_col_0").size, halves[shape])
        assert model.body(f"{name}_base").mass[0] == {"bottle_1": 2.0, "bottle_2": 1.0}[name]
        assert model.body(f"{name}_base").pos[0] == {"bottle_1": 1.0, "bottle_2": 2.0}[name]
        assert model.body(f"{name}_base").pos[2] == pytest.approx(halves[shape][2])
