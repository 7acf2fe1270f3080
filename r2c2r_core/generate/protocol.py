"""What a mesh generator must offer."""

from typing import Protocol

from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.model.mesh import MeshAsset


class MeshGenerator(Protocol):
    """Makes one candidate at a time; each is closed, and leaves in a frame and unit of its own."""

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate; the same seed gives the same mesh. Raises GenerationFailed (or ValueError) when it cannot."""
