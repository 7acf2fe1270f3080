"""Two names on one panel: a click on one cuts the other's front, both in the live segmenter's masks and in a run's.

First the desk on a small scene, then the server with two panels half a frame wide.
"""

import json
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.db.engine import reading
from app.db.queries import project_row
from app.jobs import live_segment
from app.jobs.live_segment import Desk
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.pipeline import DISPUTED
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.mosaics.orthomosaic import joined
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace
from tests.app.conftest import FAKE_COMMANDS, Running, fake
from tests.app.nouns import finish
from tests.app.test_live import listening
from tests.app.test_live import until as hear
from tests.core.segment.scenes import DOORS, FRONT_Y, click_on, kitchen, prompt
from tests.waiting import PATIENCE_S, held, until

Lines = list[dict[str, Any]]
DOOR_M, PAIR_M = 0.5, 1.003  # width of one door, and of both with the seam between them


@pytest.fixture(scope="module")
def capture() -> Capture:
    return kitchen()[0]


@pytest.fixture(scope="module")
def doors(capture: Capture) -> list[ObjectPrompt]:
    places = list(DOORS.items())[:2]
    return [prompt(name, "cabinet", click_on(capture, (left + 0.2, FRONT_Y, 0.4), 60)) for name, (left, _) in places]


@pytest.fixture(scope="module")
def session(capture: Capture, doors: list[ObjectPrompt], tmp_path_factory: pytest.TempPathFactory) -> GeometricSession:
    """The two doors are one cell of their run: their seam was not detected."""
    opened = open_session(capture, tmp_path_factory.mktemp("segment"))
    assert isinstance(opened, GeometricSession)
    found = opened.find(doors[0])
    assert isinstance(found, FoundFront)
    run = found.front.run
    hits = [opened.scene.pick(click.frame, click.x, click.y) for door in doors for click in door.points]
    cells = [cell for column, row in run.grid.cells_of(np.array(hits)) if (cell := run.cell_at(column, row)) is not None]
    run.cells = (joined(cells), *(cell for cell in run.cells if cell not in cells))
    run.handles = tuple(None for _ in run.cells)
    opened._found.clear()
    return opened


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> Lines:
    lines: Lines = []
    monkeypatch.setattr(live_segment, "_say", lambda **message: lines.append(json.loads(json.dumps(message))))
    return lines


@pytest.fixture
def desk(session: GeometricSession, capture: Capture, said: Lines) -> Iterator[SimpleNamespace]:
    commands = live_segment.Commands()
    at_work = threading.Thread(target=Desk(session, capture, 240).answer, args=(commands,))
    at_work.start()
    yield SimpleNamespace(put=commands.put)
    commands.put(None)
    at_work.join(PATIENCE_S)


def told(number: int, door: ObjectPrompt, others: Any = None) -> dict[str, Any]:
    """The object as the server describes it; its finished masks, if any, were computed with these clicks on others."""
    points = [{"frame": click.frame, "x": click.x, "y": click.y, "label": click.label} for click in door.points]
    document = {"name": door.name, "category": door.category, "points": points}
    return {"object": number, "key": f"key-{number}", "prompt": document, "others": others}


def segment(line: dict[str, Any], objects: Any) -> dict[str, Any]:
    return {"cmd": "segment", "objects": objects, **{key: line[key] for key in ("object", "key", "prompt")}}


def on(door: ObjectPrompt) -> list[list[float]]:
    return [[click.frame, click.x, click.y] for click in door.points]


def ended(said: Lines, number: int) -> dict[str, Any]:
    """Message at the end of the object's masks, once received."""
    until(lambda: any(line["object"] == number and "end" in line for line in said))
    return [line for line in said if line["object"] == number and "end" in line][-1]


def width_m(end: dict[str, Any]) -> float:
    left, right, *_ = np.array(end["front"]["corners_m"])
    return float(np.linalg.norm(right - left))


def test_a_second_click_on_a_panel_splits_its_front_until_removed(desk: Any, said: Lines, doors: list[ObjectPrompt]) -> None:
    first, second = (told(number, door) for number, door in enumerate(doors, 1))
    desk.put(segment(first, [first]))
    alone = ended(said, 1)
    assert (width_m(alone), alone["others"]) == (pytest.approx(PAIR_M, abs=0.02), [])

    said.clear()
    desk.put(segment(second, [first, second]))
    new = ended(said, 2)
    assert (width_m(new), new["others"]) == (pytest.approx(DOOR_M, abs=0.01), on(doors[0]))
    assert [line for line in said if "again" in line] == [{"object": 1, "key": "key-1", "again": [2]}]
    said.clear()
    desk.put(segment(first, [first, second]))  # as sent by the server on that message
    mended = ended(said, 1)
    assert (width_m(mended), mended["others"]) == (pytest.approx(DOOR_M, abs=0.01), on(doors[1]))
    shown = [line["area"] for line in said if line.get("frame") == 60]
    assert len(shown) == 1  # its first mask is already the half

    said.clear()
    desk.put({"cmd": "objects", "objects": [first]})
    until(lambda: said)
    assert said == [{"object": 1, "key": "key-1", "again": []}]
    said.clear()
    desk.put(segment(first, [first]))
    assert width_m(ended(said, 1)) == pytest.approx(PAIR_M, abs=0.02)
    assert not [line for line in said if "again" in line]


def test_masks_from_before_a_restart_are_recomputed_if_other_clicks_differ(
    desk: Any, said: Lines, doors: list[ObjectPrompt]
) -> None:
    objects = [told(1, doors[0], []), told(2, doors[1], on(doors[0]))]
    desk.put({"cmd": "objects", "objects": objects})
    until(lambda: said)
    assert said == [{"object": 1, "key": "key-1", "again": [2]}]


def test_a_new_request_cancels_masks_that_are_still_streaming(
    desk: Any, said: Lines, doors: list[ObjectPrompt], session: GeometricSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise masks left from the first request would be taken for those of the second."""
    streaming, streamed = threading.Event(), session.stream

    def stream(asked: ObjectPrompt) -> Iterator[Any]:
        for count, glimpse in enumerate(streamed(asked)):
            if asked.name == doors[0].name and count == 1:
                streaming.set()
                assert going.wait(PATIENCE_S)
            yield glimpse

    monkeypatch.setattr(GeometricSession, "stream", lambda self, asked: stream(asked))
    first, second = (told(number, door) for number, door in enumerate(doors, 1))
    with held() as going:
        desk.put(segment(first, [first]))
        assert streaming.wait(PATIENCE_S)
        desk.put(segment(second, [first, second]))
        until(lambda: any(line["object"] == 2 for line in said))
    ended(said, 2)
    desk.put({"cmd": "cancel", "object": 1})  # reported only if there is anything left to cancel
    desk.put(segment(told(3, doors[1]), None))
    ended(said, 3)
    of_first = [line for line in said if line["object"] == 1]
    assert of_first[-1] == {"object": 1, "key": "key-1", "again": [2]}


@pytest.fixture
def panels(start: Callable[..., Any]) -> Callable[..., Any]:
    """Start the app on this test's data folder, with a live segmenter of two panels in every frame."""
    return partial(start, commands=replace(FAKE_COMMANDS, live=fake("panels")))


def clicked(x: float) -> dict[str, Any]:
    return {"category": "cabinet", "points": [{"frame": 3, "x": x, "y": 60.5, "label": 1}]}


def spans(web: Running, project: str, *objects: int) -> list[tuple[int, int] | None]:
    """Column range of each object's mask on frame 3; None until it has all its masks."""
    shown = {mask["object"]: mask["mask"] for mask in web.get(f"/api/projects/{project}/masks/3")}
    lanes = {lane["object"]: lane for lane in web.get(f"/api/projects/{project}/lanes")}
    done = [number if number in shown and lanes[number]["complete"] else None for number in objects]
    return [n and (shown[n]["left"], shown[n]["left"] + shown[n]["box_width"]) for n in done]


def test_masks_of_a_neighbour_are_recomputed_and_every_tab_is_notified(panels: Callable[..., Any]) -> None:
    with panels() as web:
        project = web.sample()
        first = web.post(f"/api/projects/{project}/objects", clicked(20.5), 201)
        number = first["id"]
        web.until(lambda: spans(web, project, number) == [(0, 80)])
        with listening(web, project) as socket:
            second = web.post(f"/api/projects/{project}/objects", clicked(60.5), 201)
            _, heard = hear(socket, type="parted")
            assert (heard["name"], heard["others"]) == (first["name"], [second["name"]])
            seen, _ = hear(socket, type="segment", object=number, state="done")
            masks = [one["mask"] for one in seen if one["type"] == "mask" and one["object"] == number]
            assert {(mask["left"], mask["box_width"]) for mask in masks} == {(0, 40)}
            web.until(lambda: spans(web, project, number, second["id"]) == [(0, 40), (40, 80)])
            web.delete(f"/api/projects/{project}/objects/{second['id']}")
            _, heard = hear(socket, type="parted")
            assert (heard["name"], heard["others"]) == (first["name"], [])
            web.until(lambda: spans(web, project, number) == [(0, 80)])
            web.post(f"/api/projects/{project}/undo", {"object": second["id"]})
            web.until(lambda: spans(web, project, number, second["id"]) == [(0, 40), (40, 80)])
            web.patch(f"/api/projects/{project}/objects/{number}", {"category": "bottle"})
            web.patch(f"/api/projects/{project}/objects/{number}", {"category": "cabinet"})
            web.until(lambda: spans(web, project, number, second["id"]) == [(0, 40), (40, 80)])


@pytest.mark.parametrize(
    "change", ["delete", "undo", *(pytest.param(other, marks=pytest.mark.slow) for other in ("move", "remove", "thing"))]
)
def test_a_split_front_is_restored_also_after_a_server_restart(panels: Callable[..., Any], change: str) -> None:
    with panels() as web:
        project = web.sample()
        first, second = (web.post(f"/api/projects/{project}/objects", clicked(x), 201) for x in (20.5, 60.5))
        web.until(lambda: spans(web, project, first["id"], second["id"]) == [(0, 40), (40, 80)])
    with panels() as web:
        assert web.get(f"/api/projects/{project}/live")["state"] == "off"
        address = f"/api/projects/{project}/objects/{second['id']}"
        if change == "delete":
            web.delete(address)
        elif change == "undo":
            web.post(f"/api/projects/{project}/undo", {"object": second["id"]})
        elif change == "move":
            web.patch(f"{address}/points/{second['points'][0]['id']}", {"x": 100.5})
        elif change == "thing":
            web.patch(address, {"name": "towel", "category": "towel"})  # it hangs on the front
        else:
            web.delete(f"{address}/points/{second['points'][0]['id']}")
        web.until(lambda: spans(web, project, first["id"]) == [(0, 80)])


def test_opening_the_page_recomputes_masks_that_a_later_click_splits(panels: Callable[..., Any]) -> None:
    with panels() as web:
        project = web.sample()
        first = web.post(f"/api/projects/{project}/objects", clicked(20.5), 201)
        web.until(lambda: spans(web, project, first["id"]) == [(0, 80)])
    with panels() as web:
        web.post(f"/api/projects/{project}/objects?infer=false", clicked(60.5), 201)
        assert web.get(f"/api/projects/{project}/live")["state"] == "off"
        web.post(f"/api/projects/{project}/live/open")
        web.until(lambda: spans(web, project, first["id"]) == [(0, 40)])


def test_objects_of_a_prompts_file_split_a_shared_panel(panels: Callable[..., Any]) -> None:
    with panels() as web:
        project = web.sample()
        objects = [{**clicked(x), "name": f"door_{x:.0f}"} for x in (20.5, 60.5)]
        numbers = [
            one["id"] for one in web.post(f"/api/projects/{project}/prompts.json", {"version": 1, "objects": objects}, 200)
        ]
        for number in numbers:
            web.post(f"/api/projects/{project}/objects/{number}/segment", status=202)
        web.until(lambda: spans(web, project, *numbers) == [(0, 40), (40, 80)])


@pytest.mark.parametrize(("parted_at", "source"), [(None, "run"), (130.5, "live")])
def test_masks_of_a_run_split_at_a_removed_click_are_recomputed(
    panels: Callable[..., Any], parted_at: float | None, source: str
) -> None:
    with panels() as web:
        project = web.sample()
        drawer, mug = web.get(f"/api/projects/{project}/objects")
        web.delete(f"/api/projects/{project}/objects/{mug['id']}")
        with reading(web.context.engine) as session:
            files = web.context.files(project_row(session, project))
        finish(files.work, drawer["name"])
        gone = () if parted_at is None else (PromptPoint(frame=3, x=parted_at, y=60.5, label=1),)
        Workspace(files.work).save("segment", DISPUTED, {drawer["name"]: gone}, {"key": "k", "seconds": 1.0})
        files.finished_prompts.write_text(json.dumps(web.get(f"/api/projects/{project}/prompts.json")))
        assert lane_of(web, project, drawer["id"])["source"] == "run"
        web.post(f"/api/projects/{project}/live/open")
        other = web.post(f"/api/projects/{project}/objects", clicked(20.5), 201)["id"]
        web.until(lambda: lane_of(web, project, other)["complete"] and lane_of(web, project, drawer["id"])["complete"])
        assert lane_of(web, project, drawer["id"])["source"] == source


def lane_of(web: Running, project: str, number: int) -> dict[str, Any]:
    (lane,) = [lane for lane in web.get(f"/api/projects/{project}/lanes") if lane["object"] == number]
    return dict(lane)
