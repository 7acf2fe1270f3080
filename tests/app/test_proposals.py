from collections.abc import Callable
from typing import Any

from app.files import project_files
from app.jobs.proposal_wire import read_proposals, write_proposals
from tests.app.conftest import Running

CLICK = {"frame": 3, "x": 100.5, "y": 60.5, "label": 1}


def proposed(web: Running, project: str, *, count: int = 3) -> list[dict[str, Any]]:
    """The proposals, once the live segmenter has made them all."""
    web.post(f"/api/projects/{project}/live/open")

    def ready() -> bool:
        found = web.get(f"/api/projects/{project}/proposals")
        return bool(found["state"] == "done" and len(found["items"]) == count)

    web.until(ready)
    items: list[dict[str, Any]] = web.get(f"/api/projects/{project}/proposals")["items"]
    return items


def names(web: Running, project: str) -> list[str]:
    return [item["name"] for item in web.get(f"/api/projects/{project}/objects")]


def test_there_are_no_proposals_before_the_segmenter_has_run(web: Running) -> None:
    project = web.sample()
    assert web.get(f"/api/projects/{project}/proposals") == {"state": "none", "fraction": 0.0, "items": [], "dismissed": 0}


def test_confirming_a_proposal_creates_an_object_and_can_be_undone(web: Running) -> None:
    project = web.sample()
    before = names(web, project)
    first, *rest = proposed(web, project)
    (made,) = web.post(f"/api/projects/{project}/proposals/confirm", {"ids": [first["id"]]}, 201)
    assert made["category"] == first["category"]
    assert [(p["frame"], p["x"], p["y"], p["label"]) for p in made["points"]] == [(first["frame"], first["x"], first["y"], 1)]
    assert [item["id"] for item in proposed(web, project, count=2)] == [item["id"] for item in rest]
    assert web.get(f"/api/projects/{project}/history?limit=1")[0]["text"] == f"confirmed proposal {made['name']}"
    web.until(lambda: web.get(f"/api/projects/{project}/objects")[-1]["segment"] == "done")
    undone = web.post(f"/api/projects/{project}/undo", {})
    assert undone["object"]["deleted"]
    assert names(web, project) == before
    assert [item["id"] for item in proposed(web, project)] == [first["id"], *(item["id"] for item in rest)]


def test_several_proposals_are_confirmed_in_one_request(web: Running) -> None:
    project = web.sample()
    ids = [item["id"] for item in proposed(web, project)]
    made = web.post(f"/api/projects/{project}/proposals/confirm", {"ids": [*ids, ids[0]]}, 201)
    assert [item["category"] for item in made] == ["drawer", "drawer", "bottle"]
    assert len({item["name"] for item in made}) == 3
    assert web.get(f"/api/projects/{project}/proposals")["items"] == []


def test_an_object_clicked_by_hand_removes_its_proposal(web: Running) -> None:
    project = web.sample()
    proposed(web, project)
    click = {**CLICK, "x": 102.5}  # beside the proposal's own click, within its outline
    web.post(f"/api/projects/{project}/objects", {"category": "bottle", "points": [click]}, 201)
    left = proposed(web, project, count=2)
    assert [item["category"] for item in left] == ["drawer", "drawer"]


def test_a_proposal_partly_covered_by_an_object_is_doubtful(web: Running) -> None:
    project = web.sample()
    assert {tuple(item["doubts"]) for item in proposed(web, project)} == {()}
    click = {**CLICK, "x": 107.5}  # 3 of 10 columns of the bottle's outline, of which 4 would be the same object
    made = web.post(f"/api/projects/{project}/objects", {"category": "bottle", "points": [click]}, 201)
    web.until(lambda: web.get(f"/api/projects/{project}/objects")[-1]["segment"] == "done")
    *drawers, bottle = proposed(web, project)
    assert bottle["doubts"] == [f"shares 30 % with {made['name']}"]
    assert [item["doubts"] for item in drawers] == [[], []]


def test_proposals_are_confirmed_with_a_given_category(web: Running) -> None:
    project = web.sample()
    ids = [item["id"] for item in proposed(web, project)[:2]]
    made = web.post(f"/api/projects/{project}/proposals/confirm", {"ids": ids, "category": "pull_out"}, 201)
    assert [(item["name"], item["category"]) for item in made] == [("pull_out_1", "pull_out"), ("pull_out_2", "pull_out")]


def test_dismissals_survive_a_restart_and_can_be_restored(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        first = proposed(web, project)[0]
        after = web.post(f"/api/projects/{project}/proposals/dismiss", {"ids": [first["id"]]})
        assert (len(after["items"]), after["dismissed"]) == (2, 1)
    with start() as web:  # proposals are stored: no segmenter is needed to show them
        kept = web.get(f"/api/projects/{project}/proposals")
        assert (kept["state"], len(kept["items"]), kept["dismissed"]) == ("done", 2, 1)
        assert web.get(f"/api/projects/{project}/live")["state"] == "off"
        back = web.post(f"/api/projects/{project}/proposals/restore")
        assert (len(back["items"]), back["dismissed"]) == (3, 0)


def test_proposals_of_an_interrupted_search_are_shown_and_kept(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        at = f"/api/projects/{project}/proposals"
        slow = next(web.settings.data_dir.rglob("work")) / "propose_slowly"
        slow.touch()
        web.post(f"/api/projects/{project}/live/open")
        web.until(lambda: len(web.get(at)["items"]) == 1)
        found = web.get(at)
        assert (found["state"], found["fraction"]) == ("running", 0.5)
    with start() as web:
        kept = web.get(at)  # before the search begins again
        assert (kept["state"], kept["items"]) == ("none", found["items"])
        web.post(f"{at}/dismiss", {"ids": [found["items"][0]["id"]]})
        slow.unlink()
        assert [item["category"] for item in proposed(web, project, count=2)] == ["drawer", "bottle"]
        assert web.get(at)["dismissed"] == 1


def test_a_search_that_begins_again_keeps_showing_earlier_proposals(web: Running) -> None:
    project = web.sample()
    files = project_files(web.settings.data_dir, project)
    earlier = proposed(web, project)
    web.context.live.close(project)
    stored = read_proposals(files.proposals)[1]
    write_proposals(files.proposals, 0.6, [stored[0], stored[2]])  # as an interrupted search leaves them
    (files.work / "propose_slowly").touch()
    web.post(f"/api/projects/{project}/live/open")
    at = f"/api/projects/{project}/proposals"
    web.until(lambda: web.get(at)["fraction"] == 0.5)
    assert [item["id"] for item in web.get(at)["items"]] == [earlier[0]["id"], earlier[2]["id"]]
    (files.work / "propose_slowly").unlink()
    assert proposed(web, project) == earlier


def test_confirming_a_dismissed_proposal_is_not_found(web: Running) -> None:
    project = web.sample()
    first = proposed(web, project)[0]
    web.post(f"/api/projects/{project}/proposals/dismiss", {"ids": [first["id"]]})
    refused = web.post(f"/api/projects/{project}/proposals/confirm", {"ids": [first["id"]]}, 404)
    assert refused["kind"] == "not-found"
