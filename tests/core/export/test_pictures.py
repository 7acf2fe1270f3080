from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.export.pictures import write_pictures
from r2c2r_core.export.plan import plan_bundle
from tests.core.export.kitchen import reconstruction


def test_each_segmented_object_has_a_photo_beside_its_model(tmp_path: Path) -> None:
    item = reconstruction()
    files = write_pictures(item, plan_bundle(item.scene), tmp_path)
    assert set(files) == {track.name for track in item.tracks}  # objects without clicks have no mask
    drawer = cv2.imread(str(tmp_path / files["drawer_1"])).astype(float)
    half = (drawer.shape[1] - 4) // 2
    photo, model = drawer[:, : half - 4], drawer[:, half + 8 :]
    np.testing.assert_allclose(photo.mean(axis=(0, 1)), 128, atol=3)  # the grey frame
    blue, red = model[..., 0], model[..., 2]
    assert (red > blue + 30).mean() > 0.2  # the wooden front is where its mask is


def test_an_object_without_masks_has_no_picture(tmp_path: Path) -> None:
    from dataclasses import replace

    item = reconstruction()
    item = replace(item, tracks=(replace(item.tracks[0], masks={}), *item.tracks[2:]))
    assert not {"cabinet_1", "drawer_1"} & set(write_pictures(item, plan_bundle(item.scene), tmp_path))
