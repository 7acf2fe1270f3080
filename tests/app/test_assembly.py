"""The scene in the 3D view: joint motion, ray picking, visibility, and corrections shown before a run."""

import itertools
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.viewer import heat
from app.viewer.assembly import Style, assemble
from app.viewer.camera import LONG_FOV, USUAL_FOV, from_axis, from_direction
from app.viewer.scene import View
from r2c2r_core.workspace import Workspace
from tests.app.finished import keep_results
from tests.app.nouns import finish
from tests.core.export.kitchen import kitchen
from tests.core.export.test_report import certificate

AHEAD = np.array([0.0, 1.0, 0.0])  # looking at the fronts, which face -Y


@pytest.fixture
def view(tmp_path: Path) -> View:
    finish(tmp_path / "work")
    keep_results(tmp_path / "work", certificate())
    server = MagicMock()
    camera = SimpleNamespace(position=(0.0, -3.0, 1.0), look_at=(0.0, 0.0, 1.0), fov=USUAL_FOV, near=0.01)
    server.get_clients.return_value = {0: SimpleNamespace(camera=camera)}
    server.initial_camera = SimpleNamespace(position=(0.0, -3.0, 1.0), look_at=(0.0, 0.0, 1.0), fov=USUAL_FOV, near=0.01)
    return View(server, Workspace(tmp_path / "work"))


def test_a_joint_moves_its_body_along_its_axis_within_its_limits() -> None:
    shown = assemble(MagicMock(), "/scene", kitchen(), Style(), MagicMock())
    closed = shown.poses()
    shown.move({"drawer_1_slide": 0.2, "cabinet_1_hinge": 9.0})
    opened = shown.poses()
    assert np.allclose(opened["drawer_1_drawer"].translation - closed["drawer_1_drawer"].translation, [0.0, -0.2, 0.0])
    turned = opened["cabinet_1_door"].rotation
    upper = shown.joints["cabinet_1_hinge"].upper  # clamped
    assert np.arccos((np.trace(turned) - 1) / 2) == pytest.approx(upper)


def test_bounding_boxes_are_drawn_for_the_selected_object_only() -> None:
    server = MagicMock()
    server.scene.add_frame.side_effect = lambda node, **_: SimpleNamespace(name=node)
    server.scene.add_line_segments.side_effect = lambda node, ends, *_, **__: MagicMock(node=node, ends=ends)
    shown = assemble(server, "/scene", kitchen(), Style(), MagicMock())
    mine = {shown.frames[body.name].name for body in shown.plan.bodies if body.object_name == "cabinet_1"}
    shown.choose("cabinet_1")
    boxes = list(shown.boxes)
    assert {box.node.rsplit("/", 1)[0] for box in boxes} == mine
    assert all(np.ptp(box.ends, axis=(0, 1)).min() > 0 for box in boxes)
    shown.choose("")
    assert all(box.remove.called for box in boxes)
    assert shown.boxes == []


def test_a_ray_hits_the_nearest_face_and_ignores_hidden_objects() -> None:
    shown = assemble(MagicMock(), "/scene", kitchen(), Style(), MagicMock())
    cabinet = next(item for item in kitchen().objects if item.name == "cabinet_1")
    middle = cabinet.world_from_object.translation
    start = middle + np.array([0.0, -3.0, 0.0])
    hit = shown.hit(start, AHEAD)
    assert hit is not None
    assert hit.name == "cabinet_1"
    face = float(cabinet.world_from_object.translation[1] - cabinet.dimensions_m[1] / 2)
    assert hit.point_world[1] == pytest.approx(face, abs=0.005)  # its fitted mesh is a few millimetres thick
    shown.hide(["cabinet_1"])
    assert shown.hit(start, AHEAD) is None


def test_a_click_reports_its_number_and_the_object_hit(view: View) -> None:
    view.show({"mode": "scene", "cloud": False})
    middle = next(item for item in kitchen().objects if item.name == "drawer_1").world_from_object.translation
    origin = middle + np.array([0.0, -3.0, 0.0])
    view._pick(SimpleNamespace(ray_origin=tuple(origin), ray_direction=tuple(AHEAD)))
    assert (view.picked.number, view.picked.name) == (1, "drawer_1")
    view._pick(SimpleNamespace(ray_origin=tuple(origin), ray_direction=tuple(-AHEAD)))
    assert (view.picked.number, view.picked.name, view.picked.point) == (2, "", None)


def test_corrections_are_previewed_before_a_run_and_listed_if_they_have_effect(view: View) -> None:
    def shown(**corrections: Any) -> list[str]:
        view.show({"mode": "scene", "cloud": False, "corrections": corrections})
        return view.preview

    assert shown() == []
    assert shown(cabinet_1={"hinge": "left"}) == []  # unchanged
    assert shown(cabinet_1={"hinge": "right"}) == ["cabinet_1"]
    assert view.assembly is not None
    assert "counter_1" in {body.object_name for body in view.assembly.plan.bodies}
    assert shown(counter_1={"left_out": True}) == ["counter_1"]
    assert "counter_1" not in {body.object_name for body in view.assembly.plan.bodies}


def test_selecting_and_hiding_keep_the_scene_and_the_camera(view: View) -> None:
    view.show({"mode": "scene", "cloud": False})
    built = view.assembly
    camera = view.server.get_clients()[0].camera
    camera.position = (9.0, 9.0, 9.0)
    view.show({"mode": "scene", "cloud": False, "name": "drawer_1", "hidden": ["bottle_1"], "focus": [0.0, 0.0, 0.0]})
    assert view.assembly is built
    assert camera.position == (9.0, 9.0, 9.0)


def test_switching_to_the_long_lens_keeps_the_apparent_size_of_the_target(view: View) -> None:
    camera = view.server.get_clients()[0].camera
    view.lens.use(parallel=True)
    assert camera.fov == LONG_FOV
    before, after = 3.0 * np.tan(USUAL_FOV / 2), abs(camera.position[1]) * np.tan(LONG_FOV / 2)
    assert after == pytest.approx(before)
    view.lens.use(parallel=False)
    assert np.allclose(camera.position, (0.0, -3.0, 1.0))


@pytest.mark.parametrize(
    ("axis", "way"), [("front", (0, -1, 0)), ("right", (1, 0, 0)), ("left", (-1, 0, 0)), ("top", (0, 0, 1))]
)
def test_side_views_are_named_from_a_viewer_facing_the_fronts(axis: Any, way: tuple[int, int, int]) -> None:
    place, target = from_axis(axis, -AHEAD, np.array(list(itertools.product((-1.0, 1.0), repeat=3))))
    assert np.allclose((place - target) / np.linalg.norm(place - target), way, atol=2e-3)


@pytest.mark.parametrize("towards", [(0.0, -1.0, 0.0), (0.4, -0.8, 0.5), (1.0, 0.2, -0.3)])
def test_a_whole_scene_just_fills_a_square_picture(towards: tuple[float, float, float]) -> None:
    points = np.random.default_rng(0).uniform((-1.5, 0.0, 0.0), (1.5, 0.6, 2.0), (50, 3)) @ [
        [0.6, 0.8, 0],
        [-0.8, 0.6, 0],
        [0, 0, 1],
    ]
    place, target = from_direction(np.array(towards), points)
    back = (place - target) / np.linalg.norm(place - target)
    assert np.allclose(back, np.array(towards) / np.linalg.norm(towards))
    right = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], back))
    rays = points - place
    picture = np.abs(rays @ np.column_stack([right, np.cross(back, right)])) / -(rays @ back)[:, None]
    assert picture.max() == pytest.approx(np.tan(USUAL_FOV / 2))


def test_a_clip_box_clips_meshes_and_ray_hits_and_outlines_the_cut() -> None:
    server = MagicMock()
    whole = assemble(MagicMock(), "/scene", kitchen(), Style(), MagicMock())
    cut = assemble(server, "/scene", kitchen(), Style(clip=((0.0, 0.5, 0.0), (1.0, 1.0, 1.0))), MagicMock())
    middle = (whole.span.low[1] + whole.span.high[1]) / 2
    along = whole.span.span_from_world[1]
    depths = [body.world_from_body.apply(shape.vertices) @ along for body in cut.plan.bodies for shape in cut.shapes[body.name]]
    assert np.concatenate(depths).min() == pytest.approx(middle, abs=1e-6)
    lines = server.scene.add_line_segments.call_args_list
    assert lines
    cabinet = next(item for item in kitchen().objects if item.name == "cabinet_1")
    start = cabinet.world_from_object.translation + np.array([0.0, -3.0, 0.0])
    hit = cut.hit(start, AHEAD)
    assert hit is not None
    assert hit.point_world[1] > middle - 1e-6  # its front is hidden: the click hits what is behind
    assert cut.span.low == pytest.approx(whole.span.low)  # of the whole scene, cut or not
    assert cut.parts["cabinet_1"][0] == pytest.approx(whole.parts["cabinet_1"][0])


def test_a_clip_box_covering_the_whole_scene_removes_no_faces() -> None:
    whole = assemble(MagicMock(), "/scene", kitchen(), Style(), MagicMock())
    same = assemble(MagicMock(), "/scene", kitchen(), Style(clip=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))), MagicMock())
    assert {name: [len(shape.faces) for shape in shapes] for name, shapes in same.shapes.items()} == {
        name: [len(shape.faces) for shape in shapes] for name, shapes in whole.shapes.items()
    }


def test_clipping_is_applied_to_bodies_at_their_joint_positions() -> None:
    whole = assemble(MagicMock(), "/scene", kitchen(), Style(), MagicMock())
    low, high = whole.parts["drawer_1"]
    box = ((0.0, 0.0, 0.0), (1.0, float(low[1] + high[1]) / 2, 1.0))

    def back(values: dict[str, float]) -> float:
        """Rear end of the drawer in its own frame."""
        cut = assemble(MagicMock(), "/scene", kitchen(), Style(draw="colliders", clip=box), MagicMock(), values)
        return max(float(shape.vertices[:, 1].max()) for shape in cut.shapes["drawer_1_drawer"])

    assert back({"drawer_1_slide": 0.1}) == pytest.approx(back({}) + 0.1, abs=1e-6)  # pulled out, more of it is before the cut


def test_surfaces_are_coloured_by_distance_to_the_scan() -> None:
    tree = cKDTree(np.zeros((1, 3)))
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.015], [0.0, 0.0, 0.04], [0.0, 0.0, 0.3]])
    found = heat.colours("distance", tree, points)
    assert found[3].tolist() == [110, 110, 110]  # no error: nothing was measured there
    assert len({tuple(one) for one in found.tolist()}) == 4
    brightness = heat.colours("unobserved", tree, points).sum(axis=1)
    assert brightness[3] > brightness[2] >= brightness[0]


def test_a_heat_map_subdivides_every_body_into_small_triangles(view: View) -> None:
    view.show({"mode": "scene", "cloud": False, "draw": "unobserved"})
    assert view.assembly is not None
    for shapes in view.assembly.shapes.values():
        for shape in shapes:
            sides = np.linalg.norm(np.diff(shape.vertices[shape.faces[:, [0, 1, 2, 0]]], axis=1), axis=2)
            assert sides.max() <= heat.EDGE_M + 1e-9
    drawn = view.server.scene.add_mesh_trimesh.call_args_list[-1].args[1]
    assert drawn.visual.kind == "vertex"


def test_the_clip_box_clips_the_scan_and_the_selected_object_has_its_extent(view: View) -> None:
    view.show({"mode": "cloud"})
    assert view.span_m is not None

    def points() -> int:
        return sum(len(call.args[1]) for call in view.server.scene.add_point_cloud.call_args_list)

    whole = points()
    view.server.scene.add_point_cloud.reset_mock()
    view.show({"mode": "cloud", "clip": {"low": [0.5, 0.0, 0.0], "high": [1.0, 1.0, 1.0]}})
    assert 0.2 * whole < points() < 0.8 * whole
    view.show({"mode": "scene", "name": "cabinet_1", "cloud": False})
    part = view.part_of(view.chosen)
    assert part is not None
    assert 0.0 <= part["low"][0] < part["high"][0] <= 1.0
