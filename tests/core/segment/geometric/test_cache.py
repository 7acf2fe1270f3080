import dataclasses
import fcntl
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import Cancelled
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Capture
from r2c2r_core.progress import Progress
from r2c2r_core.segment.geometric import session as geometric
from r2c2r_core.segment.geometric.cache import kept
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.stage import open_session
from r2c2r_core.segment.surface import draw, drawn_size, parts_of
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import FRONT_Y, click_on, prompt
from tests.waiting import until


def test_runs_are_restored_unchanged_from_disk(session: GeometricSession, tmp_path: Path) -> None:
    run = session.run_of(session.planes[0])
    kept(tmp_path / "run.noun", lambda: run)
    back = kept(tmp_path / "run.noun", lambda: None)
    assert _same(run, back)


def test_a_damaged_cache_file_is_recomputed(tmp_path: Path) -> None:
    path = tmp_path / "value.noun"
    kept(path, lambda: (1, 2))
    path.write_bytes(path.read_bytes()[:40])
    assert kept(path, lambda: (3, 4)) == (3, 4)
    assert kept(path, lambda: (5, 6)) == (3, 4)


def test_a_value_is_returned_where_its_folder_was_deleted_meanwhile(tmp_path: Path) -> None:
    folder = tmp_path / "geometric-other"

    def compute() -> tuple[int, int]:
        shutil.rmtree(folder)
        return 1, 2

    assert kept(folder / "value.noun", compute) == (1, 2)
    assert kept(folder / "value.noun", lambda: (3, 4)) == (3, 4)


def test_concurrent_requests_compute_a_value_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    computed: list[int] = []
    locking: list[int] = []
    lock = fcntl.flock

    def noted(file: Any, how: int) -> None:
        locking.append(1)
        lock(file, how)

    def compute() -> tuple[int, int]:
        computed.append(1)
        until(lambda: len(locking) == 2)  # the other one waits
        return 1, 2

    monkeypatch.setattr(fcntl, "flock", noted)
    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(lambda _: kept(tmp_path / "value.noun", compute), range(2))) == [(1, 2)] * 2
    assert computed == [1]


def test_a_run_is_computed_on_the_first_click(boxes: tuple[Capture, Truth], tmp_path: Path) -> None:
    session = open_session(boxes[0], tmp_path)
    assert not list(tmp_path.glob("*/run*.noun"))
    session.track(prompt("a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60)))
    assert len(list(tmp_path.glob("*/run*.noun"))) == 1


def test_a_prepared_session_computes_no_run_later(session: GeometricSession, monkeypatch: pytest.MonkeyPatch) -> None:
    session.prepare()
    monkeypatch.setattr(geometric, "make_run", lambda *_: pytest.fail("cut at a click"))
    for region in session.planes:
        session.run_of(region)


def test_the_cache_key_changes_with_the_source_code(
    boxes: tuple[Capture, Truth], session: GeometricSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = geometric._cache_key(boxes[0], session.config)
    monkeypatch.setattr(geometric, "source_key", lambda *rooms: "other code")
    assert geometric._cache_key(boxes[0], session.config) != before


def test_preparation_reports_progress_and_can_be_cancelled(boxes: tuple[Capture, Truth], tmp_path: Path) -> None:
    seen: list[float] = []
    stop = Progress(lambda _, fraction, text: seen.append(fraction), lambda: len(seen) > 5)
    with pytest.raises(Cancelled):
        open_session(boxes[0], tmp_path, progress=stop)
    assert seen == sorted(seen)
    assert seen[-1] < 0.9


def test_rendering_only_visible_parts_changes_no_pixel(boxes: tuple[Capture, Truth]) -> None:
    capture = boxes[0]
    surface, parts = capture.surface, parts_of(capture.surface)
    for frame in capture.frames[::6]:
        camera = frame.rgb_camera.resized(*drawn_size(frame.rgb_camera))
        colours = np.zeros((len(surface.vertices_world), 3), np.float32)
        whole = rasterize(surface.vertices_world, surface.faces, colours, camera, frame.world_from_camera.inverse)
        assert np.array_equal(draw(parts, frame), (whole.depth_m * 1000 + 0.5).astype(np.uint16))


def test_faces_near_returns_every_face_within_reach(boxes: tuple[Capture, Truth]) -> None:
    surface = boxes[0].surface
    point, reach = np.array([1.0, -0.3, 1.0]), 0.4
    away = np.linalg.norm(surface.vertices_world[surface.faces] - point, axis=2).min(axis=1)
    assert set(np.flatnonzero(away < reach)) <= set(parts_of(surface).faces_near(point, reach).tolist())


def test_the_glimpse_of_a_front_equals_its_first_streamed_mask(boxes: tuple[Capture, Truth], session: GeometricSession) -> None:
    door = prompt("a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60), click_on(boxes[0], (0.3, FRONT_Y, 0.5), 40))
    assert session.glimpse(door) == next(session.stream(door))


def test_the_glimpse_of_a_small_thing_agrees_with_its_mask(
    boxes: tuple[Capture, Truth], session: GeometricSession, cache: Path
) -> None:
    carton = prompt("c", "box", click_on(boxes[0], (1.06, -0.36, 1.0), 70))
    fresh = open_session(boxes[0], cache)
    glimpsed = fresh.glimpse(carton)
    assert glimpsed is not None
    frame, first, _ = glimpsed
    assert frame == 70
    assert mask_iou(unpack_mask(first), session.mask_at(carton, 70)) > 0.8
    assert mask_iou(unpack_mask(first), boxes[1]["carton"][70]) > 0.7


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and np.array_equal(a, b)
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(
            _same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a) if f.init
        )
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(_same, a, b))
    return a == b
