"""Contradictions between the objects that a person clicked."""

from dataclasses import dataclass
from typing import Literal

ContradictionRule = Literal[
    "same-thing", "masks-overlap", "click-disobeyed", "size-unlikely", "in-the-air", "in-a-wall", "edge-unsure"
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """One contradiction for a person: its objects, their clicks, and a suggested fix."""

    rule: ContradictionRule
    objects: tuple[str, ...]
    message: str  # names the objects and their clicks
    mend: str

    @property
    def line(self) -> str:
        """Message and fix in one line."""
        return f"{self.message}; {self.mend}"
