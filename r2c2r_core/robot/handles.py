"""What of a moving part a gripper can hold: its handle as the bundle describes it, and its front, read from the colliders."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3

_BOX = 6  # mjtGeom


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Board:
    """A box in its body's frame: x to the right, y into the furniture, z up."""

    low: Vector3
    high: Vector3

    @property
    def centre(self) -> Vector3:
        """Its middle."""
        return np.asarray((self.low + self.high) / 2)

    @property
    def size(self) -> Vector3:
        """Its sides."""
        return np.asarray(self.high - self.low)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """What one joint moves."""

    joint: str
    body: int
    front: Board
    bar: Board | None  # the grip of its handle, the foremost of several; None: it has none, one pushes

    @property
    def protrusion_m(self) -> float:
        """How far the handle stands out of the front."""
        return 0.0 if self.bar is None else float(self.front.low[1] - self.bar.low[1])


def part_of(model: Any, joint: str) -> Part | None:
    """The front of what a joint moves and its handle; None where it has no board."""
    body = int(model.joint(joint).bodyid[0])
    boards = [
        Board(low=model.geom_pos[g] - model.geom_size[g], high=model.geom_pos[g] + model.geom_size[g])
        for g in range(model.ngeom)
        if model.geom_bodyid[g] == body and model.geom_type[g] == _BOX and model.geom_contype[g]
    ]
    if not boards:
        return None
    front = max(boards, key=lambda board: board.size[0] * board.size[2])
    bar = min(_grips(model, body), key=lambda grip: float(grip.low[1]), default=None)
    return Part(joint=joint, body=body, front=front, bar=bar)


def _grips(model: Any, body: int) -> Iterator[Board]:
    """The grips of a body's handles: sites of scene.xml that are boxes, whose axes are the body's in some order."""
    import mujoco

    for site in range(model.nsite):
        if model.site_bodyid[site] == body and model.site_type[site] == _BOX:
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, model.site_quat[site])
            half = np.abs(turn.reshape(3, 3)) @ model.site_size[site]
            yield Board(low=model.site_pos[site] - half, high=model.site_pos[site] + half)
