"""Arms for the joint trials of a bundle; the first is none, which needs no extra and is the default."""

from typing import Any

from r2c2r_core.registry import Backend, Registry

NO_ARM = "none"
MAP = "standing.svg"  # floor plan of an arm's base positions, beside its films

ARMS: Registry[Any] = Registry(
    seam="arm",
    own=(
        Backend(name=NO_ARM, target="", licence="", summary="no arm trials"),
        Backend(
            name="panda",
            target="r2c2r_core.robot.panda:panda_spec",
            extra="arm",
            needs=("pybullet_data",),
            licence="Apache-2.0 (its description, which pybullet's wheel ships)",
            summary="a Franka Panda opens every joint within reach; a floor plan shows its base positions (half a minute)",
        ),
    ),
)
