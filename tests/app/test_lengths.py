"""True lengths: stored beside the measured ones, with a resulting scale for reading the recording again."""

import json

import pytest

from app.services.lengths import best_scale
from tests.app.conftest import Running
from tests.app.nouns import finish


@pytest.fixture
def measured(web: Running) -> tuple[Running, str, int]:
    """A project with a finished drawer of 0.5 x 0.6 x 0.2 m."""
    project = web.sample()
    finish(web.settings.data_dir / "projects" / project / "work")
    number = next(one["id"] for one in web.get(f"/api/projects/{project}/objects") if one["name"] == "drawer_1")
    return web, project, number


def test_a_true_length_is_stored_with_its_error_and_the_resulting_scale(measured: tuple[Running, str, int]) -> None:
    web, project, number = measured
    at = f"/api/projects/{project}/lengths"
    assert web.get(at) == {"lengths": [], "scale": 1.0, "scale_wanted": None, "mean_error": None, "mean_error_scaled": None}
    found = web.post(at, {"object": number, "side": "width", "metres": 0.505}, 201)
    (length,) = found["lengths"]
    assert (length["text"], length["measured_m"]) == ("width of drawer_1", 0.5)
    assert length["error_m"] == pytest.approx(-0.005)
    assert found["scale_wanted"] == pytest.approx(1.01)
    found = web.post(at, {"points_world": [[0, 0, 0], [0, 1.0, 0]], "metres": 1.01, "text": "worktop"}, 201)
    assert [one["text"] for one in found["lengths"]] == ["width of drawer_1", "worktop"]
    assert found["mean_error"] == pytest.approx(0.01, rel=0.02)
    assert found["mean_error_scaled"] == pytest.approx(0.0, abs=1e-6)
    left = web.delete(f"{at}/{length['id']}")
    assert [one["text"] for one in left["lengths"]] == ["worktop"]
    web.delete(f"{at}/{length['id']}", 404)
    texts = [entry["text"] for entry in web.get(f"/api/projects/{project}/history")]
    assert "measured: width of drawer_1 is 505 mm" in texts
    assert "removed: width of drawer_1 is 505 mm" in texts


def test_rescaling_the_recording_rescales_the_points_of_true_lengths(measured: tuple[Running, str, int]) -> None:
    web, project, _ = measured
    at = f"/api/projects/{project}/lengths"
    web.post(at, {"points_world": [[0, 0, 0], [0, 1.0, 0]], "metres": 1.02}, 201)
    answer = web.client.put(f"/api/projects/{project}/reading", json={"scale": 1.02})
    assert answer.status_code == 202, answer.text
    assert answer.json()["scale"] == 1.02
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    requests = sorted(web.settings.data_dir.rglob("request.json"), key=lambda path: int(path.parent.name))
    assert json.loads(requests[-1].read_text())["config"] == {"ingest": {"scale": 1.02}}
    found = web.get(at)
    assert found["lengths"][0]["measured_m"] == pytest.approx(1.02)
    assert found["lengths"][0]["points_world"][1] == pytest.approx([0, 1.02, 0])
    assert found["scale_wanted"] == pytest.approx(1.02)
    assert "every length multiplied by 1.0200" in [entry["text"] for entry in web.get(f"/api/projects/{project}/history")]


def test_the_wanted_scale_of_a_side_is_the_same_before_the_next_run(measured: tuple[Running, str, int]) -> None:
    web, project, number = measured
    at = f"/api/projects/{project}/lengths"
    assert web.post(at, {"object": number, "side": "width", "metres": 0.55}, 201)["scale_wanted"] == pytest.approx(1.1)
    assert web.client.put(f"/api/projects/{project}/reading", json={"scale": 1.1}).status_code == 202
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    found = web.get(at)
    assert found["scale_wanted"] == pytest.approx(1.1)
    assert found["lengths"][0]["measured_m"] == pytest.approx(0.55)


def test_sides_that_the_category_set_do_not_affect_the_scale(measured: tuple[Running, str, int]) -> None:
    web, project, number = measured
    found = web.post(f"/api/projects/{project}/lengths", {"object": number, "side": "depth", "metres": 0.5}, 201)
    (length,) = found["lengths"]
    assert (length["measured_m"], length["compared"], found["scale_wanted"]) == (0.6, False, None)


@pytest.mark.parametrize(
    "wrong",
    [
        {"metres": 0.5},
        {"metres": 0.5, "side": "width"},
        {"metres": 0.0, "points_world": [[0, 0, 0], [1, 0, 0]]},
        {"metres": 0.5, "object": 1, "side": "width", "points_world": [[0, 0, 0], [1, 0, 0]]},
        {"metres": 0.5, "points_world": [[0, 0, 0]]},
    ],
)
def test_a_length_without_a_valid_side_or_point_pair_is_rejected(web: Running, wrong: dict) -> None:
    web.post(f"/api/projects/{web.sample()}/lengths", wrong, 422)


def test_a_length_of_an_unknown_object_is_not_found(web: Running) -> None:
    at = f"/api/projects/{web.sample()}/lengths"
    for text in ("", "worktop"):
        refused = web.post(at, {"object": 10**9, "side": "width", "metres": 0.5, "text": text}, 404)
        assert refused["kind"] == "not-found"


def test_the_best_scale_minimises_the_relative_error_of_all_lengths() -> None:
    assert best_scale([(0.99, 1.0), (1.98, 2.0)]) == pytest.approx(1 / 0.99)
    assert 1.0 < best_scale([(1.0, 1.0), (0.98, 1.0)]) < 1.02
