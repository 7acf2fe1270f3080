"""Filmed motion of a front's joint: its kind and axis, and its state in each frame.

Frames: the world (+Z up, floor z = 0; transforms.py). Units: metres and radians. A state is the joint's position: 0 is closed
whether or not that was filmed, positive is opening, about the axis by the right-hand rule (revolute) or along it (prismatic).
Frame numbers are Frame.index, the frame's number in the recording.

`r2c2r evaluate` scores the manifest's values of these: type, axis and pivot of the joint, the state of every frame that shows
the front (one that is not listed, or has no value, is a miss), limits and insides. A truth file has the same per joint:
`states` (of every frame, never null), `seen_px` and `seen_share` (how much of the front each frame shows), `largest` and
`inside`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3, joint_transform

Source = Literal["measured", "at_least", "inferred", "default", "person"]
"""Source of a number. `at_least` is used for limits only: the largest observed opening, beyond the category's."""

DOOR, DRAWER = "door", "drawer"
"""Parts of an object with a drawer below its door."""

JointType = Literal["revolute", "prismatic"]

Movement = Literal["hinge", "out", "along", "none"]
"""Motion of a front: rotation about an edge, pulled out, sliding along its own plane, or none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Joint state in a frame that shows the front."""

    value: float | None  # rad or m; None: in view, but unknown
    sigma: float | None  # its standard deviation, same unit; None if unknown or set by a person


@dataclass(frozen=True, slots=True, kw_only=True)
class Inside:
    """Observed interior behind an open front, metres; None: not observed.

    For a drawer, the box that slides out; otherwise the compartment that the front closes. Lengths are clear ones, between the
    faces of the boards: the space available.
    """

    depth_m: float | None = None  # from the back of the closed front to the face of the rear board
    width_m: float | None = None  # between the sides
    height_m: float | None = None  # from the bottom's face to the rim of a drawer's sides, or to the top board's underside
    shelves_m: tuple[float, ...] = ()  # upper faces of the observed shelves, above the bottom's face, ascending
    board_m: float | None = None  # thickness of the sides, from their front edges
    front_m: float | None = None  # thickness of the front itself, from its edge


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMotion:
    """One joint, fitted to all frames in which its front moves or is open.

    `kind` follows the evidence, not the category. A prismatic joint's pivot is the centre of its closed front; a revolute one's
    is the point of its axis nearest to that. `fixed` has neither axis nor pivot, and its states are all 0.
    """

    part: str = ""  # leaf of an object with several: "left", "right", DOOR, DRAWER; "" for a single leaf
    kind: JointType | Literal["fixed"]
    axis_world: Vector3 | None  # unit; opening turns about it, or goes along it
    pivot_world: Vector3 | None
    covariance: Float[ndarray, "6 6"] | None
    """Covariance of a small rotation of the axis about the world's axes (rad), then of the pivot (m). Zero along gauge
    freedoms: rotation about the axis itself, and the pivot's position along a hinge's line. None if a person set the joint."""
    states: Mapping[int, State]  # by Frame.index: every frame that shows the front
    largest: float  # the largest observed state, rad or m
    source: Source  # of axis and pivot: measured, inferred or person
    inside: Inside | None = None

    def state_in(self, frame_index: int) -> float:
        """State in a frame; 0 where it is unknown."""
        state = self.states.get(frame_index)
        return 0.0 if state is None or state.value is None else state.value

    def opening(self, state: float) -> Rigid3:
        """World motion of the front from closed to a state."""
        if self.axis_world is None or self.pivot_world is None:
            return Rigid3()
        return joint_transform(self.axis_world, self.pivot_world, state, turns=self.kind == "revolute")

    def movement(self, front_normal: Vector3) -> Movement:
        """How the front, whose plane has that normal (world, unit), moves."""
        if self.axis_world is None:
            return "none"
        if self.kind == "revolute":
            return "hinge"
        return "out" if abs(float(self.axis_world @ front_normal)) > np.sqrt(0.5) else "along"


def opened_frames(motions: Iterable[JointMotion]) -> frozenset[int]:
    """Frames in which at least one of the fronts is not closed, or may not be."""
    return frozenset(
        frame for motion in motions for frame, state in motion.states.items() if state.value is None or state.value > 0
    )
