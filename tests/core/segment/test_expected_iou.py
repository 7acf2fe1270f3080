import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.expected_iou import expected_iou
from r2c2r_core.tuning import changed, tuning

CAMERA = Intrinsics(fx=500.0, fy=500.0, cx=320.0, cy=240.0, width=640, height=480)
FRAME = Frame(index=0, timestamp_s=None, rgb_camera=CAMERA, depth_camera=CAMERA, world_from_camera=Rigid3(), sharpness=1.0)
AT_2_M = np.array([[0.0, 0.0, 2.0]])


def box(left: int, top: int, right: int, bottom: int) -> np.ndarray:
    mask = np.zeros((480, 640), bool)
    mask[top:bottom, left:right] = True
    return mask


@pytest.mark.parametrize("side", [20, 60, 200])
def test_expected_iou_equals_the_iou_with_a_uniformly_grown_box(side: int) -> None:
    truth, grown = box(200, 200, 200 + side, 200 + side), box(198, 198, 202 + side, 202 + side)
    with tuning(changed({"segment.expected_iou": {"slope": 1.0, "offset": 0.0}})):  # without the calibration map
        expected = expected_iou(truth, 1.0, FRAME, AT_2_M, border_m=0.008)  # 2 px
    assert expected == pytest.approx(mask_iou(truth, grown), abs=0.035)


def test_image_borders_raise_and_occlusion_lowers_expected_iou() -> None:
    inside, cut_off = box(200, 200, 260, 260), box(0, 200, 60, 260)
    assert expected_iou(cut_off, 1.0, FRAME, AT_2_M, 0.008) > expected_iou(inside, 1.0, FRAME, AT_2_M, 0.008)
    assert expected_iou(inside, 0.3, FRAME, AT_2_M, 0.008) < 0.95 * expected_iou(inside, 1.0, FRAME, AT_2_M, 0.008)
    assert expected_iou(box(0, 0, 640, 480), 1.0, FRAME, AT_2_M, 0.008) == 1.0
    assert expected_iou(np.zeros((480, 640), bool), 1.0, FRAME, AT_2_M, 0.008) == 0.0


def test_a_size_atypical_of_the_category_lowers_expected_iou() -> None:
    fits, does_not = (expected_iou(box(200, 200, 260, 260), 1.0, FRAME, AT_2_M, 0.008, fit) for fit in (1.0, 0.0))
    assert does_not < 0.5 < 0.8 < fits
