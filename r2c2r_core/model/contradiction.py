"""What cannot be true at once of the objects a person clicked."""

from dataclasses import dataclass
from typing import Literal

ContradictionRule = Literal[
    "same-thing", "masks-overlap", "click-disobeyed", "size-unlikely", "in-the-air", "in-a-wall", "edge-unsure"
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """One line for a person: what contradicts what, at which clicks, and what would mend it."""

    rule: ContradictionRule
    objects: tuple[str, ...]
    message: str  # names the objects and their clicks
    mend: str

    @property
    def line(self) -> str:
        """Both in one line."""
        return f"{self.message}; {self.mend}"
