"""How fronts were filmed to move, as it goes over the wire: schemas.Opening of each leaf, without its object."""

from collections.abc import Iterable
from typing import Any

from r2c2r_core.model.motion import JointMotion


def motion_lines(motions: Iterable[JointMotion]) -> list[dict[str, Any]]:
    """A line each; states by frame, in rad or m."""
    return [
        {
            "part": motion.part,
            "kind": motion.kind,
            "largest": round(motion.largest, 4),
            "limit_source": motion.limit_source,
            "source": motion.source,
            "states": [
                {"frame": int(frame), "value": _rounded(state.value), "sigma": _rounded(state.sigma)}
                for frame, state in sorted(motion.states.items())
            ],
        }
        for motion in motions
        if motion.kind != "fixed"
    ]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)
