"""Interface of a mesh generator."""

from abc import abstractmethod
from typing import Protocol

from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.model.mesh import MeshAsset


class MeshGenerator(Protocol):
    """Generator of one candidate at a time: closed, in its own frame and unit, with its pose where that is known.

    A backend names this class as its base, so that the type checker compares them.
    """

    @abstractmethod
    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate; the same seed gives the same mesh. Raises GenerationFailed (or ValueError) on failure."""
