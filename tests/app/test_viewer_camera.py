"""The camera of the 3D view stays where a person moved it as long as only the appearance of the same scene changes."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.viewer.camera import USUAL_FOV
from app.viewer.scene import View
from r2c2r_core.errors import InputError
from r2c2r_core.workspace import Workspace
from tests.app.nouns import finish

MOVED = (9.0, 9.0, 9.0)


@pytest.fixture
def view(tmp_path: Path) -> View:
    finish(tmp_path / "work")
    server = MagicMock()
    server.get_clients.return_value = {0: SimpleNamespace(camera=SimpleNamespace(position=None, look_at=None))}
    return View(server, Workspace(tmp_path / "work"))


def after(view: View, **wish: Any) -> Any:
    """Camera position after a view is shown, starting from where a person moved it."""
    camera = view.server.get_clients()[0].camera
    camera.position = MOVED
    view.show(wish)
    return camera.position


def test_the_camera_is_kept_when_only_the_appearance_changes(view: View) -> None:
    aligned = {"mode": "aligned", "name": "drawer_1"}
    assert after(view, **aligned) != MOVED
    assert after(view, **aligned, opacity=0.3) == MOVED
    assert after(view, **aligned, cloud=False) == MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c0") != MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c0", opacity=0.5) == MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c1") != MOVED


def test_the_camera_moves_when_a_look_direction_is_requested(view: View) -> None:
    cloud = {"mode": "cloud"}
    after(view, **cloud)
    assert after(view, **cloud) == MOVED
    assert after(view, **cloud, look="scene") != MOVED


def test_the_first_view_shows_the_whole_scene_despite_a_selected_object(view: View) -> None:
    chosen = {"mode": "cloud", "name": "drawer_1", "focus": [50.0, 0.0, 0.0]}
    first = after(view, **chosen)
    assert after(view, **chosen, look="object") != first
    assert after(view, **chosen, look="scene") == first


def test_the_camera_takes_the_pose_of_a_photo_or_a_comment(view: View) -> None:
    assert after(view, mode="cloud", look="photo", frame=3) == (0.0, 0.0, 0.0)  # as in the recording
    camera = view.server.get_clients()[0].camera
    assert camera.look_at == (0.0, 0.0, 2.0)
    assert camera.fov == pytest.approx(2 * np.arctan(80 / 150))  # filmed in portrait: the vertical extent is the photo's width
    kept = {"position": [1.0, 2.0, 3.0], "target": [0.0, 0.0, 1.0]}
    assert after(view, mode="cloud", camera=kept) == (1.0, 2.0, 3.0)
    assert view.lens.pose == ([1.0, 2.0, 3.0], [0.0, 0.0, 1.0])
    assert camera.fov == USUAL_FOV
    assert after(view, mode="cloud") == MOVED
    with pytest.raises(InputError, match="no frame 99"):
        after(view, mode="cloud", look="photo", frame=99)


def test_a_page_that_connects_late_gets_the_current_camera(view: View) -> None:
    """viser moves only cameras of pages that have reported theirs; a page that is still loading keeps the initial one."""
    server: Any = view.server
    server.initial_camera = SimpleNamespace(position=(3.0, 3.0, 3.0), look_at=(0.0, 0.0, 0.0), fov=USUAL_FOV, near=0.01)
    view.show({"mode": "cloud"})
    late = SimpleNamespace(position=server.initial_camera.position, look_at=(0.0, 0.0, 0.0), fov=USUAL_FOV, near=0.01)
    view.show({"mode": "cloud", "look": "front"})
    assert late.position != server.initial_camera.position
    meet = server.on_client_connect.call_args.args[0]
    meet(SimpleNamespace(camera=late))
    assert late.position == server.initial_camera.position
    late.position = (-5.0, 0.0, 0.0)  # three.js's initial position, before anything is drawn, with z up
    meet(SimpleNamespace(camera=late))
    assert late.position == server.initial_camera.position
    late.position = MOVED  # a person's position after a lost connection
    meet(SimpleNamespace(camera=late))
    assert late.position == MOVED
