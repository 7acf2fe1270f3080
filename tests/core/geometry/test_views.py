import numpy as np
import pytest

from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.geometry.views import MaskView, choose_views, is_cropped, stands_open, view_scores


def view(
    frame_index: int,
    *,
    azimuth_deg: float = 0.0,
    area: int = 1000,
    left: int = 300,
    top: int = 220,
    size: int = 40,
    sharpness: float = 10.0,
    confidence: float = 1.0,
) -> MaskView:
    mask = PackedMask(height=480, width=640, left=left, top=top, box_width=size, box_height=size, bits=b"", area_px=area)
    turn = np.radians(azimuth_deg)
    return MaskView(
        frame_index=frame_index,
        mask=mask,
        sharpness=sharpness,
        confidence=confidence,
        from_object=2.0 * np.array([np.cos(turn), np.sin(turn), 0.0]),
    )


def chosen(views: list[MaskView], count: int) -> list[int]:
    return [found.frame_index for found in choose_views(views, count)]


def test_the_best_frame_of_each_interval_is_chosen() -> None:
    views = [view(k, azimuth_deg=0.5 * k, area=2000 if k % 5 == 3 else 1000) for k in reversed(range(100))]
    assert sorted(chosen(views, 10)) == sorted(set(chosen(views, 10)) & {5 * k + 3 for k in range(20)})
    assert len(chosen(views, 10)) == 10


@pytest.mark.parametrize(
    "worse",
    [{"left": 0}, {"sharpness": 0.1}, {"left": 560}, {"area": 300}, {"confidence": 0.2}],
    ids=["cropped", "blurred", "aside", "small", "unsure"],
)
def test_large_uncropped_sharp_central_and_confident_views_win(worse: dict[str, float]) -> None:
    assert chosen([view(0, **worse), view(1)], 1) == [1]  # type: ignore[arg-type]
    scores = view_scores([view(0, **worse), view(1)])  # type: ignore[arg-type]
    assert scores[0] < scores[1] <= 1


def test_views_are_spread_over_angles_despite_a_lingering_camera() -> None:
    """Fifty frames from one place and ten on the way to another: equal time intervals would favour the first place."""
    views = [view(k) for k in range(50)] + [view(50 + k, azimuth_deg=9 * k) for k in range(10)]
    frames = chosen(views, 4)
    azimuths = sorted(9 * (k - 50) if k >= 50 else 0 for k in frames)
    assert azimuths[0] < 10
    assert azimuths[-1] > 60
    assert min(np.diff(azimuths)) >= 9  # one viewpoint is used once


def test_the_first_chosen_view_is_the_best() -> None:
    views = [view(k, azimuth_deg=3 * k, area=1000 + 10 * (k == 17)) for k in range(30)]
    assert chosen(views, 5)[0] == 17


def test_the_choice_does_not_depend_on_view_order() -> None:
    views = [view(k, azimuth_deg=7 * k % 90, area=1000 + 37 * k % 11, sharpness=float(k % 13)) for k in range(60)]
    assert chosen(views, 8) == chosen(views[::-1], 8)


def test_only_available_views_that_show_the_object_are_chosen() -> None:
    assert sorted(chosen([view(0), view(5)], 20)) == [0, 5]
    assert chosen([view(0, area=0)], 5) == []


def test_masks_touching_the_image_border_are_cropped() -> None:
    assert not is_cropped(view(0).mask)
    assert is_cropped(view(0, left=1).mask)
    assert is_cropped(view(0, left=600).mask)
    assert is_cropped(view(0, top=440).mask)


def test_open_drawers_and_doors_are_detected_but_not_handles_and_sides() -> None:
    rng = np.random.default_rng(0)
    front = rng.normal(0, 0.01, 900)
    assert not stands_open(np.concatenate([front, rng.normal(0.045, 0.005, 100)]))  # its handle
    assert not stands_open(np.concatenate([front, rng.uniform(-0.6, 0, 2000)]))  # its side, behind the front
    assert stands_open(np.concatenate([front[:300], rng.uniform(0.05, 0.3, 200)]))  # a door swung open
    assert stands_open(front + 0.3)  # a drawer pulled out
    assert not stands_open(np.zeros(0))
