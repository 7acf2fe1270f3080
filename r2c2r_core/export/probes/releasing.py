"""Release sweep of every joint in an engine: set at rest along its travel, it must stay near. Imports nothing from r2c2r."""

import math
from collections.abc import Callable, Mapping

STEPS, STEP_S = 10, 0.002

_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of each joint's travel
_HELD = 0.05  # of its travel: a flap without dry friction falls by 0.5 % in 0.02 s, an overlap of colliders ejects by more


def release_everywhere(ranges: Mapping[str, tuple[float, float]], released: Callable[[str, float], float]) -> str:
    """Description of the first joint that diverges or moves away; empty where none does.

    `ranges` are the limits in rad or m by joint. `released(joint, position)` returns the joint's position STEPS steps of
    STEP_S after it was set to `position` at rest, with the other joints closed and gravity on; NaN where anything diverges.
    """
    for joint, (low, high) in ranges.items():
        for share in _SHARES:
            start = low + share * (high - low)
            found = released(joint, start)
            if not math.isfinite(found):
                return f"it diverges with {joint} at {share:.0%}"
            if abs(found - start) > _HELD * (high - low):
                return f"{joint}, released at {start:.3g}, is at {found:.3g} after {STEPS} steps"
    return ""
