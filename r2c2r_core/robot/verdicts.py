"""Diagnosis of a failed gripper trial: a sentence and the cause."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from r2c2r_core.robot.grasps import Way, body_words
from r2c2r_core.robot.motion import Travel
from r2c2r_core.robot.opening import CLOSED_SHARE, OPEN_SHARE, Measured
from r2c2r_core.robot.rig import STROKE_M

Blame = Literal["scan", "world", "gripper", "arm"]
"""The scan: such a kitchen is hardly built, so what was reconstructed is doubted. The world: such kitchens are, and this
gripper does not fit there. The gripper: its pads or its strength. The arm: it is too short, or not strong
or nimble enough there."""

_REACHED_M = 0.012
_HELD = 0.5
_SLIPPED_M = 0.03
_LEANS_N = 2.0
_HINGE_SIDE = 1 / 3  # own choice: handles sit on the half away from the hinge


class Verdict(NamedTuple):
    """The reason of a failure and its cause."""

    why: str
    blame: Blame


def unholdable(travel: Travel | None) -> Verdict:
    """Verdict on a joint without a feasible grasp."""
    if travel is None or travel.part.bar is None:
        return Verdict("no flat board to grasp or push: its colliders are meshes", "scan")
    across, _, upright = 1000 * travel.part.bar.size
    size = f"{across:.0f} mm wide and {upright:.0f} mm high"
    return Verdict(f"handle too thick: {size}, the gripper opens {1000 * STROKE_M:.0f} mm", "scan")


def verdict_on_pick(lifted: bool, off_m: float, mass_kg: float) -> Verdict:
    """Verdict on an object that was not moved to its goal."""
    if not lifted:
        return Verdict(f"not lifted: its {mass_kg:.1f} kg slipped from the pads", "gripper")
    return Verdict(f"dropped or tipped: it ended {1000 * off_m:.0f} mm from its goal", "gripper")


def verdict_on(model: Any, travel: Travel, way: Way, measured: Measured) -> Verdict | None:
    """Verdict on an attempt; None where the joint was opened and closed."""
    if measured.opened >= OPEN_SHARE and measured.closed <= CLOSED_SHARE:
        return None
    done = (
        f"opens {100 * measured.opened:.0f} % of its travel"
        if measured.opened < OPEN_SHARE
        else f"opens, but {100 * measured.closed:.0f} % of its travel is left after closing"
    )
    obstacle = _obstacle(travel, way, measured)
    if obstacle == travel.part.body:
        stands = 1000 * travel.part.protrusion_m
        return Verdict(
            f"handle too close to the front: it protrudes {stands:.0f} mm, the fingers hit the front; {done}", "scan"
        )
    if obstacle is not None:
        name = body_words(model, obstacle)
        if (beside_m := _beside_hinge_m(travel)) is not None:
            why = f"handle beside the hinge, {1000 * beside_m:.0f} mm away: the gripper collides with {name}; {done}"
            return Verdict(why, "scan")
        blame: Blame = "scan" if obstacle == 0 else "world"
        return Verdict(f"blocked by {name}: the gripper collides with it; {done}", blame)
    if measured.opened < OPEN_SHARE and (jam := _most(measured.jams)) is not None:
        return Verdict(f"its part hits {body_words(model, jam)} as it opens; {done}", "scan")
    if not measured.reach_m <= _REACHED_M:
        return Verdict(f"not reached: the fingers close {1000 * measured.reach_m:.0f} mm beside the handle; {done}", "gripper")
    if measured.held < _HELD or measured.slip_m > _SLIPPED_M:
        return Verdict(f"slipped: the pads slid {1000 * measured.slip_m:.0f} mm along the handle; {done}", "gripper")
    return Verdict(f"joint too stiff: the gripper applied {measured.force_n:.0f} N; {done}", "scan")


def _obstacle(travel: Travel, way: Way, measured: Measured) -> int | None:
    """The main obstacle: the body pressed most, or with the deepest expected collision."""
    if (leant := _most(measured.touched)) is not None:
        return leant
    if way.clashes:
        return max(way.clashes, key=lambda body: way.clashes[body])
    return None


def _beside_hinge_m(travel: Travel) -> float | None:
    """Distance of a door's handle from its hinge where that is short; otherwise None."""
    if travel.part.bar is None or not travel.hinged:
        return None
    front = travel.part.front
    reach_m = max(travel.radius_of(front.low), travel.radius_of(front.high))
    handle_m = travel.radius_of(travel.part.bar.centre)
    return handle_m if handle_m < _HINGE_SIDE * reach_m else None


def _most(forces: Mapping[int, float]) -> int | None:
    """The body pressed most; None where none is pressed."""
    pressed = {body: force for body, force in forces.items() if force > _LEANS_N}
    return max(pressed, key=lambda body: pressed[body], default=None)
