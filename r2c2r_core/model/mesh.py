"""Generated meshes and candidate sets."""

from dataclasses import dataclass

from r2c2r_core.arrays import Faces, Image, Points, TextureCoords
from r2c2r_core.geometry.transforms import Similarity3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TexturedMesh:
    """Triangles with one uv per vertex (seams duplicate vertices) and an RGB texture; v = 0 is the bottom row."""

    vertices: Points
    faces: Faces
    uv: TextureCoords
    texture: Image


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshAsset:
    """One candidate, in its own `mesh` frame: arbitrary rotation, translation and unit (about a unit cube).

    A generator that works in the scan's frame knows the pose; a learned one, or a person's file, does not.
    """

    object_name: str
    candidate_id: str  # "c0", "c1" …, "upload0"
    mesh: TexturedMesh
    generator: str
    seed: int
    watertight: bool
    frames: tuple[int, ...]  # Frame.index of the frames it was made from
    metrics: dict[str, float]  # see generate/consensus.py
    parameters: dict[str, float]
    warnings: tuple[str, ...]
    world_from_mesh: Similarity3 | None = None  # pose given by its generator; None: unknown, to be searched
    assumes: str = ""  # its hypothesis of the unobserved parts, in a few words; empty: a plain sample


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CandidateSet:
    """All candidates of one object, and the one chosen."""

    object_name: str
    candidates: tuple[MeshAsset, ...]
    chosen_id: str
    chosen_by: str  # "consensus" or "person"
    reason: str  # one sentence
    ranking: tuple[str, ...]  # candidate ids, best first

    @property
    def chosen(self) -> MeshAsset:
        """The chosen candidate."""
        return self.candidate(self.chosen_id)

    def candidate(self, candidate_id: str) -> MeshAsset:
        """The candidate of that id."""
        return next(c for c in self.candidates if c.candidate_id == candidate_id)
