"""Boards along a run of base units, from which worktops and plinths are made."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.model.motion import Source
from r2c2r_core.synthesize.facets import Colour
from r2c2r_core.synthesize.unit_runs import Interval
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned dimensions of boards along a run."""

    clear_m: float = param(0.002, "m", "Gap to objects beside, below and above the board")
    shortest_m: float = param(0.10, "m", "Minimum length of a piece")
    same_m: float = param(0.10, "m", "Maximum difference of the tops of a worktop as clicked and as found over its units")


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """An upright box in a run's frame, with the sources of its width, depth and height, and its colour."""

    rotation: Matrix3
    low: Vector3
    high: Vector3
    sources: tuple[Source, Source, Source]
    colour: Colour
    notes: tuple[str, ...] = ()
    flush_m: float | None = None  # y of the fronts, if it overhangs them

    @property
    def flush(self) -> "Slab":
        """The slab without its overhang over the fronts."""
        low = self.low if self.flush_m is None else np.array([self.low[0], self.flush_m, self.low[2]])
        return replace(self, low=low, flush_m=None)

    @property
    def thickness_m(self) -> float:
        """Its height."""
        return float(self.high[2] - self.low[2])

    @property
    def along(self) -> Interval:
        """Interval along the run."""
        return float(self.low[0]), float(self.high[0])

    def corners(self, rotation: Matrix3) -> Points:
        """Its corners (8, 3) in another run's frame."""
        return (box_corners(self.high - self.low) + (self.low + self.high) / 2) @ self.rotation.T @ rotation

    def meets(self, corners: Points, axis: int) -> bool:
        """Whether it and corners in its frame overlap along an axis."""
        return bool(corners[:, axis].min() < self.high[axis] and corners[:, axis].max() > self.low[axis])

    def is_at(self, top: Vector3) -> bool:
        """Whether a point on top of a worktop (world) lies on it."""
        local = self.rotation.T @ top - (self.low + self.high) / 2
        return bool(
            (np.abs(local - [0.0, 0.0, self.thickness_m / 2]) < [*(self.high - self.low)[:2] / 2, tuned(Params).same_m]).all()
        )

    def cut(self, obstacles: Sequence[Points], replaced_by: Sequence[Points] = ()) -> list["Slab"]:
        """Pieces of the slab along its run beside obstacles (corners in its frame), and away from replacements."""
        params = tuned(Params)
        gone = [corners for corners in obstacles if self.meets(corners, 1) and self.meets(corners, 2)]
        gone += [corners for corners in replaced_by if self.meets(corners, 1)]
        pieces = [self.along]
        for corners in gone:
            start, end = float(corners[:, 0].min()) - params.clear_m, float(corners[:, 0].max()) + params.clear_m
            pieces = [p for low, high in pieces for p in ((low, min(high, start)), (max(low, end), high))]
            pieces = [(low, high) for low, high in pieces if high - low >= params.shortest_m]
        return [
            replace(self, low=np.array([low, *self.low[1:]]), high=np.array([high, *self.high[1:]])) for low, high in pieces
        ]
