"""Shape hypothesis: one way to complete the unobserved part of an object."""

from collections.abc import Callable
from typing import NamedTuple

from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.variation import Variation


class Hypothesis(NamedTuple):
    """A completion and a short statement of what it assumes ("{depth_m:.2f} m deep, to the wall behind it")."""

    assumes: str  # a format string filled with the parameters of the shape of each draw
    shape: Callable[[Variation], Shape]  # raises GenerationFailed
