from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.segment.stage import open_session
from tests.core.segment.scenes import DOORS, FRONT_Y, click_on, kitchen, prompt

OUT_M = 0.25


def test_a_drawer_open_in_the_last_frames_is_told_from_the_closed_one(tmp_path: Path) -> None:
    capture, truth = kitchen(OUT_M, from_step=10)
    drawer = prompt("drawer_mid", "drawer", click_on(capture, (1.5, FRONT_Y, 0.5), 60))
    track = open_session(capture, tmp_path).track(drawer)
    shown = [f for f, mask in truth["drawer_mid"].items() if mask.sum() > 3000]
    assert {f for f in shown if f in track.opened_m} == {f for f in shown if f >= 100}
    assert list(track.opened_m.values()) == pytest.approx([OUT_M] * len(track.opened_m), abs=0.012)  # 1 cm of depth noise
    overlap = {f: mask_iou(unpack_mask(track.masks[f]), truth["drawer_mid"][f]) for f in shown}
    assert np.mean([overlap[f] for f in shown if f < 100]) > 0.93
    assert np.mean([overlap[f] for f in shown if f >= 100]) > 0.93
    assert track.front is not None
    assert (track.front.width_m, track.front.height_m) == pytest.approx((0.45, 0.297), abs=0.015)


def test_a_door_open_in_the_last_frames_tells_its_hinge_and_its_angle(tmp_path: Path) -> None:
    capture, truth = kitchen(from_step=8, swung_rad=np.deg2rad(60.0))
    x, width = DOORS["door_c"]
    door = prompt("door_c", "cabinet", click_on(capture, (x + width / 2, FRONT_Y, 0.5), 60))
    track = open_session(capture, tmp_path).track(door)
    assert len(track.swung) >= 3
    assert all(frame >= 80 for frame in track.swung)  # before, it is closed
    assert {swing.hinge for swing in track.swung.values()} == {"left"}
    angles = np.rad2deg([swing.angle_rad for swing in track.swung.values()])
    assert np.median(angles) == pytest.approx(60.0, abs=2.0)  # 2 mm of depth noise, a leaf of 40 cm seen ever more flatly
    overlap = [mask_iou(unpack_mask(track.masks[f]), truth["door_c"][f]) for f in (80, 90)]
    assert np.mean(overlap) > 0.7  # its back and edges are the door's too; left where it was closed: less than half
