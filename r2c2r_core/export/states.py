"""Named states a scene can be reset to, the same in every format: how far each joint stands open."""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from r2c2r_core.export.plan import Body, Plan

SHARES: Mapping[str, float] = MappingProxyType({"closed": 0.0, "ajar": 0.15, "open": 1.0})
"""Shares of a joint's travel in the states of all joints."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Some joints open by the same share of their travel, all others closed."""

    share: float
    joints: frozenset[str]

    def position(self, body: Body) -> float:
        """Position of the body's joint, rad or m."""
        assert body.joint is not None
        return self.share * body.joint.upper if body.joint_name in self.joints else 0.0


def states_of(plan: Plan) -> dict[str, State]:
    """Every state by its name: closed, ajar and open for all joints, and `<joint>_open` for each joint alone.

    Joints that would overlap another joint's part, or a thing that stands free, stay closed; a joint that overlaps a thing
    when open has no state of its own.
    """
    names = frozenset(body.joint_name for body in plan.bodies if body.joint is not None)
    states = {name: State(share=share, joints=_without_conflicts(plan, name, names)) for name, share in SHARES.items()}
    alone = {f"{name}_open": State(share=1.0, joints=_without_conflicts(plan, "open", {name})) for name in sorted(names)}
    return states | {name: state for name, state in alone.items() if state.joints}


def _without_conflicts(plan: Plan, state: str, wanted: Collection[str]) -> frozenset[str]:
    """The wanted joints without those of most conflicts, left out one by one until no two of the others conflict."""
    left, present = set(wanted), {body.name for body in plan.bodies if body.free}
    while pairs := [pair for pair in plan.conflicts.get(state, ()) if (left | present).issuperset(pair)]:
        counts = Counter(name for pair in pairs for name in pair if name in left)
        left.remove(counts.most_common(1)[0][0])
    return frozenset(left)
