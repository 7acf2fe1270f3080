"""Every rule finds its contradiction, and a correct kitchen has none."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.contradiction import Contradiction
from r2c2r_core.model.inputs import FrameSaid, ObjectPrompt, PromptPoint
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.segment import contradictions
from r2c2r_core.segment.certainty import front_certainty
from r2c2r_core.segment.contradictions import find_contradictions
from tests.core.motions import motion

WALL = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=0.0, area_m2=4.0)  # the room lies at y < 0
FRAMES = range(0, 40, 2)


def track(
    name: str, category: str, columns: slice, *, width_m: float = 0.5, height_m: float = 0.7, y: float = -0.58
) -> MaskTrack:
    """A front whose mask is these columns of every frame."""
    mask = np.zeros((120, 160), bool)
    mask[20:100, columns] = True
    pose = Rigid3(np.eye(3), np.array([0.0, y, 0.45]))
    front = FrontPanel(world_from_front=pose, width_m=width_m, height_m=height_m, handle=None, confidence=0.9)
    return MaskTrack(
        name=name,
        category=category,
        masks={frame: pack_mask(mask) for frame in FRAMES},
        confidence=dict.fromkeys(FRAMES, 0.9),
        front=front,
        box=None,
        kind="front",
        backend="geometric",
        prompt_count=1,
        warnings=(),
    )


def seen(front: FrontPanel, edges: tuple[float, float, float, float], seam: float) -> FrontPanel:
    """The front with these probabilities of its edges, of a clear colour change, and of a seam inside it."""
    return replace(front, edges=edges, changes=(20.0,) * 4, seam=seam)


def thing(name: str, category: str, size: tuple[float, float, float], support_z_m: float = 0.0) -> MaskTrack:
    box = ThingBox(world_from_object=Rigid3(), dimensions_m=np.array(size), support_z_m=support_z_m)
    return replace(track(name, category, slice(0, 20)), front=None, box=box, kind="thing")


def prompt(name: str, category: str, x: float, label: int = 1, frame: int = 4) -> ObjectPrompt:
    points = [PromptPoint(frame=frame, x=x, y=60.5, label=1 if label else 0)]
    if not label:
        points.append(PromptPoint(frame=frame, x=10.5, y=60.5, label=1))
    return ObjectPrompt(name=name, category=category, points=tuple(points))


def found(*pairs: tuple[MaskTrack, ObjectPrompt]) -> tuple[Contradiction, ...]:
    return find_contradictions({track.name: track for track, _ in pairs}, [said for _, said in pairs], (WALL,))


def test_neighbours_that_share_a_border_are_not_reported() -> None:
    left = (track("door_1", "cabinet", slice(0, 81)), prompt("door_1", "cabinet", 40.5))
    right = (track("door_2", "cabinet", slice(79, 160)), prompt("door_2", "cabinet", 120.5))
    assert found(left, right) == ()


@pytest.mark.parametrize(("begins", "rule"), [(0, "same-thing"), (40, "same-thing"), (60, "masks-overlap")])
def test_overlapping_masks_are_reported_with_both_clicks(begins: int, rule: str) -> None:
    left = (track("door_1", "cabinet", slice(0, 80)), prompt("door_1", "cabinet", 40.5))
    right = (track("door_2", "cabinet", slice(begins, begins + 80)), prompt("door_2", "cabinet", 70.5))
    (said,) = found(left, right)
    assert (said.rule, said.objects) == (rule, ("door_1", "door_2"))
    assert "door_1 (clicked at (40, 60) in frame 4) and door_2 (clicked at (70, 60) in frame 4)" in said.message
    assert "\n" not in said.line


def test_overlap_with_an_open_door_is_not_reported() -> None:
    left, right = track("door_1", "cabinet", slice(0, 80)), track("door_2", "cabinet", slice(0, 80))
    opened = replace(left, motions=(motion(dict.fromkeys(FRAMES, 1.0), "left"),))
    said = (prompt("door_1", "cabinet", 40.5), prompt("door_2", "cabinet", 40.5))
    assert found((left, said[0]), (right, said[1]))
    assert found((opened, said[0]), (right, said[1])) == ()


def test_clicks_that_disagree_with_the_mask_are_reported() -> None:
    door = track("door_1", "cabinet", slice(0, 80))
    (left_out,) = found((door, prompt("door_1", "cabinet", 120.5)))
    assert left_out.message == "door_1: the click at (120, 60) in frame 4 is on it, but outside its mask"
    (taken_in,) = found((door, prompt("door_1", "cabinet", 40.5, label=0)))
    assert taken_in.message == "door_1: the click at (40, 60) in frame 4 is off it, but inside its mask"
    assert found((door, prompt("door_1", "cabinet", 81.0))) == ()  # on its border, as clicks may be
    (unseen,) = found((door, prompt("door_1", "cabinet", 40.5, frame=5)))  # a frame in which it was not found
    assert unseen.message == "door_1: the click at (40, 60) in frame 5 is on it, but it is not visible in that frame"
    absent = FrameSaid(frame=5, mask=None)  # marked as absent by a person
    assert found((door, replace(prompt("door_1", "cabinet", 40.5, frame=5), frames=(absent,)))) == ()


def test_sizes_atypical_of_the_category_are_reported() -> None:
    wide = track("door_1", "cabinet", slice(0, 80), width_m=1.17)
    (said,) = found((wide, prompt("door_1", "cabinet", 40.5)))
    assert said.rule == "size-unlikely"
    assert said.message.startswith("door_1 is 1.17 m wide, ")
    assert "click each separately" in said.mend
    vase = thing("vase_1", "vase", (0.13, 0.01, 0.72))
    (tall,) = found((vase, prompt("vase_1", "vase", 10.5)))
    assert tall.message.startswith("vase_1 is 0.72 m high, ")
    unknown = thing("lathe_1", "lathe", (0.9, 0.9, 0.9))
    assert found((unknown, prompt("lathe_1", "lathe", 10.5))) == ()


@pytest.mark.parametrize(
    ("height_m", "width_m", "edge", "seam", "said"),
    [
        (2.1, 0.6, 0.98, 0.001, False),  # a tall door
        (1.3, 0.6, 0.98, 0.001, False),
        (1.3, 0.6, 0.2, 0.01, True),  # an edge that hardly shows
        (1.4, 0.6, 0.98, 0.8, True),  # two doors, one over the other
        (2.1, 1.2, 0.98, 0.01, True),  # two doors, side by side
        (0.2, 0.6, 0.98, 0.01, True),  # a part of one
        (3.2, 0.6, 0.98, 0.01, True),
    ],
)
def test_a_tall_door_is_doubtful_only_where_its_edges_or_its_width_are(
    height_m: float, width_m: float, edge: float, seam: float, said: bool
) -> None:
    door = track("door_1", "cabinet", slice(0, 80), width_m=width_m, height_m=height_m)
    assert door.front is not None
    door = replace(door, front=seen(door.front, (0.98, 0.98, edge, 0.98), seam))
    assert bool(found((door, prompt("door_1", "cabinet", 40.5)))) == said


def test_floor_standing_objects_above_the_floor_are_reported() -> None:
    chair = ("chair_1", "chair", (0.45, 0.5, 0.9))
    assert found((thing(*chair), prompt("chair_1", "chair", 10.5))) == ()
    (said,) = found((thing(*chair, support_z_m=0.45), prompt("chair_1", "chair", 10.5)))
    assert said.message == "chair_1 stands 0.45 m above the floor, a 'chair' stands on it"


def test_a_front_directly_on_the_wall_is_reported() -> None:
    drawer = track("drawer_1", "drawer", slice(0, 80), height_m=0.2)
    assert found((drawer, prompt("drawer_1", "drawer", 40.5))) == ()
    (said,) = found((track("drawer_1", "drawer", slice(0, 80), height_m=0.2, y=-0.01), prompt("drawer_1", "drawer", 40.5)))
    assert said.rule == "in-a-wall"


def test_faint_edges_and_uncut_seams_are_reported() -> None:
    door, clicked = track("door_1", "cabinet", slice(0, 80)), prompt("door_1", "cabinet", 40.5)
    assert door.front is not None
    sure = replace(door, front=seen(door.front, (0.9, 0.9, 0.8, 0.9), 0.001))
    assert found((sure, clicked)) == ()
    front = seen(door.front, (0.9, 0.1, 0.2, 0.9), 0.3)
    (doubt,) = found((replace(door, front=front), clicked))
    assert doubt.rule == "edge-unsure"
    assert doubt.message == (
        f"door_1 is 50 x 70 cm if its edges are right ({100 * front_certainty(front, category_of('cabinet')):.0f} %): "
        "its right and upper edges can hardly be seen, and there may be a seam inside it (30 %)"
    )


def test_an_edge_in_no_frame_is_reported_as_such() -> None:
    door, clicked = track("door_1", "cabinet", slice(0, 80)), prompt("door_1", "cabinet", 40.5)
    assert door.front is not None
    front = replace(seen(door.front, (0.9, 0.9, 0.9, 0.1), 0.0), changes=(20.0, 20.0, 20.0, 0.0))
    (doubt,) = found((replace(door, front=front), clicked))
    assert doubt.message.endswith("its lower edge can be seen in no frame")


def test_an_uncertain_extent_is_reported_even_where_all_edges_show() -> None:
    door, clicked = track("door_1", "cabinet", slice(0, 80)), prompt("door_1", "cabinet", 40.5)
    assert door.front is not None
    (doubt,) = found((replace(door, front=seen(door.front, (0.9, 0.9, 0.4, 0.9), 0.2)), clicked))
    assert doubt.rule == "edge-unsure"
    assert doubt.message.endswith("%)")


@pytest.mark.parametrize("category", ["double_door_cabinet", "microwave", "refrigerator", "dishwasher"])
def test_expected_seams_of_multi_door_fronts_are_not_reported(category: str) -> None:
    item = track("one_1", category, slice(0, 160))
    assert item.front is not None
    wide, high = category_of(category).width.usual, category_of(category).height.usual
    front = replace(seen(item.front, (0.98,) * 4, 0.9), width_m=wide, height_m=high)
    sure = replace(item, front=front)
    assert not any(said.rule == "edge-unsure" for said in found((sure, prompt("one_1", category, 40.5))))
    faint = replace(sure, front=seen(front, (0.98, 0.05, 0.98, 0.98), 0.9))
    assert any(said.rule == "edge-unsure" for said in found((faint, prompt("one_1", category, 40.5))))


def test_a_check_that_fails_for_one_object_does_not_hide_other_reports(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    overlap, sizes = contradictions._overlap, contradictions._unlikely_sizes

    def overlap_fails(first: MaskTrack, second: MaskTrack, most: int) -> tuple[float, int]:
        if "broken" in (first.name, second.name):
            raise IndexError("no frame")
        return overlap(first, second, most)

    def sizes_fail(track: MaskTrack, *rest: Any) -> Iterator[Contradiction]:
        if track.name == "broken":
            raise np.linalg.LinAlgError("singular")
        return sizes(track, *rest)

    monkeypatch.setattr(contradictions, "_overlap", overlap_fails)
    monkeypatch.setattr(contradictions, "_unlikely_sizes", sizes_fail)
    broken = (track("broken", "cabinet", slice(0, 20)), prompt("broken", "cabinet", 10.5))
    left = (track("door_1", "cabinet", slice(0, 80)), prompt("door_1", "cabinet", 40.5))
    right = (track("door_2", "cabinet", slice(0, 80), width_m=2.5), prompt("door_2", "cabinet", 70.5))
    assert [(said.rule, said.objects) for said in found(broken, left, right)] == [
        ("same-thing", ("door_1", "door_2")),
        ("size-unlikely", ("door_2",)),
    ]
    assert "contradictions: broken" in caplog.text
