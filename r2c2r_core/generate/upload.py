"""User-supplied mesh file as an additional candidate: any unit, any frame, repaired where it is not closed."""

import zlib
from pathlib import Path

import numpy as np

from r2c2r_core.generate.asset import shape_metrics, unposed
from r2c2r_core.generate.meshfile import missing_files, read_parts
from r2c2r_core.generate.repair import Mended, mended
from r2c2r_core.geometry.meshes import is_watertight, join_vertices
from r2c2r_core.model.mesh import MeshAsset


def read_mended(path: Path) -> Mended:
    """The file as one closed, textured mesh in its own frame and unit, with a note of every repair (repair.py).

    Raises OverrideError when it cannot be used.
    """
    mesh, notes = mended(read_parts(path), path.name)
    absent = [f"{name} was not uploaded with it" for name in missing_files(path)]
    return Mended(mesh, (*absent, *notes))


def read_upload(path: Path, object_name: str, candidate_id: str) -> MeshAsset:
    """The file as a candidate: closed, textured, in an arbitrary frame; raises OverrideError when it cannot be used."""
    found, notes = read_mended(path)
    mesh = unposed(found, np.random.default_rng([zlib.crc32(object_name.encode()), zlib.crc32(candidate_id.encode())]))
    return MeshAsset(
        object_name=object_name,
        candidate_id=candidate_id,
        mesh=mesh,
        generator="upload",
        seed=0,
        watertight=is_watertight(mesh.vertices, mesh.faces),
        frames=(),
        metrics=shape_metrics(*join_vertices(mesh.vertices, mesh.faces)),
        parameters={},
        warnings=tuple(f"{path.name}: {note}" for note in notes),
    )
