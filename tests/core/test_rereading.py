"""Re-reading of a recording: the stored capture is complete, and poses are never mixed with another reading's pixels."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.config import ReconstructConfig
from r2c2r_core.ingest import stage as stage_module
from r2c2r_core.ingest.stage import IngestConfig
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import Overrides, Prompts
from r2c2r_core.overrides import NO_OVERRIDES
from r2c2r_core.pipeline import Request, doubts_about, reconstruct
from r2c2r_core.workspace import Workspace
from tests.core.ingest.tiny import TinyRoom, write_r3d

ROOM = TinyRoom()
FAR = IngestConfig(finest_voxel_m=0.05, coarsest_voxel_m=0.05)
NEAR = replace(FAR, far_m=2.2)


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    return write_r3d(tmp_path / "scan.r3d", ROOM)


def read(scan: Path, work: Workspace, config: IngestConfig, said: Overrides = NO_OVERRIDES) -> tuple[Capture, tuple[str, ...]]:
    request = Request(source=scan, prompts=Prompts(objects=()), overrides=said, config=ReconstructConfig(ingest=config))
    computed = reconstruct(request, work, until="ingest").computed
    capture = work.load_latest("ingest", "scene")
    assert capture is not None
    return capture, computed


def deepest(capture: Capture) -> float:
    return max(float(capture.images.depth(frame.index).metres.max()) for frame in capture.frames)


def test_a_missing_stored_frame_is_restored(scan: Path, tmp_path: Path) -> None:
    read(scan, Workspace(tmp_path / "work"), FAR)
    assert read(scan, Workspace(tmp_path / "work"), FAR)[1] == ()
    missing = Workspace(tmp_path / "work").frames / "rgb" / "000003.jpg"
    missing.unlink()
    capture, computed = read(scan, Workspace(tmp_path / "work"), FAR)
    assert computed
    assert missing.is_file()
    assert capture.images.rgb(3).any()


def test_an_interrupted_reading_does_not_leave_its_pixels_to_later_ones(
    scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = deepest(read(scan, Workspace(tmp_path / "work"), FAR)[0])
    assert before > 2.3
    with monkeypatch.context() as killed:
        killed.setattr(Workspace, "save", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            read(scan, Workspace(tmp_path / "work"), NEAR)
    assert deepest(read(scan, Workspace(tmp_path / "work"), FAR)[0]) == before  # the setting is reverted


def test_only_the_frames_of_the_latest_reading_are_kept(scan: Path, tmp_path: Path) -> None:
    work = Workspace(tmp_path / "work")
    for config in (FAR, NEAR):
        capture, _ = read(scan, work, config)
    assert np.isclose(deepest(capture), 2.2, atol=0.1)
    assert [path.name for path in (work.root / "capture").iterdir()] == [work.frames.name]


def test_room_overrides_are_applied_without_decoding_the_recording(
    scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Workspace(tmp_path / "work")
    before, _ = read(scan, work, FAR)
    stamp = work.frames.stat().st_ino
    monkeypatch.setattr(stage_module, "open_recording", None)  # a call would be an error
    said = Overrides(objects={}, floor_m=0.3, manhattan_yaw_rad=0.2, walls=(np.array([0.0, -1.0, -2.0]),))
    after, computed = read(scan, Workspace(tmp_path / "work"), FAR, said)
    assert computed == ("ingest/scene",)
    assert work.frames.stat().st_ino == stamp
    assert (after.room.floor_source, after.room.yaw_source, after.room.walls_source) == ("person",) * 3
    moved = after.world_from_capture @ before.world_from_capture.inverse
    np.testing.assert_allclose(after.surface.vertices_world, moved.apply(before.surface.vertices_world), atol=1e-9)
    for new, old in zip(after.frames, before.frames, strict=True):
        np.testing.assert_allclose(new.world_from_camera.matrix, (moved @ old.world_from_camera).matrix, atol=1e-9)


def test_the_doctor_uses_the_ingest_settings_of_the_run(scan: Path, tmp_path: Path) -> None:
    config = replace(FAR, params={"cloud": {"most_blocks": 40_000}, "doctor.verdict": {"frames": (1000, 2000)}})
    work = Workspace(tmp_path / "work")
    request = Request(source=scan, prompts=Prompts(objects=()), config=ReconstructConfig(ingest=config))
    doubts = doubts_about(request, work)
    assert any(f"only {len(ROOM.poses())} frames" in reason for reason in doubts.reasons)
    again = Workspace(tmp_path / "work")
    assert read(scan, again, config)[1] == ()
