"""Rules on limits, axes and dynamics of moving joints."""

from collections.abc import Iterator

import numpy as np

from r2c2r_core.export.reading import MOVING, Urdf, UrdfJoint
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding

_MOST_EFFORT = 500.0  # N or N m; furniture takes tens


def check_joints(urdf: Urdf) -> Iterator[Finding]:
    """Check that every moving joint has a unit axis, complete limits around zero, and friction."""
    for joint in urdf.joints:
        if joint.type in MOVING:
            length = float(np.linalg.norm(joint.axis))
            if not abs(length - 1.0) < 1e-4:
                yield finding("axis-unit", joint.name, f"the axis has length {length:.4g}")
            if not joint.dynamics or not {"damping", "friction"} <= set(joint.dynamics):
                yield finding("dynamics-missing", joint.name, "no <dynamics damping friction>")
            yield from _limits(joint)


def _limits(joint: UrdfJoint) -> Iterator[Finding]:
    if joint.limit is None:
        yield finding("limit-missing", joint.name, f"a {joint.type} joint without <limit>")
        return
    needed = {"effort", "velocity"} | ({"lower", "upper"} if joint.type != "continuous" else set())
    missing = sorted(needed - set(joint.limit))
    if missing:
        yield finding("limit-incomplete", joint.name, f"<limit> lacks {', '.join(missing)}")
    lower, upper = joint.limit.get("lower", 0.0), joint.limit.get("upper", 0.0)
    if lower > upper:
        yield finding("limit-order", joint.name, f"lower {lower:.4g} is above upper {upper:.4g}")
    elif not lower <= 0.0 <= upper:
        yield finding("limit-zero", joint.name, f"0 (closed) is outside {lower:.4g} .. {upper:.4g}")
    elif joint.type != "continuous" and upper - lower <= 0.0:
        yield finding("limit-order", joint.name, f"no travel: lower and upper are both {lower:.4g}")
    effort = joint.limit.get("effort", 1.0)
    if not 0.0 < effort <= _MOST_EFFORT:
        yield finding("limit-effort", joint.name, f"effort {effort:.4g}; expected above 0 and at most {_MOST_EFFORT:.0f}")
