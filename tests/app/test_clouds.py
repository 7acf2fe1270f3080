"""Point cloud of an object while it is being clicked."""

import base64
from pathlib import Path

import cv2
import numpy as np
import pytest

from r2c2r_core.ingest.store import depth_path
from tests.app.test_reviews import Reviewed, reviewed

__all__ = ["reviewed"]


def test_the_point_cloud_of_an_object_lies_within_its_reported_size(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    found = web.get(f"/api/projects/{project}/objects/{number}/cloud")
    points = np.frombuffer(base64.b64decode(found["xyz_mm"]), "<i2").reshape(-1, 3)
    assert found["count"] == len(points) > 50
    assert len(base64.b64decode(found["rgb"])) == 3 * len(points)
    extent = np.ptp(points, axis=0) / 1000
    assert (extent <= np.array(found["size_m"]) + 0.05).all()  # nothing far outside the reported box


def test_an_object_without_masks_has_no_points(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    bare = web.post(f"/api/projects/{project}/objects", {"category": "mug"})["id"]
    assert web.get(f"/api/projects/{project}/objects/{bare}/cloud")["count"] == 0


def test_clicks_sent_together_are_one_undoable_change(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    base = f"/api/projects/{project}"
    points = [{"frame": 3, "x": 40, "y": 40, "label": 1}, {"frame": 3, "x": 5, "y": 40, "label": 0}]
    assert len(web.post(f"{base}/objects/{number}/clicks", {"points": points})["points"]) == 3
    assert len(web.post(f"{base}/undo", {"object": number})["object"]["points"]) == 1
    outside = [points[0], {"frame": 3, "x": 5000, "y": 1}]
    web.post(f"{base}/objects/{number}/clicks", {"points": outside}, 422)
    assert len(web.get(f"{base}/objects")[0]["points"]) == 1  # all or none


@pytest.mark.parametrize("look", ["ghost", "outline", "residual"])
def test_the_placed_mesh_is_rendered_from_the_camera_of_a_photo(reviewed: Reviewed, look: str) -> None:
    web, project, number = reviewed
    shown = web.get(f"/api/projects/{project}/objects/{number}/photos")
    assert "placed" in shown["of"]
    photo = shown["photos"][0]
    address = f"/media/{project}/overlay/{number}/{photo['frame']}.png?of=placed&look={look}&v={shown['version']}"
    answer = web.client.get(address)
    image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    assert image.shape[1] == 1920  # as wide as a phone's photos
    assert image.shape[2] == 4
    assert image[0, 0, 3] == 0  # transparent where the mesh is not
    assert "immutable" in answer.headers["cache-control"]
    assert web.client.get(f"/media/{project}/overlay/{number}/999.png").status_code in (404, 409)


def test_stored_depth_of_another_resolution_is_answered_with_not_ready(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    shown = web.get(f"/api/projects/{project}/objects/{number}/photos")
    frame = shown["photos"][0]["frame"]
    stored = list(web.settings.data_dir.rglob(depth_path(Path(), frame).as_posix()))
    for path in stored:
        cv2.imwrite(str(path), np.full((15, 20), 1000, np.uint16))
    assert stored
    answer = web.client.get(f"/media/{project}/overlay/{number}/{frame}.png?of=placed&look=residual&v={shown['version']}")
    assert answer.status_code == 409, answer.content[:200]
    assert answer.json()["kind"] == "not-ready"
