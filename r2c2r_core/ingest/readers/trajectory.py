"""Time association of poses and files with images: interpolation and nearest neighbour."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3


class Trajectory(NamedTuple):
    """Timed camera-to-world poses, sorted by time."""

    times_s: np.ndarray  # (n,)
    poses: Sequence[Rigid3]

    def at(self, time_s: float, *, apart_s: float, gap_s: float) -> Rigid3 | None:
        """The pose at that time: slerp and linear between neighbours less than `gap_s` apart, else the nearer one's.

        None when no pose lies within `apart_s`.
        """
        from scipy.spatial.transform import Rotation, Slerp

        nearest = int(np.argmin(np.abs(self.times_s - time_s)))
        if abs(self.times_s[nearest] - time_s) > apart_s:
            return None
        after = int(np.searchsorted(self.times_s, time_s))
        if not 0 < after < len(self.times_s) or self.times_s[after] - self.times_s[after - 1] >= gap_s:
            return self.poses[nearest]
        a, b = self.poses[after - 1], self.poses[after]
        if not (np.isfinite(a.matrix).all() and np.isfinite(b.matrix).all()):
            return self.poses[nearest]  # an unusable pose is reported where frames are joined
        start_s, end_s = self.times_s[after - 1 : after + 1]
        share = (time_s - start_s) / (end_s - start_s)
        turn = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([a.rotation, b.rotation])))(share)
        return Rigid3(turn.as_matrix(), a.translation + share * (b.translation - a.translation))


def named_at(times_s: Mapping[int, float], named: Mapping[float, str], apart_s: float) -> dict[int, str]:
    """The file nearest in time to each frame, where one lies within `apart_s`; `named` are files by their times."""
    stamps = np.array(sorted(named))
    matched = {}
    for number, time_s in times_s.items():
        after = int(np.searchsorted(stamps, time_s))
        nearest = min(stamps[max(after - 1, 0) : after + 1], key=lambda stamp: abs(stamp - time_s), default=np.inf)
        if abs(nearest - time_s) <= apart_s:
            matched[number] = named[float(nearest)]
    return matched
