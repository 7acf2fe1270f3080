"""Overlays of opened fronts on photos at their estimated joint state; photos that show an object completely come first."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.db.engine import reading
from app.db.queries import project_row
from app.services.overlays import edges_of, parts_of
from app.services.views import frames_folder
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.depth import encode_depth
from r2c2r_core.ingest.store import depth_path
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.workspace import Workspace
from tests.app.nouns import scene, track
from tests.app.test_reviews import Reviewed, reviewed

__all__ = ["reviewed"]

FILMED = JointMotion(
    kind="prismatic",
    axis_world=np.array([0.0, -1.0, 0.0]),
    pivot_world=np.zeros(3),
    covariance=np.zeros((6, 6)),
    states={0: State(value=0.0, sigma=0.001), 3: State(value=0.25, sigma=0.002), 7: State(value=None, sigma=None)},
    largest=0.25,
    source="measured",
)
BEFORE = Rigid3(np.eye(3), np.array([0.0, 0.0, 3.0]))  # the camera, which looks along z


def filmed(reviewed: Reviewed, motion: JointMotion | None) -> None:
    """Store the finished scene's drawer with this motion."""
    web, project, _ = reviewed
    store(web.settings.data_dir / "projects" / project / "work", drawer(motion), motion)


def drawer(motion: JointMotion | None) -> ArticulatedScene:
    made = scene("drawer_1")
    (item,) = made.objects
    joints = (replace(item.joints[0], motion=motion),)
    return replace(made, objects=(replace(item, joints=joints, world_from_object=BEFORE),))


def store(work: Path, made: ArticulatedScene, motion: JointMotion | None) -> None:
    """Store the scene as built by a run from such a track."""
    space, motions = Workspace(work), () if motion is None else (motion,)
    space.save("segment", "drawer_1", replace(track("drawer_1"), motions=motions), {"key": "k2", "seconds": 1.0})
    space.save("warp", "scene", made, {"key": "k2", "seconds": 1.0})


@pytest.mark.parametrize(("frame", "out_m"), [(0, 0.0), (3, 0.25), (7, 0.0)])
def test_a_leaf_is_placed_at_its_joint_state_in_the_photo(reviewed: Reviewed, frame: int, out_m: float) -> None:
    web, project, _ = reviewed
    filmed(reviewed, FILMED)
    with reading(web.context.engine) as session:
        files = web.context.files(project_row(session, project))
    base, front = parts_of(files, "drawer_1", "fitted", frame, {})
    np.testing.assert_allclose(front.vertices_world - base.vertices_world, np.tile([0.0, -out_m, 0.0], (8, 1)), atol=1e-12)


def test_a_hinged_leaf_rotates_about_its_hinge(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    made = scene("drawer_1")
    (item,) = made.objects
    upright = np.array([0.0, 0.0, 1.0])
    turned = replace(FILMED, kind="revolute", axis_world=upright, states={3: State(value=np.pi / 2, sigma=0.01)})
    origin = np.array([0.5, 0.0, 0.0])
    joint = replace(item.joints[0], type="revolute", origin_object=origin, axis_object=upright, motion=turned)
    work = web.settings.data_dir / "projects" / project / "work"
    store(work, replace(made, objects=(replace(item, joints=(joint,)),)), turned)
    with reading(web.context.engine) as session:
        files = web.context.files(project_row(session, project))
    base, front = parts_of(files, "drawer_1", "fitted", 3, {})
    x, y, z = (base.vertices_world - origin).T
    np.testing.assert_allclose(front.vertices_world, np.stack([-y, x, z], axis=1) + origin, atol=1e-9)


def test_photos_report_joint_states_and_the_bounding_box_of_the_object(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    filmed(reviewed, FILMED)
    photos = web.get(f"/api/projects/{project}/objects/{number}/photos")["photos"]
    states = {photo["frame"]: photo["states"] for photo in photos}
    assert states[3] == [{"joint": "drawer_1_slide", "type": "prismatic", "value": 0.25, "sigma": 0.002}]
    whole = [photo["whole"] for photo in photos]
    assert whole == sorted(whole, reverse=True)
    for photo in photos:
        left, top, right, bottom = photo["box"]
        assert 0 <= left < right <= 1
        assert 0 <= top < bottom <= 1


def test_occluded_surface_is_drawn_faintly_over_the_photo(reviewed: Reviewed) -> None:
    web, project, drawer = reviewed
    filmed(reviewed, None)
    with reading(web.context.engine) as session:
        files = web.context.files(project_row(session, project))
    made = scene("drawer_1")
    (item,) = made.objects
    behind = replace(item, world_from_object=BEFORE)
    folder = depth_path(frames_folder(files), 3)
    folder.parent.mkdir(parents=True, exist_ok=True)

    def alpha(wall_m: float) -> int:
        cv2.imwrite(str(folder), encode_depth(np.full((30, 40), wall_m)))
        at = {"key": f"k{wall_m}", "seconds": 1.0}
        Workspace(files.work).save("warp", "scene", replace(made, objects=(behind,)), at)
        picture = web.client.get(f"/media/{project}/overlay/{drawer}/3.png?of=fitted&look=ghost&v={wall_m}").content
        image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        return int(image[..., 3].max())

    assert alpha(5.0) == 255
    assert 0 < alpha(1.0) < 100


def test_marked_joint_states_are_shown_immediately_and_undone(reviewed: Reviewed) -> None:
    """The overlay, the lane and the joint limit of the leaf follow a marked state before any run."""
    web, project, number = reviewed
    filmed(reviewed, FILMED)
    address = f"/api/projects/{project}/objects/{number}"

    def photos() -> tuple[dict[int, Any], dict[str, Any], str]:
        found = web.get(f"{address}/photos")
        (leaf,) = found["leaves"]
        return {photo["frame"]: photo["states"] for photo in found["photos"]}, leaf, found["version"]

    before, leaf, version = photos()
    assert (leaf["part"], leaf["type"], leaf["most"], leaf["opening"]["largest"]) == ("front", "prismatic", 0.6, 0.25)
    assert leaf["size_m"] == pytest.approx([0.5, 0.02, 0.2])
    web.patch(f"{address}/override", {"states": {"front": [{"frame": 7, "state": 0.3}]}, "rerun": False})
    after, leaf, marked = photos()
    assert after[7] == [{"joint": "drawer_1_slide", "type": "prismatic", "value": 0.3, "sigma": None}]
    assert after[3] == before[3]
    assert marked != version
    assert (leaf["opening"]["largest"], leaf["opening"]["states"][-1]) == (0.3, {"frame": 7, "value": 0.3, "sigma": None})
    (lane,) = [one for one in web.get(f"/api/projects/{project}/openings") if one["object"] == number]
    assert (lane["largest"], lane["states"][-1]) == (0.3, {"frame": 7, "value": 0.3, "sigma": None})
    picture = f"/media/{project}/overlay/{number}/7.png?of=fitted&look=ghost"
    drawn = web.client.get(f"{picture}&v={marked}").content
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    assert (photos()[0], photos()[2]) == (before, version)
    assert web.client.get(f"{picture}&v={version}").content != drawn


def test_a_leaf_without_observed_motion_can_be_marked(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    filmed(reviewed, None)
    address = f"/api/projects/{project}/objects/{number}"
    assert web.get(f"{address}/photos")["leaves"][0]["opening"] is None
    assert [one for one in web.get(f"/api/projects/{project}/openings") if one["object"] == number] == []
    web.patch(f"{address}/override", {"states": {"drawer_1_slide": [{"frame": 3, "state": 0.2}]}, "rerun": False})
    assert web.get(f"{address}/photos")["leaves"][0]["opening"]["source"] == "person"
    (lane,) = [one for one in web.get(f"/api/projects/{project}/openings") if one["object"] == number]
    assert (lane["source"], lane["states"]) == ("person", [{"frame": 3, "value": 0.2, "sigma": None}])


@pytest.mark.parametrize(("sides", "inner"), [(24, False), (4, True)])
def test_the_outline_shows_edges_of_a_box_but_no_facets_of_a_round_body(sides: int, inner: bool) -> None:
    camera = Intrinsics(fx=1500.0, fy=1500.0, cx=160.0, cy=120.0, width=320, height=240)
    angle = np.arange(sides) / sides * 2 * np.pi + np.pi / 4 + 0.1
    ring = np.column_stack([0.04 * np.cos(angle), np.zeros(sides), 1.0 + 0.04 * np.sin(angle)])
    half = np.array([0.0, 0.06, 0.0])
    vertices = np.vstack([ring - half, ring + half])
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.vstack([np.column_stack([k, after, k + sides]), np.column_stack([after, after + sides, k + sides])])
    depth = rasterize(vertices, faces, np.zeros((2 * sides, 3)), camera, Rigid3()).depth_m
    within = cv2.erode((depth > 0).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert within.any()
    assert (edges_of(depth, camera) & within).any() == inner
