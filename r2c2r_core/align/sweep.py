"""Photometric yaw search for poses that geometry leaves unconstrained (bodies of revolution)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.align.judge import judge
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.refine import loosest_motion, moved
from r2c2r_core.align.residuals import Anchors, pivot_of
from r2c2r_core.align.shape import Shape
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the photometric sweep."""

    loose: float = param(
        0.01,
        "ratio",
        "Minimum standard deviation of the least constrained motion at the rim, relative to the size, for a sweep",
        source="half a degree",
    )
    spans: tuple[float, float] = param(
        (0.075, 0.02),
        "ratio",
        "Half widths of the successive sweeps at the rim, relative to the size",
        source="8 degrees, the spacing of the rotation hypotheses; 2 degrees",
    )
    steps: int = param(9, "count", "Number of poses per sweep", ge=3)


def sweep_loosest(
    pose: Similarity3, shape: Shape, observation: Observation, anchors: Anchors, lifted: Sequence[Lifted]
) -> Similarity3:
    """The pose moved along its least constrained motion to the best agreement of masks, depth and colours.

    Unchanged where every motion is constrained, and where no pose along the motion scores better.
    """
    params = tuned(Params)
    motion, spread_m = loosest_motion(pose, shape, observation, anchors, lifted)
    if spread_m < params.loose * observation.size_m:
        return pose
    pivot = pivot_of(pose, shape)

    def scores(places: np.ndarray) -> np.ndarray:
        poses = [moved(pose, float(x) * motion, pivot) for x in places]
        return np.array([judge(p, shape, observation.views, anchors.front).score for p in poses])

    at = 0.0
    for span in params.spans:
        places = at + np.linspace(-span, span, params.steps) * observation.size_m
        found = scores(places)
        at = float(places[int(np.argmax(found))])
    bend, slope, _ = np.polyfit(places - at, found, 2)  # single scores are noisy because of pixel sampling
    if bend < 0 and abs(0.5 * slope / bend) < params.spans[-1] * observation.size_m:
        at -= float(0.5 * slope / bend)
    before, after = scores(np.array([0.0, at]))
    return moved(pose, at * motion, pivot) if after > before else pose
