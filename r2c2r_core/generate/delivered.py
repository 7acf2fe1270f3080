"""Import of a mesh from an external model as a candidate: checked, closed, with a record of the changes."""

import zlib

import numpy as np

from r2c2r_core.errors import GenerationFailed, OverrideError
from r2c2r_core.generate.asset import shape_metrics, unposed
from r2c2r_core.generate.meshfile import MeshPart
from r2c2r_core.generate.repair import mended
from r2c2r_core.geometry.meshes import is_watertight, join_vertices
from r2c2r_core.model.mesh import MeshAsset


def delivered_asset(
    parts: list[MeshPart],
    *,
    object_name: str,
    candidate_id: str,
    generator: str,
    seed: int,
    frames: tuple[int, ...],
    parameters: dict[str, float],
    metrics: dict[str, float] | None = None,
    warnings: tuple[str, ...] = (),
    assumes: str = "",
) -> MeshAsset:
    """The parts as one closed candidate in its own frame and unit; raises GenerationFailed for what cannot be closed.

    Its pose is discarded, since placement is the next stage's task, and a +Y-up GLB is rotated like every other mesh.
    """
    rng = np.random.default_rng([zlib.crc32(object_name.encode()), zlib.crc32(candidate_id.encode()), seed])
    try:
        closed, notes = mended(parts, f"{generator} {candidate_id}")
    except OverrideError as error:
        raise GenerationFailed(f"{object_name}: {error.message}", hint="another sample or generator may do better") from error
    mesh = unposed(closed, rng)
    return MeshAsset(
        object_name=object_name,
        candidate_id=candidate_id,
        mesh=mesh,
        generator=generator,
        seed=seed,
        watertight=is_watertight(mesh.vertices, mesh.faces),
        frames=frames,
        metrics={**(metrics or {}), **shape_metrics(*join_vertices(mesh.vertices, mesh.faces))},
        parameters={**parameters, "delivered_faces": float(sum(len(part.faces) for part in parts))},
        warnings=(*warnings, *(f"{generator} mesh: {note}" for note in notes)),
        assumes=assumes,
    )


def first_line(error: Exception) -> str:
    """First line of an exception from a model's own code; CUDA errors often fill a page."""
    return (str(error).strip() or type(error).__name__).splitlines()[0][:200]
