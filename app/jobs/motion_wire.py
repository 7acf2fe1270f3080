"""API encoding of filmed motions of leaves: schemas.Opening of each, without its object."""

from collections.abc import Iterable
from typing import Any

from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.synthesize.marked import Marks, moved


def motion_lines(motions: Iterable[JointMotion]) -> list[dict[str, Any]]:
    """One line per leaf that moves; states by frame, in rad or m."""
    return [
        {
            "part": motion.part,
            "kind": motion.kind,
            "largest": round(motion.largest, 4),
            "source": motion.source,
            "states": [
                {"frame": int(frame), "value": _rounded(state.value), "sigma": _rounded(state.sigma)}
                for frame, state in sorted(motion.states.items())
            ],
        }
        for motion in motions
        if motion.kind != "fixed"
    ]


def marked_line(line: dict[str, Any], marks: Marks) -> dict[str, Any]:
    """The line with a user's marks (rad or m by frame), and measured states of other frames corrected by them."""
    found = JointMotion(
        part=line["part"],
        kind=line["kind"],
        axis_world=None,
        pivot_world=None,
        covariance=None,
        states={state["frame"]: State(value=state["value"], sigma=state["sigma"]) for state in line["states"]},
        largest=line["largest"],
        source=line["source"],
    )
    return motion_lines([moved(found, marks)])[0]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)
