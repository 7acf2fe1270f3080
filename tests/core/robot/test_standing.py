"""Base positions of an arm on the free floor."""

import mujoco
import numpy as np
import pytest

from r2c2r_core.robot.panda import LIFTS_M, PEDESTAL_RADIUS_M
from r2c2r_core.robot.standing import free_floor


@pytest.mark.parametrize("bottom_m", [0.0, LIFTS_M[-1] + 0.1])
def test_the_floor_below_a_wall_cabinet_is_free(bottom_m: float) -> None:
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><geom type="plane" size="0 0 1"/>
        <geom type="box" size="0.3 0.15 0.3" pos="0 0 {bottom_m + 0.3}"/></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    stands = free_floor(model, data, frozenset(), [np.array([0.0, -0.15, bottom_m + 0.3])]).stands
    below = [s for s in stands if abs(s.x_m) < 0.3 + PEDESTAL_RADIUS_M / 2 and abs(s.y_m) < 0.15 + PEDESTAL_RADIUS_M / 2]
    assert len(stands) > 100
    assert bool(below) == (bottom_m > 0)
