"""Visibility of a plane's cells in a frame."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import PlaneGrid, choose_frames, opened_cells
from tests.core.segment.motion.boards import LEAF, Film, filmed

GRID = PlaneGrid(LEAF.world_from_front, -LEAF.half_m[0], LEAF.half_m[1], 0.005, 100, 120)
OPEN = np.concatenate([np.zeros(8), np.full(4, 1.4)])
CLOSED = filmed("left", np.zeros(len(OPEN)), noise_m=0.0)
HOLLOW = filmed("left", np.full(len(OPEN), 2.8), noise_m=0.0)


@dataclass(kw_only=True)
class Scan(Film):
    """A film with the surface that was fused from it."""

    surface: Film

    def surface_depth(self, frame_index: int, size: tuple[int, int]) -> np.ndarray:
        del size
        return self.surface.depth(frame_index)


def _shares(film: Film, surface: Film) -> np.ndarray:
    """Fraction of the front's cells that each frame finds open."""
    scan = Scan(film.frames, film.depths, surface=surface)
    return np.array([opened_cells(GRID, scan, frame).mean() for frame in film.frames])


def test_an_open_leaf_is_detected_only_in_frames_that_show_it_open() -> None:
    found = _shares(filmed("left", OPEN), CLOSED)
    assert (found[OPEN == 0] == 0).all()
    assert (found[OPEN > 0] > 0.5).all()  # the leaf itself occludes the rest


def test_a_front_that_all_frames_see_through_stays_in_the_mosaic() -> None:
    assert (_shares(HOLLOW, HOLLOW) == 0).all()


def test_depth_through_a_narrow_gap_is_not_an_open_front() -> None:
    film = filmed("left", np.zeros(3))
    for depth in film.depths.values():
        depth[:, 90:94] = 4.0
    assert (_shares(film, CLOSED) == 0).all()


def test_frame_selection_covers_poorly_observed_parts_early() -> None:
    quality = np.zeros((40, 12))  # frames, parts
    quality[:36, :9] = np.random.default_rng(0).uniform(0.8, 1.0, (36, 9))
    quality[36:, 6:] = [[0.02], [0.03], [0.025], [0.01]]
    scene: Any = SimpleNamespace(frames=[SimpleNamespace(index=10 * k) for k in range(40)])
    chosen = [index // 10 for index in choose_frames(quality, scene, 6)]
    assert len(set(chosen)) == 6
    assert 37 in chosen[:4]  # the best frame that shows the end
    assert choose_frames(quality[:, :0], scene, 6) == []
