"""What a mesh generator must offer."""

from abc import abstractmethod
from typing import Protocol

from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.model.mesh import MeshAsset


class MeshGenerator(Protocol):
    """Makes one candidate at a time; each is closed, in a frame and unit of its own, with its place where that is known.

    A backend names this class as its base, so that the type checker compares them.
    """

    @abstractmethod
    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate; the same seed gives the same mesh. Raises GenerationFailed (or ValueError) when it cannot."""
