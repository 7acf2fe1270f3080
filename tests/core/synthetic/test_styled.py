"""Kitchens in a chosen style and palette."""

import hashlib
from typing import NamedTuple

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.synthetic.atlas import LitScene, light_scene
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.choices import PALETTES, SEEDS_OWN, STYLES, Choice
from r2c2r_core.synthetic.kitchen import Furniture, Kitchen, Leaf
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.mesh import join_patches
from r2c2r_core.synthetic.patches import Patch
from r2c2r_core.synthetic.render import View, render_view
from r2c2r_core.synthetic.sensor import scan_depth
from r2c2r_core.synthetic.styled import plan_styled_kitchen
from r2c2r_core.synthetic.truth import true_objects

SEEDS = range(4)
WITHOUT_CHOICE = {  # digests of the surfaces drawn before styles could be chosen
    0: "ebdf1a791bf39d2e",
    1: "ecbe5dafe3c51e8a",
    3: "8351896a3c746b80",
    9: "2b2fa12ddd9d2224",
}


@pytest.fixture(params=[(style, seed) for style in STYLES for seed in SEEDS], ids=lambda case: f"{case[0]}-{case[1]}")
def kitchen(request: pytest.FixtureRequest) -> Kitchen:
    style, seed = request.param
    return plan_styled_kitchen(seed, Choice(style=style))


def leaves(kitchen: Kitchen) -> list[tuple[Furniture, Leaf]]:
    return [(unit, leaf) for unit in (*kitchen.base, *kitchen.upper) for leaf in unit.leaves]


def digest(patches: list[Patch]) -> str:
    """Digest of geometry to a micrometre, paints and owners."""
    content = hashlib.sha256()
    for patch in patches:
        size, colour = np.round(patch.size_m, 6).tolist(), np.round(patch.paint.colour, 6).tolist()
        content.update(np.round(patch.grid, 6).tobytes())
        content.update(f"{size}{patch.paint.kind}{colour}{patch.object_id}{patch.is_handle}".encode())
    return content.hexdigest()[:16]


@pytest.mark.parametrize("seed", WITHOUT_CHOICE)
def test_without_a_choice_a_seed_reproduces_the_reference_kitchen(seed: int) -> None:
    assert digest(build_kitchen(plan_kitchen(seed))) == WITHOUT_CHOICE[seed]
    assert Choice() == SEEDS_OWN


def test_fronts_do_not_overlap_and_every_category_is_known(kitchen: Kitchen) -> None:
    objects = true_objects(kitchen)
    assert len({thing.name for thing in objects}) == len(objects)
    for thing in objects:
        assert category_of(thing.category).name == thing.category
    boxes = [(t.name, t.kitchen_from_object.translation, t.dimensions_m) for t in objects]
    for i, (name, centre, size) in enumerate(boxes):
        for other, other_centre, other_size in boxes[i + 1 :]:
            apart = (np.abs(centre - other_centre) - (size + other_size) / 2).max()
            assert apart > 0.0019 or abs(apart) < 1e-9, (name, other, apart)


def test_handles_match_the_style_and_are_on_the_opening_side() -> None:
    kinds: dict[str, set[str | None]] = {}
    level = []
    for style in STYLES:
        for seed in range(12):
            for unit, leaf in leaves(plan_styled_kitchen(seed, Choice(style=style))):
                kinds.setdefault(style, set()).add(leaf.handle.kind if leaf.handle else None)
                if leaf.handle is None or leaf.hinge is None:
                    continue
                level.append(not leaf.handle.vertical)
                if leaf.handle.vertical:
                    assert (leaf.handle.x > leaf.width_m / 2) == (leaf.hinge == "left"), unit.name
                else:
                    assert leaf.handle.x == pytest.approx(leaf.width_m / 2)
    assert kinds["handleless"] == kinds["push"] == {None}
    assert kinds["knobs"] == kinds["framed"] == {"knob"}
    assert kinds["cup"] == {"cup", "knob"}
    assert kinds["slab"] <= {"bar", "bow", "flat"}
    assert 0 < np.mean(level) < 0.25  # fraction of doors with a centred handle, which does not indicate the hinge


def test_front_frames_and_panes_match_the_style(kitchen: Kitchen, request: pytest.FixtureRequest) -> None:
    style = request.node.callspec.params["kitchen"][0]
    for unit, leaf in leaves(kitchen):
        if style in ("slab", "handleless", "push"):
            assert leaf.frame is None
        if style == "glass" and "wall" in unit.category:
            assert leaf.frame is not None
            assert leaf.frame.filling in ("glass", "frosted")
        if style == "shaker" and leaf.hinge is not None:
            assert leaf.frame is not None
            assert leaf.frame.filling == "panel"


def test_inset_fronts_are_flush_with_a_surrounding_face_frame() -> None:
    kitchen = plan_styled_kitchen(1, Choice(style="framed"))
    gap = kitchen.style.gap_m
    for run in kitchen.runs:
        for unit in run.base:
            for leaf in unit.leaves:
                middle_z = leaf.z + leaf.height_m / 2
                flush = [b for b in run.boards if b.low[1] == pytest.approx(-unit.depth_m) and b.low[2] < middle_z < b.high[2]]
                left = min(abs(b.high[0] - (leaf.x - gap)) for b in flush)
                right = min(abs(b.low[0] - (leaf.x + leaf.width_m + gap)) for b in flush)
                assert (left < 1e-9) or unit.category == "double_door_cabinet"
                assert (right < 1e-9) or unit.category == "double_door_cabinet"


def test_travels_and_depths_vary_independently_of_the_estimation_tables() -> None:
    kitchens = [plan_styled_kitchen(seed, Choice(style="slab")) for seed in range(40)]
    drawers = [(u.depth_m, leaf.open_limit) for k in kitchens for u, leaf in leaves(k) if leaf.hinge is None]
    share = np.array([travel / depth for depth, travel in drawers])
    assert np.ptp(share) > 0.3
    depths = np.array([k.base_depth_m for k in kitchens] + [k.upper_depth_m for k in kitchens])
    nearest = np.abs(depths[:, None] - np.array(DEPTHS_SOLD_M)).min(axis=1)
    assert np.mean(nearest > 0.01) > 0.4
    angles = [leaf.open_limit for k in kitchens for _, leaf in leaves(k) if leaf.hinge is not None]
    assert np.ptp(angles) > 0.2


@pytest.mark.parametrize("style", STYLES)
def test_object_surfaces_match_their_box(style: str) -> None:
    kitchen = plan_styled_kitchen(2, Choice(style=style))
    objects, patches = true_objects(kitchen), build_kitchen(kitchen)
    for patch in patches:
        if patch.object_id == 0 or patch.is_handle or objects[patch.object_id - 1].category == "bottle":
            continue
        thing = objects[patch.object_id - 1]
        local = thing.kitchen_from_object.inverse.apply(patch.grid.reshape(-1, 3))
        assert (np.abs(local) < thing.dimensions_m / 2 + 0.004).all(), thing.name
    for index, thing in enumerate(objects):
        if thing.category == "bottle":
            continue
        own = [p for p in patches if p.object_id == index + 1 and not p.is_handle]
        points = thing.kitchen_from_object.inverse.apply(np.concatenate([p.grid.reshape(-1, 3) for p in own]))
        reach = np.array([points[:, 0].max(), -points[:, 1].min(), points[:, 2].max()])
        assert reach == pytest.approx(thing.dimensions_m / 2, abs=0.004), thing.name


def shape(kitchen: Kitchen) -> list[tuple[bytes, int, bool]]:
    """Every surface of a kitchen without its paint."""
    return [(patch.grid.tobytes(), patch.object_id, patch.is_handle) for patch in build_kitchen(kitchen)]


@pytest.mark.parametrize("palette", PALETTES)
@pytest.mark.parametrize("others", [{}, {"style": "framed"}, {"layout": "island"}], ids=str)
def test_a_palette_changes_paints_and_nothing_else(palette: str, others: dict[str, str]) -> None:
    plain, painted = (plan_styled_kitchen(3, Choice(palette=p, **others)) for p in (None, palette))
    assert shape(painted) == shape(plain)
    assert (painted.room, painted.yaw_rad, painted.style.daylight) == (plain.room, plain.yaw_rad, plain.style.daylight)
    style = painted.style
    assert style.base_front != plain.style.base_front
    assert (style.base_front == style.wall_front) == (palette != "two-tone")
    ends = {board.paint for run in painted.runs for board in run.boards}
    assert ends <= {style.base_front, style.wall_front, style.plinth, style.handle}
    mean = float(np.mean(style.base_front.colour))
    assert {"dark": mean < 0.05, "white": mean > 0.7}.get(palette, True)


def test_the_same_choice_and_seed_give_the_same_kitchen() -> None:
    choice = Choice(style="cup", palette="wood")
    assert plan_styled_kitchen(5, choice) == plan_styled_kitchen(5, choice)
    assert plan_styled_kitchen(5, choice) != plan_styled_kitchen(6, choice)


class Pane(NamedTuple):
    """A glazed unit of a kitchen, lit, and the view of a camera one metre before its first pane."""

    kitchen: Kitchen
    unit: Furniture
    patches: list[Patch]
    scene: LitScene
    camera: Intrinsics
    camera_from_kitchen: Rigid3
    view: View


@pytest.fixture(scope="module")
def pane() -> Pane:
    choice = Choice(style="glass")
    seed = next(s for s in range(20) if any(c.glazed for c in plan_styled_kitchen(s, choice).runs[0].upper_carcasses))
    kitchen = plan_styled_kitchen(seed, choice)
    unit = kitchen.upper[0]
    leaf = unit.leaves[0]
    patches = build_kitchen(kitchen)
    scene = light_scene(patches, np.random.default_rng(0))
    middle = np.array([leaf.x + leaf.width_m / 2, -unit.depth_m, leaf.z + leaf.height_m / 2])
    facing = Rigid3(np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]), middle - [0.0, 1.0, 0.0]).inverse
    camera = Intrinsics(fx=200.0, fy=200.0, cx=128.0, cy=96.0, width=256, height=192)
    return Pane(kitchen, unit, patches, scene, camera, facing, render_view(scene, camera, facing))


def test_depth_passes_through_glass_but_its_pixels_belong_to_the_unit(pane: Pane) -> None:
    number = pane.kitchen.object_names.index(pane.unit.name) + 1
    assert pane.scene.object_of_patch[pane.view.patch[96, 128]] == number
    assert pane.view.depth_m[96, 128] == pytest.approx(1.0, abs=0.02)
    depth = scan_depth(pane.scene, pane.camera, pane.camera_from_kitchen, np.random.default_rng(0)).depth_m
    assert np.nanmedian(depth[80:112, 112:144]) > 1.0 + 0.4 * pane.unit.depth_m
    mesh = join_patches(pane.patches)
    raster = rasterize(
        mesh.vertices, mesh.faces, np.zeros((len(mesh.vertices), 3)), pane.camera, pane.camera_from_kitchen
    )  # with the panes the same ray ends on the front
    assert raster.depth_m[96, 128] < 1.05


@pytest.mark.slow
def test_a_clear_pane_transmits_86_percent_of_the_light(pane: Pane) -> None:
    without = light_scene([p for p in pane.patches if p.paint.kind != "glass"], np.random.default_rng(0))
    bare = render_view(without, pane.camera, pane.camera_from_kitchen).colour.mean(axis=2) + 1.0
    share = (pane.view.colour.mean(axis=2) + 1.0) / bare
    glass = np.array([patch.paint.kind == "glass" for patch in pane.patches])[pane.view.patch]
    # light through a pane relative to its surroundings: panes change the exposure of the whole
    assert np.median(share[80:112, 112:144]) / np.median(share[~glass]) == pytest.approx(0.86, abs=0.05)
