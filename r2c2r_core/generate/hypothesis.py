"""What may be true of an object beyond what was seen: one of several completions somebody could want."""

from collections.abc import Callable
from typing import NamedTuple

from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.variation import Variation


class Hypothesis(NamedTuple):
    """A completion, and in a few words what it takes for true ("to the wall behind it")."""

    assumes: str
    shape: Callable[[Variation], Shape]  # raises GenerationFailed
