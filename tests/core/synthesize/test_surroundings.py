from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.support import supported
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture, Frame, SceneSurface, Wall
from r2c2r_core.model.inputs import ObjectPrompt, Overrides, PromptPoint
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.warp.stage import WarpConfig, fit_meshes
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit
from tests.core.synthesize.mujoco_oracle import compile_scene, deepest_contact, sweep

Corner = tuple[float, float, float]

CAB_L = Unit("cab_l", "cabinet", (0.0, 0.0, 0.48), (0.6, 0.56, 0.74), handle=Handle(0.24, 0.2))
CAB_R = Unit("cab_r", "cabinet", (0.603, 0.0, 0.48), (0.6, 0.56, 0.74), handle=Handle(-0.24, 0.2))
UPPER = Unit("upper_drawer", "drawer", (1.206, 0.0, 0.7485), (0.6, 0.56, 0.203), handle=Handle(0, 0, vertical=False))
LOWER = Unit("lower_drawer", "drawer", (1.206, 0.0, 0.377), (0.6, 0.56, 0.534), handle=Handle(0, 0.1, vertical=False))
FRIDGE = Unit("fridge", "fridge", (-0.61, -0.02, 0.9), (0.6, 0.6, 1.8), handle=Handle(-0.24, 0.2, length=0.4), kind="appliance")
WALL_UNIT = Unit("wall_unit", "wall_cabinet", (0.0, 0.1, 1.7), (0.6, 0.35, 0.7), handle=Handle(0.24, -0.2))
BOTTLE = Unit("bottle", "bottle", (0.9, 0.0, 1.012), (0.08, 0.08, 0.23), kind="thing")
RUN = (CAB_L, CAB_R, UPPER, LOWER, FRIDGE, WALL_UNIT)
WORKTOP = ((-0.3, -0.295, 0.86), (1.506, 0.28, 0.892))  # 15 mm beyond the fronts
PLINTH = ((-0.3, -0.22, 0.0), (1.506, -0.2, 0.1))
BEHIND = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=-0.30, area_m2=5.0)
BROWN = (150, 90, 30)


def scanned(*solids: tuple[Corner, Corner]) -> Capture:
    """A capture whose surface is these boxes, divided into faces of centimetres like a fused scan."""
    from trimesh import Trimesh
    from trimesh.util import concatenate

    parts = [Trimesh(*box_mesh(np.array(low), np.array(high))).subdivide_to_size(0.04, max_iter=20) for low, high in solids]
    joined = concatenate(parts) if parts else Trimesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    count = len(joined.vertices)
    surface = SceneSurface(
        vertices_world=np.asarray(joined.vertices, dtype=np.float64),
        faces=np.asarray(joined.faces, dtype=np.int64),
        colours=np.tile(np.array(BROWN, np.uint8), (count, 1)),
        voxel_m=0.01,
    )
    return replace(capture((BEHIND,)), surface=surface)


def built(units: Sequence[Unit], scan: Capture, *, on: bool = True, strip_over_m: float = 0.0) -> ArticulatedScene:
    rng = np.random.default_rng(0)
    tracks, placements, assets = zip(*[placed_unit(u, rng) for u in units], strict=True)
    if strip_over_m:
        tracks = tuple(replace(t, front=t.front and replace(t.front, strip_over_m=strip_over_m)) for t in tracks)
    config = SynthesizeConfig(surroundings=on)
    return build_scene(scan, tracks, placements, assets, Overrides(objects={}), config)


@cache
def kitchen() -> ArticulatedScene:
    return built((*RUN, BOTTLE), scanned(WORKTOP, PLINTH))


def of(scene: ArticulatedScene, category: str) -> list[SceneObject]:
    return [item for item in scene.objects if item.category == category]


def bounds(item: SceneObject) -> tuple[np.ndarray, np.ndarray]:
    centre, reach = item.world_from_object.translation, np.abs(item.world_from_object.rotation) @ item.dimensions_m / 2
    return centre - reach, centre + reach


def test_an_unclicked_worktop_is_built_at_the_scanned_height() -> None:
    (counter,) = of(kitchen(), "counter")
    low, high = bounds(counter)
    np.testing.assert_allclose(high[2], 0.892, atol=1e-3)
    np.testing.assert_allclose(low[2], 0.852, atol=1e-3)  # the units' tops, and the gap between them
    np.testing.assert_allclose(low[1], -0.295, atol=0.006)  # overhangs the fronts as in the scan
    np.testing.assert_allclose(high[1], 0.30, atol=0.002)  # the wall
    np.testing.assert_allclose([low[0], high[0]], [-0.3, 1.506], atol=0.02)  # not over the refrigerator
    np.testing.assert_allclose(counter.links[0].colour, np.array(BROWN) / 255, atol=0.01)
    assert any("without clicks" in line for line in counter.warnings)
    assert counter.name == "counter_1"


def test_worktops_of_two_runs_cover_the_corner_between_them() -> None:
    """Fillers leave 5 cm between the last doors and the corner; the scan shows the worktops over the units only."""
    across = Unit("across", "cabinet", (1.233, -0.63, 0.48), (0.6, 0.56, 0.74), yaw=-np.pi / 2, handle=Handle(0.24, 0.2))
    tops = ((-0.3, -0.295, 0.86), (0.903, 0.28, 0.892)), ((0.938, -0.93, 0.86), (1.513, -0.33, 0.892))
    first, second = of(built((CAB_L, CAB_R, across), scanned(*tops)), "counter")
    np.testing.assert_allclose([bounds(first)[0][0], bounds(first)[1][0]], [-0.3, 1.513], atol=0.01)
    np.testing.assert_allclose(bounds(second)[1][1], bounds(first)[0][1] - 0.002, atol=1e-3)


def test_the_front_edge_in_the_pictures_tells_the_height_of_black_stone() -> None:
    """Depth shows one patch of its top, 1 cm too high, and what stands on it; the pictures show its edge over every front."""
    patch, books = ((0.0, 0.0, 0.9), (0.15, 0.1, 0.91)), ((0.3, 0.0, 0.9), (0.6, 0.2, 0.96))
    assert of(built((CAB_L, CAB_R), scanned(patch, books)), "counter") == []
    (counter,) = of(built((CAB_L, CAB_R), scanned(patch, books), strip_over_m=0.05), "counter")
    low, high = bounds(counter)
    np.testing.assert_allclose([low[2], high[2]], [0.852, 0.902], atol=1e-3)
    np.testing.assert_allclose([low[0], high[0]], [-0.3, 0.903], atol=0.01)


CLICKED = Unit("top", "worktop", (0.6, 0.0, 0.872), (1.7, 0.6, 0.04), kind="thing")


@pytest.mark.parametrize("high", [0.04, 0.892])
def test_a_clicked_worktop_is_the_one_over_its_units(high: float) -> None:
    """Its own box is shorter, and may be a solid to the floor."""
    clicked = replace(CLICKED, centre=(0.6, 0.0, 0.892 - high / 2), size=(1.7, 0.6, high))
    scene = built((*RUN, BOTTLE, clicked), scanned(WORKTOP, PLINTH))
    unasked = of(kitchen(), "counter")[0]
    (top,) = of(scene, "worktop")
    assert (of(scene, "counter"), top.name, top.fixture) == ([], "top", "counter")
    np.testing.assert_allclose(bounds(top), bounds(unasked))
    assert not any("without clicks" in line for line in top.warnings)
    assert {item.name for item in scene.objects} == {item.name for item in kitchen().objects} - {"counter_1"} | {"top"}


def test_a_clicked_worktop_that_the_surface_does_not_show_stands_on_its_units() -> None:
    """Measured 4 cm thick, of which 3 cm are in the units."""
    scene = built((CAB_L, CAB_R, replace(CLICKED, centre=(0.3, 0.0, 0.86), size=(1.2, 0.6, 0.04))), scanned(), on=False)
    (top,) = of(scene, "worktop")
    low, high = bounds(top)
    np.testing.assert_allclose([low[2], high[2]], [0.852, 0.88], atol=1e-3)
    np.testing.assert_allclose([low[0], high[0]], [-0.3, 0.9], atol=0.02)
    assert deepest_contact(compile_scene(scene)) < 5e-4


def test_a_second_click_on_a_worktop_leaves_the_second_out_with_a_reason() -> None:
    again = replace(CLICKED, name="again", centre=(0.5, 0.0, 0.872), size=(1.2, 0.5, 0.04))
    scene = built((*RUN, CLICKED, again), scanned(WORKTOP, PLINTH))
    assert [item.name for item in of(scene, "worktop")] == ["top"]
    assert "again: left out: units, other worktops" in scene.failures["again"]


def test_a_worktop_whose_click_hits_no_surface_is_the_one_made_over_its_units() -> None:
    """Black gloss has no depth at the click, 60 cm in front of the camera and 40 cm below it."""
    scan = scanned(WORKTOP, PLINTH)
    camera = Intrinsics(fx=400.0, fy=400.0, cx=320.0, cy=240.0, width=640, height=480)
    down = np.array([[1.0, 0.0, 0.0], [0.0, -0.5547, 0.83205], [0.0, -0.83205, -0.5547]])
    frame = Frame(
        index=7,
        timestamp_s=None,
        rgb_camera=camera,
        depth_camera=camera,
        world_from_camera=Rigid3(down, np.array([0.5, -0.6, 1.292])),
        sharpness=1.0,
    )
    said = ObjectPrompt(name="top", category="worktop", points=(PromptPoint(frame=7, x=320.0, y=240.0, label=1),))
    beside = replace(said, name="beside", points=(PromptPoint(frame=7, x=320.0, y=-4000.0, label=1),))
    rng = np.random.default_rng(0)
    tracks, placements, assets = zip(*[placed_unit(u, rng) for u in RUN], strict=True)
    kitchen, config = replace(scan, frames=(*scan.frames, frame)), SynthesizeConfig()
    scene = build_scene(kitchen, tracks, placements, assets, Overrides(objects={}), config, (said, beside))
    (top,) = of(scene, "worktop")
    assert (top.name, of(scene, "counter")) == ("top", [])
    np.testing.assert_allclose(bounds(top)[1][2], 0.892, atol=1e-3)
    assert "its clicks show no surface" in top.warnings


def test_a_plinth_is_built_where_the_scan_shows_it() -> None:
    (plinth,) = of(kitchen(), "plinth")
    low, high = bounds(plinth)
    np.testing.assert_allclose(low[1], -0.22, atol=0.003)
    assert 0 < low[2] < 0.002
    np.testing.assert_allclose(high[2], 0.108, atol=2e-3)
    assert plinth.fixture == "fixed_panel"


def test_worktop_and_plinth_have_no_contacts_and_keep_joint_limits() -> None:
    model = compile_scene(kitchen())
    assert deepest_contact(model) < 5e-4
    assert max(sweep(kitchen(), model).values()) < 1e-3
    without = {j.name: j.upper for o in built(RUN, scanned(WORKTOP, PLINTH), on=False).objects for j in o.joints}
    assert {j.name: j.upper for o in kitchen().objects for j in o.joints} == without


def test_worktop_and_plinth_do_not_change_the_layout() -> None:
    alone = built((*RUN, BOTTLE), scanned(WORKTOP, PLINTH), on=False)
    assert kitchen().layout_moves_m == alone.layout_moves_m
    assert [o.name for o in kitchen().objects][: len(alone.objects)] == [o.name for o in alone.objects]


def test_an_appliance_stands_on_the_unclicked_worktop() -> None:
    """It was measured 4 mm above the worktop, whose height is known from many more points."""
    microwave = Unit("microwave", "microwave", (0.3, 0.0, 0.896 + 0.15), (0.5, 0.4, 0.3), kind="appliance")
    scene = built((*RUN, microwave), scanned(WORKTOP, PLINTH))
    (counter,), (found,) = of(scene, "counter"), of(scene, "microwave")
    assert bounds(found)[0][2] - bounds(counter)[1][2] == pytest.approx(0.0005, abs=1e-6)


def test_a_bottle_on_the_counter_gets_no_support_plate() -> None:
    assert not any(body.is_support for body in supported(plan_bundle(kitchen())).bodies)


def test_mesh_fitting_leaves_the_inferred_counter_unchanged() -> None:
    rng = np.random.default_rng(0)
    tracks, placements, assets = zip(*[placed_unit(u, rng) for u in (*RUN, BOTTLE)], strict=True)
    fitted = fit_meshes(kitchen(), tracks, placements, assets, WarpConfig())
    assert of(fitted, "counter") == of(kitchen(), "counter")


@pytest.mark.parametrize(
    "solids",
    [
        (),
        (((0.2, -0.1, 0.86), (0.45, 0.15, 0.9)),),  # a tray: level, but not a worktop
        (((-0.3, -0.28, 1.1), (1.5, 0.28, 1.12)),),  # a shelf
    ],
)
def test_no_counter_is_built_without_evidence(solids: tuple[tuple[Corner, Corner], ...]) -> None:
    assert not of(built(RUN, scanned(*solids)), "counter")


def test_an_unseen_plinth_gets_the_usual_setback() -> None:
    (plinth,) = of(built(RUN, scanned(WORKTOP)), "plinth")
    np.testing.assert_allclose(bounds(plinth)[0][1], -0.28 + 0.05, atol=2e-3)
    assert any("inferred" in line for line in plinth.warnings)


def test_a_clicked_counter_is_not_duplicated_and_names_stay_unique() -> None:
    clicked = Unit("worktop", "counter", (0.603, 0.0, 0.876), (1.806, 0.59, 0.032), kind="thing")
    assert [o.name for o in of(built((*RUN, clicked), scanned(WORKTOP, PLINTH)), "counter")] == ["worktop"]
    bottle = replace(BOTTLE, name="counter_1")
    scene = built((*RUN, bottle), scanned(WORKTOP, PLINTH))
    assert [o.name for o in of(scene, "counter")] == ["counter_2"]


def test_a_cooker_in_the_run_splits_the_counter() -> None:
    cooker = Unit("cooker", "oven", (0.603, 0.0, 0.448), (0.6, 0.6, 0.895), handle=Handle(0, 0.3, length=0.4, vertical=False))
    scene = built((CAB_L, cooker, UPPER, LOWER), scanned(WORKTOP, PLINTH))
    ends = sorted(tuple(float(edge[0]) for edge in bounds(o)) for o in of(scene, "counter"))
    assert len(ends) == 2
    assert ends[0][1] < 0.303 < 0.903 < ends[1][0]
    assert deepest_contact(compile_scene(scene)) < 5e-4


def test_counters_of_two_runs_meet_at_the_corner_without_overlap() -> None:
    side = [
        replace(CAB_L, name="side_1", centre=(1.836, -0.66, 0.48), yaw=-np.pi / 2),
        replace(CAB_R, name="side_2", centre=(1.836, -1.263, 0.48), yaw=-np.pi / 2),
    ]
    top_2 = ((1.541, -1.57, 0.86), (2.13, 0.28, 0.892))
    along = ((-0.3, -0.295, 0.86), (1.6, 0.28, 0.892))
    scene = built((CAB_L, CAB_R, UPPER, LOWER, *side), scanned(along, top_2))
    first, second = (bounds(o) for o in of(scene, "counter"))
    assert first[1][0] > 2.09  # the longer run includes the corner
    gap = first[0][1] - second[1][1]
    assert 0 < gap < 0.01
    assert deepest_contact(compile_scene(scene)) < 5e-4
