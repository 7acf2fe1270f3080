"""What may be true of an object beyond what was seen: one of several completions somebody could want."""

from collections.abc import Callable
from typing import NamedTuple

from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.variation import Variation


class Hypothesis(NamedTuple):
    """A completion, and in a few words what it takes for true ("{depth_m:.2f} m deep, to the wall behind it")."""

    assumes: str  # a format that the made shape's parameters fill: each draw tells its own measures
    shape: Callable[[Variation], Shape]  # raises GenerationFailed
