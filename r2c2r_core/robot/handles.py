"""Graspable geometry of a moving part: its handle as described by the bundle, and its front, from the colliders."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import rotation_of

_BOX = 6  # mjtGeom


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Board:
    """A box in its body's frame: x to the right, y into the furniture, z up."""

    low: Vector3
    high: Vector3

    @property
    def centre(self) -> Vector3:
        """Centre of the box."""
        return np.asarray((self.low + self.high) / 2)

    @property
    def size(self) -> Vector3:
        """Side lengths of the box."""
        return np.asarray(self.high - self.low)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """The part moved by one joint."""

    joint: str
    body: int
    front: Board
    bar: Board | None  # the grip of its handle, the foremost of several; None: no handle, it is pushed

    @property
    def protrusion_m(self) -> float:
        """Protrusion of the handle from the front."""
        return 0.0 if self.bar is None else float(self.front.low[1] - self.bar.low[1])


def part_of(model: Any, joint: str) -> Part | None:
    """The front and handle of the part moved by a joint; None where it has no board."""
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
    """Grips of a body's handles: box sites of scene.xml, whose axes are a permutation of the body's."""
    for site in range(model.nsite):
        if model.site_bodyid[site] == body and model.site_type[site] == _BOX:
            half = np.abs(rotation_of(model.site_quat[site])) @ model.site_size[site]
            yield Board(low=model.site_pos[site] - half, high=model.site_pos[site] + half)
