"""Joint motions of leaves as a segmenter would estimate them."""

from collections.abc import Mapping

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import JointMotion, State

_AXES = {"left": (0.0, 0.0, -1.0), "right": (0.0, 0.0, 1.0), "top": (-1.0, 0.0, 0.0), "bottom": (1.0, 0.0, 0.0)}
_WAYS = {"out": (0.0, -1.0, 0.0), "slides_left": (-1.0, 0.0, 0.0), "slides_right": (1.0, 0.0, 0.0)}


def motion(
    states: Mapping[int, float],
    way: str = "out",
    *,
    world_from_front: Rigid3 | None = None,
    size_m: tuple[float, float] = (0.5, 0.7),
    part: str = "",
) -> JointMotion:
    """Motion of a front of that size (width, height): states by frame, and their joint."""
    place = world_from_front or Rigid3()
    edges = {"left": (-0.5, 0.0, 0.0), "right": (0.5, 0.0, 0.0), "top": (0.0, 0.0, 0.5), "bottom": (0.0, 0.0, -0.5)}
    pivot = np.array(edges.get(way, (0.0, 0.0, 0.0))) * [size_m[0], 0.0, size_m[1]]
    return JointMotion(
        part=part,
        kind="revolute" if way in _AXES else "prismatic",
        axis_world=place.turn(np.array([{**_AXES, **_WAYS}[way]]))[0],
        pivot_world=place.apply(pivot),
        covariance=np.diag([1e-6] * 3 + [4e-6] * 3),
        states={frame: State(value=value, sigma=0.004) for frame, value in states.items()},
        largest=max(states.values()),
        source="measured",
    )
