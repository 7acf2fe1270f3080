"""Named states a scene can be reset to, the same in every format: how far each joint stands open."""

from collections.abc import Mapping
from types import MappingProxyType

from r2c2r_core.model.scene import Joint

STATES: Mapping[str, float] = MappingProxyType({"closed": 0.0, "ajar": 0.15, "open": 1.0})
"""Shares of a joint's travel, of all joints at once; doors that meet when both are open overlap in `open`: the certificate
names them."""


def position(joint: Joint, state: str) -> float:
    """Position of a joint in a state, rad or m."""
    return STATES[state] * joint.upper
