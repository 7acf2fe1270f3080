"""What stands on a table or a worktop is not part of its mask."""

from dataclasses import replace

import numpy as np

from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.track import MaskTrack, ThingBox
from r2c2r_core.segment.slab_masks import stands_on, without_things


def thing(category: str, columns: slice, size: tuple[float, float, float], support_z_m: float) -> MaskTrack:
    """A thing whose middle is at the origin, seen in frames 0 and 1."""
    mask = np.zeros((20, 40), bool)
    mask[5:15, columns] = True
    return MaskTrack(
        name=category,
        category=category,
        masks={frame: pack_mask(mask) for frame in (0, 1)},
        confidence={0: 1.0, 1: 1.0},
        front=None,
        box=ThingBox(world_from_object=Rigid3(), dimensions_m=np.array(size), support_z_m=support_z_m),
        kind="thing",
        backend="test",
        prompt_count=1,
        warnings=(),
    )


TABLE = thing("table", slice(0, 30), (1.2, 0.8, 0.72), 0.0)  # its top is at 0.36
MAGAZINE = thing("magazine", slice(10, 20), (0.2, 0.3, 0.01), 0.35)


def test_a_magazine_stands_on_the_table_and_a_rug_below_it_does_not() -> None:
    assert stands_on(MAGAZINE, TABLE)
    assert stands_on(MAGAZINE, replace(TABLE, category="worktop"))
    assert not stands_on(replace(MAGAZINE, box=replace(MAGAZINE.box, support_z_m=0.0)), TABLE)
    assert not stands_on(MAGAZINE, replace(TABLE, category="chair"))
    assert not stands_on(TABLE, MAGAZINE)
    worktop = thing("worktop", slice(0, 30), (1.2, 0.8, 0.04), -0.02)  # its top is at 0.02
    assert not stands_on(worktop, replace(worktop, name="the same"))


def test_a_table_mask_excludes_the_magazine_on_it() -> None:
    cleared = without_things(TABLE, [replace(MAGAZINE, masks={0: MAGAZINE.masks[0]})])
    shown = unpack_mask(cleared.masks[0])
    assert shown[10].tolist() == [True] * 10 + [False] * 10 + [True] * 10 + [False] * 10
    assert unpack_mask(cleared.masks[1])[10, :30].all()  # that frame does not show the magazine


def test_a_frame_in_which_things_cover_a_table_does_not_show_it() -> None:
    covering = thing("magazine", slice(0, 40), (0.2, 0.3, 0.01), 0.35)
    cleared = without_things(TABLE, [replace(covering, masks={0: covering.masks[0]})])
    assert list(cleared.masks) == list(cleared.confidence) == [1]
    assert without_things(TABLE, [covering]).masks == TABLE.masks  # a table that no frame shows is an error of the things
