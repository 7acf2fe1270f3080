"""Multi-frame filter of flying pixels, on an exact room; real surfaces are kept."""

import numpy as np
import pytest

from r2c2r_core.ingest.flying import drop_flying, flying_in_others, judges_of, read_depths
from r2c2r_core.ingest.store import StoredImages, write_depth
from r2c2r_core.model.capture import Frame

from .tiny import TinyRoom

ROOM = TinyRoom(count=12, depth_size=(96, 128), rgb_size=(96, 128))
HALO = (slice(40, 80), slice(47, 50))  # pixels that float a hand's breadth before the surface in one frame only


@pytest.fixture
def stored(tmp_path) -> tuple[list[Frame], StoredImages]:
    (tmp_path / "depth").mkdir()
    frames = []
    for k, pose in enumerate(ROOM.poses()):
        depth = ROOM.depth(pose, ROOM.depth_camera)
        depth[depth > 6] = 0
        if k == 5:
            depth[HALO] -= 0.25
        write_depth(tmp_path, k, depth)
        camera = ROOM.depth_camera
        frames.append(
            Frame(index=k, timestamp_s=None, rgb_camera=ROOM.camera, depth_camera=camera, world_from_camera=pose, sharpness=1.0)
        )
    return frames, StoredImages(tmp_path)


def flying(frames, images, position: int) -> np.ndarray:
    judges = [(frames[k], read_depths(frames[k], images)) for k in judges_of(frames, position)]
    return flying_in_others(frames[position], read_depths(frames[position], images), judges)


def test_flying_pixels_observed_by_one_frame_only_are_detected(stored):
    found = flying(*stored, 5)
    assert found[HALO].mean() > 0.95
    assert found.sum() == found[HALO].sum()


def test_box_edges_observed_by_all_frames_are_kept(stored):
    frames, images = stored
    for position in (0, 3, 8, 11):
        assert flying(frames, images, position).sum() <= 3


def test_only_flying_pixels_are_cleared_in_stored_depth(stored):
    frames, images = stored
    before = images.depth(5).metres.copy()
    count = drop_flying(frames, images, images.store)
    after = StoredImages(images.store).depth(5).metres
    assert count >= 110
    assert (after[HALO] == 0).mean() > 0.95
    kept = after > 0
    assert np.array_equal(after[kept], before[kept])


def test_without_other_viewpoints_no_pixels_are_removed(stored):
    frames, images = stored
    assert judges_of(frames[:1], 0) == []
    assert not flying_in_others(frames[5], read_depths(frames[5], images), []).any()
