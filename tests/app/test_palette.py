"""Colours of objects."""

import cv2
import numpy as np
import pytest

from app.services.system import PALETTE

OPACITY = 0.42  # of masks at first


@pytest.mark.parametrize("ground", [(0.72, 0.56, 0.38), (0.9, 0.9, 0.9), (0.25, 0.25, 0.27)], ids=["oak", "white", "dark"])
def test_objects_clicked_in_turn_have_distinct_colours_under_their_masks(ground: tuple[float, float, float]) -> None:
    colours = np.array([[int(name[k : k + 2], 16) / 255 for k in (1, 3, 5)] for name in PALETTE], np.float32)
    shown = OPACITY * colours + (1 - OPACITY) * np.array(ground, np.float32)
    lab = cv2.cvtColor(shown[None].astype(np.float32), cv2.COLOR_RGB2LAB)[0]
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2)
    near = [apart[k, k + step] for step in (1, 2, 3) for k in range(len(PALETTE) - step)]
    assert min(near) > 25  # CIE76: 2 is just noticeable; it was 10
