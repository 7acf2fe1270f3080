"""A front that was filmed open is drawn over its photos as open as it was; photos that show an object whole come first."""

from dataclasses import replace

import numpy as np
import pytest

from app.db.engine import reading
from app.db.queries import project_row
from app.services.overlays import parts_of
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.workspace import Workspace
from tests.app.nouns import scene
from tests.app.test_reviews import Reviewed, reviewed

__all__ = ["reviewed"]

FILMED = JointMotion(
    kind="prismatic",
    axis_world=np.array([0.0, -1.0, 0.0]),
    pivot_world=np.zeros(3),
    covariance=np.zeros((6, 6)),
    states={0: State(value=0.0, sigma=0.001), 3: State(value=0.25, sigma=0.002), 7: State(value=None, sigma=None)},
    largest=0.25,
    stop_seen=False,
    source="measured",
)


def filmed(reviewed: Reviewed, motion: JointMotion | None) -> None:
    """The drawer of the finished scene, as it was filmed."""
    web, project, _ = reviewed
    made = scene("drawer_1")
    (item,) = made.objects
    joints = (replace(item.joints[0], motion=motion),)
    work = web.settings.data_dir / "projects" / project / "work"
    objects = (replace(item, joints=joints),)
    Workspace(work).save("warp", "scene", replace(made, objects=objects), {"key": "k2", "seconds": 1.0})


@pytest.mark.parametrize(("frame", "out_m"), [(0, 0.0), (3, 0.25), (7, 0.0)])
def test_a_leaf_is_drawn_where_it_stood_in_the_photo(reviewed: Reviewed, frame: int, out_m: float) -> None:
    web, project, _ = reviewed
    filmed(reviewed, FILMED)
    with reading(web.context.engine) as session:
        files = web.context.files(project_row(session, project))
    base, front = parts_of(files, "drawer_1", "fitted", frame)
    np.testing.assert_allclose(front.vertices_world - base.vertices_world, np.tile([0.0, -out_m, 0.0], (8, 1)), atol=1e-12)


def test_a_hinged_leaf_turns_about_its_hinge(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    made = scene("drawer_1")
    (item,) = made.objects
    turned = replace(FILMED, kind="revolute", states={3: State(value=np.pi / 2, sigma=0.01)})
    origin, axis = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    joint = replace(item.joints[0], type="revolute", origin_object=origin, axis_object=axis, motion=turned)
    work = web.settings.data_dir / "projects" / project / "work"
    door = replace(made, objects=(replace(item, joints=(joint,)),))
    Workspace(work).save("warp", "scene", door, {"key": "k2", "seconds": 1.0})
    with reading(web.context.engine) as session:
        files = web.context.files(project_row(session, project))
    base, front = parts_of(files, "drawer_1", "fitted", 3)
    x, y, z = (base.vertices_world - origin).T
    np.testing.assert_allclose(front.vertices_world, np.stack([-y, x, z], axis=1) + origin, atol=1e-9)


def test_photos_say_how_far_it_was_open_and_where_it_is_in_them(reviewed: Reviewed) -> None:
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
