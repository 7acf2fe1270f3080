"""The camera of the 3D view stays where a person moved it while only the look of the same thing changes."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.viewer.scene import View
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
    """Where the camera is once that is shown, from where a person had moved it."""
    camera = view.server.get_clients()[0].camera
    camera.position = MOVED
    view.show(wish)
    return camera.position


def test_the_camera_stays_where_it_is_while_the_same_thing_is_shown_otherwise(view: View) -> None:
    aligned = {"mode": "aligned", "name": "drawer_1"}
    assert after(view, **aligned) != MOVED
    assert after(view, **aligned, opacity=0.3) == MOVED
    assert after(view, **aligned, cloud=False) == MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c0") != MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c0", opacity=0.5) == MOVED
    assert after(view, mode="candidate", name="drawer_1", candidate="c1") != MOVED


def test_the_camera_is_turned_where_it_is_asked_to_look(view: View) -> None:
    cloud = {"mode": "cloud"}
    after(view, **cloud)
    assert after(view, **cloud) == MOVED
    assert after(view, **cloud, look="scene") != MOVED


def test_the_first_view_is_of_the_whole_scene_not_of_the_object_that_happens_to_be_chosen(view: View) -> None:
    chosen = {"mode": "cloud", "name": "drawer_1", "focus": [50.0, 0.0, 0.0]}
    first = after(view, **chosen)
    assert after(view, **chosen, look="object") != first
    assert after(view, **chosen, look="scene") == first
