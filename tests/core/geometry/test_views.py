from r2c2r_core.geometry.views import MaskView, choose_views


def view(
    frame_index: int, *, area: int = 1000, left: int = 300, top: int = 200, size: int = 40, sharpness: float = 10.0
) -> MaskView:
    return MaskView(
        frame_index=frame_index,
        area_px=area,
        left=left,
        top=top,
        box_width=size,
        box_height=size,
        width=640,
        height=480,
        sharpness=sharpness,
    )


def test_each_interval_gives_its_best_frame_in_order() -> None:
    views = [view(i, area=2000 if i % 10 == 3 else 1000) for i in reversed(range(100))]
    assert choose_views(views, 10) == [10 * k + 3 for k in range(10)]


def test_whole_sharp_and_central_views_win() -> None:
    cropped, blurred, aside, good = view(0, left=0), view(1, sharpness=0.1), view(2, left=580), view(3)
    assert choose_views([cropped, blurred, aside, good], 1) == [3]


def test_cropped_views_stand_in_only_where_there_is_nothing_better() -> None:
    assert choose_views([view(0, left=0), view(5), view(9, left=0)], 3) == [5]
    assert choose_views([view(0, left=0), view(9, left=0)], 3) == [0, 9]


def test_frames_without_the_object_do_not_count() -> None:
    assert choose_views([view(0, area=0)], 5) == []
