"""Agreement of a placed mesh with the views: which part of a front counts as its face."""

from typing import Any

import numpy as np

from r2c2r_core.align.judge import judge
from r2c2r_core.align.observe import observe
from r2c2r_core.align.shape import prepare_shape
from r2c2r_core.geometry.transforms import Rigid3, Similarity3
from r2c2r_core.model.track import FrontPanel
from tests.core.align.conftest import Bench


def unit(bench: type[Bench], recess_m: float) -> Any:
    """A unit of 60 x 55 x 70 cm whose front is recessed except for rails of 6 cm."""
    thing = bench.box_mesh((0.6, 0.55, 0.7), (0, 0.275, 0.45))
    vertices = thing.vertices.copy()
    sunk = (vertices[:, 1] == 0.0) & (np.abs(vertices[:, 0]) < 0.25) & (np.abs(vertices[:, 2] - 0.45) < 0.29)
    vertices[sunk, 1] = recess_m
    return thing.__class__(vertices=vertices, faces=thing.faces, uv=thing.uv, texture=thing.texture)


def test_a_recessed_panel_counts_as_part_of_the_front_face(bench: type[Bench]) -> None:
    thing = unit(bench, 0.025)
    front = FrontPanel(
        world_from_front=Rigid3(np.eye(3), np.array([0, 0, 0.45])), width_m=0.6, height_m=0.7, handle=None, confidence=0.9
    )
    eyes = [(x, -1.3, 1.1) for x in np.linspace(-1.2, 1.2, 6)]
    capture, track = bench.film(thing, eyes=eyes, target=(0, 0, 0.45), front=front, kind="front", mask_behind=0.03)
    observation = observe(capture, track, view_count=6, size_px=128, point_count=400)
    shape = prepare_shape(thing, point_count=4000, face_limit=6000, rng=np.random.default_rng(0))
    assert judge(Similarity3(1.0, np.eye(3), np.zeros(3)), shape, observation.views, front).iou > 0.9
