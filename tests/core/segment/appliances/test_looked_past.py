"""Depth beyond a front's plane, seen beside the front but never on it."""

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.appliances.looked_past import looked_past
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.planes import region_at
from tests.core.segment.scenes import FRONT_Y, TOP_M


def test_frames_see_past_the_front_plane_except_on_the_doors(session: GeometricSession) -> None:
    on_door = np.array([0.25, FRONT_Y, 0.5])
    region = region_at(session.planes, on_door)
    assert region is not None
    run = session.run_of(region, margin_m=0.35)
    assert run is not None
    past = looked_past(run, session.scene, run.grid.cells_of(on_door[None])[0], category_of("refrigerator"))

    def share(low: tuple[float, float], high: tuple[float, float]) -> float:
        (left, bottom), (right, top) = run.grid.cells_of(np.array([[low[0], FRONT_Y, low[1]], [high[0], FRONT_Y, high[1]]]))
        return float(past[int(top) : int(bottom), int(left) : int(right)].mean())

    assert share((0.05, 0.2), (0.45, TOP_M - 0.05)) < 0.02
    assert share((0.05, TOP_M + 0.12), (0.45, TOP_M + 0.25)) > 0.9  # the wall, 0.6 m behind
    assert share((0.05, -0.15), (0.45, -0.03)) > 0.9
