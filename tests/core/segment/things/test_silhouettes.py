"""Outlines of small things: the same effort at any photo resolution, at the photos' own edges."""

import dataclasses

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.capture import Capture, Depth
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.crops import Params
from r2c2r_core.segment.things.silhouettes import crop_outline, small_mask, splat
from r2c2r_core.segment.things.thing import ThingConfig
from r2c2r_core.segment.things.visual_hull import find_small
from tests.core.segment.conftest import Truth

TIMES = 8  # a carton of 350 x 600 px


class Enlarged:
    """The same pictures at a phone's resolution; depth stays coarse."""

    def __init__(self, capture: Capture) -> None:
        self._of = capture.images

    def rgb(self, frame_index: int) -> np.ndarray:
        return np.asarray(cv2.resize(self._of.rgb(frame_index), None, fx=TIMES, fy=TIMES, interpolation=cv2.INTER_CUBIC))

    def depth(self, frame_index: int) -> Depth:
        return self._of.depth(frame_index)


def test_large_photos_are_outlined_at_bounded_size_with_accurate_masks(
    session: GeometricSession, boxes: tuple[Capture, Truth]
) -> None:
    capture, truth = boxes
    hull = find_small(session.scene, np.array([[1.06, -0.36, 1.0]]), np.zeros((0, 3)), ThingConfig(radius_m=0.12), ())
    assert hull is not None
    frames = tuple(
        dataclasses.replace(f, rgb_camera=f.rgb_camera.resized(TIMES * f.rgb_camera.width, TIMES * f.rgb_camera.height))
        for f in capture.frames
    )
    large = dataclasses.replace(capture, frames=frames, images=Enlarged(capture))
    scene = Scene(capture=large, rendered_mm=session.scene.rendered_mm, parts=session.scene.parts)
    overlaps = []
    for frame in frames[5:9]:
        crop, outline, _ = crop_outline(hull, scene, frame)
        assert crop is not None
        assert max(outline.shape) <= Params().longest_px
        assert crop.shrink > 1.5
        mask, _ = small_mask(hull, scene, frame)
        exact = np.kron(truth["carton"][frame.index], np.ones((TIMES, TIMES), bool))
        assert mask.shape == exact.shape
        overlaps.append(mask_iou(mask, exact))
    assert np.mean(overlaps) > 0.92


@pytest.mark.parametrize("radius_px", [6.3, 11.0])
def test_an_outline_has_the_area_of_the_disc_covered_by_its_points(radius_px: float) -> None:
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    rings = [share * radius_px * np.column_stack([np.cos(angle), np.sin(angle)]) for share in np.linspace(0, 1, 60)]
    mask = splat(np.concatenate(rings) + 32.4, (64, 64), 1.0)
    assert mask.sum() == pytest.approx(np.pi * radius_px**2, rel=0.08)  # every touched pixel counts: 12 to 17 % more
