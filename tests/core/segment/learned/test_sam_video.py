"""Adapter of video models, run with the real classes of transformers and random weights: tests its calls, not mask quality."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import BackendUnavailable
from r2c2r_core.segment.learned.sam_video import EDGETAM, SAM2, SAM3, Click, Family, Seen, VideoModel, load_model

torch = pytest.importorskip("torch", reason="no torch: pip install --group learned")
from tests.core.segment.learned.tiny_models import sam2_config, tiny  # noqa: E402

pytestmark = pytest.mark.slow  # torch is large: `make test` does not install it

FAMILIES = pytest.mark.parametrize("family", [SAM2, EDGETAM, SAM3], ids=["sam2", "edgetam", "sam3"])
WIDTH, HEIGHT = 80, 60


def image(position: int) -> np.ndarray:
    return np.random.default_rng(position).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def followed(model: VideoModel, count: int, clicks: dict[int, list[Click]]) -> list[Seen]:
    return list(model.follow(image, count, clicks))


def same(a: list[Seen], b: list[Seen]) -> bool:
    return all(
        x.position == y.position and (x.mask == y.mask).all() and x.confidence == y.confidence
        for x, y in zip(a, b, strict=True)
    )


@FAMILIES
def test_an_object_is_tracked_in_both_directions_from_its_click(family: Family) -> None:
    found = followed(tiny(family), 6, {2: [Click(0.5, 0.5, 1), Click(0.1, 0.1, 0)]})
    assert [seen.position for seen in found] == [2, 3, 1, 4, 0, 5]
    assert {seen.mask.shape for seen in found} == {(HEIGHT, WIDTH)}
    assert {seen.mask.dtype for seen in found} == {np.dtype(bool)}
    assert all(0 <= seen.confidence <= 1 for seen in found)


def test_clicked_frames_are_returned_first_starting_with_the_last() -> None:
    clicks = {1: [Click(0.5, 0.5, 1)], 4: [Click(0.9, 0.9, 0)]}
    assert [seen.position for seen in followed(tiny(SAM2), 7, clicks)] == [4, 1, 5, 3, 6, 2, 0]


@FAMILIES
def test_frames_after_the_click_match_the_reference_propagation_loop(family: Family) -> None:
    """`propagate_in_video_iterator` keeps the whole video in memory; dropping old frames must not change the masks."""
    model, count = tiny(family), 24  # more than the 16 frames of pointers and 7 of memories that it attends to
    session = model.session()
    session.processed_frames = {k: model.pixels(image(k)) for k in range(count)}
    side = model.size
    points = {
        "point_coords": torch.tensor([[[[0.5 * side - 0.5, 0.25 * side - 0.5]]]]),
        "point_labels": torch.ones((1, 1, 1), dtype=torch.int32),
    }
    session.add_point_inputs(session.obj_id_to_idx(1), 0, points)
    session.obj_with_new_inputs.append(1)
    own = [out.pred_masks.numpy() for out in model.model.propagate_in_video_iterator(session, start_frame_idx=0)]
    ours = logits(model, {0: [Click(0.5, 0.25, 1)]}, count=count)
    for position in (0, 1, 7, 20, count - 1):
        np.testing.assert_allclose(ours[position], own[position], atol=1e-5)


@FAMILIES
def test_half_precision_gives_finite_confidences(family: Family) -> None:
    found = followed(tiny(family, torch.bfloat16), 3, {1: [Click(0.5, 0.5, 1)]})
    assert all(np.isfinite(seen.confidence) for seen in found)


@FAMILIES
def test_memory_stays_flat_over_sixty_frames(family: Family, monkeypatch: pytest.MonkeyPatch) -> None:
    model = tiny(family)
    sessions: list[Any] = []
    make = VideoModel.session
    monkeypatch.setattr(VideoModel, "session", lambda self: sessions.append(make(self)) or sessions[-1])
    held = []
    for seen in model.follow(image, 64, {30: [Click(0.5, 0.5, 1)], 50: [Click(0.2, 0.5, 0)]}):
        held.append(bytes_in(sessions[0]))
        assert seen.mask.shape == (HEIGHT, WIDTH)
    assert len(sessions) == 1
    assert len(held) == 64
    one_frame = held[3] - held[2]
    assert held[-1] <= max(held[:40]) + one_frame  # both directions hold 16 frames by then, one possibly clicked
    assert not sessions[0].processed_frames


def test_earlier_tracking_does_not_change_later_masks() -> None:
    clicks = {2: [Click(0.5, 0.5, 1)]}
    fresh = followed(tiny(SAM2), 5, clicks)
    model = tiny(SAM2)
    followed(model, 5, {2: [Click(0.9, 0.1, 1)], 4: [Click(0.1, 0.9, 1)]})
    assert same(followed(model, 5, clicks), fresh)


def test_two_objects_tracked_in_alternation_keep_their_masks() -> None:
    model = tiny(SAM2)
    a, b = {2: [Click(0.5, 0.5, 1)]}, {1: [Click(0.9, 0.1, 1)]}
    alone = followed(model, 5, a), followed(model, 5, b)
    turns: list[tuple[Seen, Seen]] = list(zip(model.follow(image, 5, a), model.follow(image, 5, b), strict=True))
    assert same([x for x, _ in turns], alone[0])
    assert same([y for _, y in turns], alone[1])


def test_positive_and_negative_second_clicks_change_the_logits() -> None:
    model = tiny(SAM2)
    one = logits(model, {0: [Click(0.5, 0.5, 1)]}, 1)[0]
    assert not np.array_equal(one, logits(model, {0: [Click(0.5, 0.5, 1), Click(0.9, 0.9, 1)]}, 1)[0])
    assert not np.array_equal(one, logits(model, {0: [Click(0.5, 0.5, 1), Click(0.9, 0.9, 0)]}, 1)[0])


def test_a_click_in_another_frame_uses_the_memory_of_the_first() -> None:
    model = tiny(SAM2)
    off = {3: [Click(0.9, 0.9, 0)]}
    with_memory = logits(model, {0: [Click(0.5, 0.5, 1)], **off})
    other_memory = logits(model, {0: [Click(0.1, 0.1, 1), Click(0.2, 0.2, 1)], **off})
    assert not np.array_equal(with_memory[3], other_memory[3])


def test_a_refinement_changes_frames_before_and_after_it() -> None:
    model = tiny(SAM2)
    plain, refined = {2: [Click(0.5, 0.5, 1)]}, {2: [Click(0.5, 0.5, 1)], 4: [Click(0.9, 0.9, 0)]}
    before, after = logits(model, plain), logits(model, refined)
    for position in (0, 3, 4, 6):
        assert not np.array_equal(before[position], after[position]), position


def test_a_second_click_on_a_frame_does_not_encode_it_again(monkeypatch: pytest.MonkeyPatch) -> None:
    model = tiny(SAM2)
    runs: list[int] = []
    encode = model.model.get_image_features
    monkeypatch.setattr(model.model, "get_image_features", lambda *a, **k: runs.append(1) or encode(*a, **k))
    first = next(model.follow(image, 3, {1: [Click(0.5, 0.5, 1)]}))
    again = next(model.follow(image, 3, {1: [Click(0.5, 0.5, 1)]}))
    next(model.follow(image, 3, {1: [Click(0.5, 0.5, 1), Click(0.2, 0.2, 0)]}))
    assert len(runs) == 1
    assert same([first], [again])


def test_a_model_loads_from_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("r2c2r_core.segment.learned.sam_video.best_device", lambda: ("cpu", torch.float32))
    model = tiny(SAM2)
    model.model.save_pretrained(tmp_path)
    clicks = {0: [Click(0.5, 0.5, 1)]}
    assert same(followed(load_model(tmp_path, SAM2), 2, clicks), followed(model, 2, clicks))


def test_a_folder_without_the_weights_is_rejected_with_a_one_line_message(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(BackendUnavailable, match="not the weights of a Sam2VideoModel") as refused:
        load_model(tmp_path, SAM2)
    assert "\n" not in str(refused.value)


def test_images_are_resized_and_normalised_like_the_transformers_processor() -> None:
    model = tiny(SAM2)
    flat = np.full((HEIGHT, WIDTH, 3), (255, 0, 128), np.uint8)
    pixels = model.pixels(flat)
    assert pixels.shape == (3, 64, 64)
    expected = (np.array([255, 0, 128]) / 255 - [0.485, 0.456, 0.406]) / [0.229, 0.224, 0.225]
    np.testing.assert_allclose(pixels[:, 5, 5].numpy(), expected, atol=1e-5)
    assert sam2_config().image_size == model.size


def logits(model: VideoModel, clicks: dict[int, list[Click]], count: int = 7) -> dict[int, np.ndarray]:
    """The model's raw answers by frame: random weights rarely cross zero, so masks alone say little."""
    answers: dict[int, np.ndarray] = {}
    ask = type(model.model).forward

    def noted(self: Any, *args: Any, **options: Any) -> Any:
        output = ask(self, *args, **options)
        answers[options["frame_idx"]] = output.pred_masks.float().numpy().copy()
        return output

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(type(model.model), "forward", noted)
        followed(model, count, clicks)
    return answers


def bytes_in(session: Any) -> int:
    """Bytes of all tensors that a session holds."""
    return sum(t.element_size() * t.nelement() for t in tensors(vars(session), set()))


def tensors(value: Any, known: set[int]) -> Iterator[Any]:
    if id(value) in known:
        return
    known.add(id(value))
    if isinstance(value, torch.Tensor):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from tensors(item, known)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from tensors(item, known)
    elif hasattr(value, "__dict__") and type(value).__module__.startswith("transformers"):
        yield from tensors(vars(value), known)
