"""UV charts of xatlas, computed in a process of its own: `python -m r2c2r_core.generate.unwrap` answers one request.

Freeing an atlas of xatlas 0.0.11 can block for ever while it holds the GIL: its destructor wakes its worker threads without
their mutex, and a thread about to wait misses that. The process therefore exits without freeing it.
"""

import io
import os
import subprocess
import sys

import numpy as np

from r2c2r_core.arrays import Faces, Points, TextureCoords
from r2c2r_core.errors import EnvironmentProblem


def unwrap(vertices: Points, faces: Faces) -> tuple[np.ndarray, Faces, TextureCoords]:
    """The original vertex (n,) of each skin vertex, the faces (m, 3) of skin vertices, and their UV coordinates (n, 2)."""
    request = io.BytesIO()
    np.savez(request, vertices=vertices.astype(np.float32), faces=faces.astype(np.uint32))
    command = [sys.executable, "-m", "r2c2r_core.generate.unwrap"]
    try:
        answer = subprocess.run(command, input=request.getvalue(), stdout=subprocess.PIPE, check=True).stdout
    except OSError as error:
        raise EnvironmentProblem(f"no process can be started ({error})", hint="free some memory, then retry") from error
    with np.load(io.BytesIO(answer)) as skin:
        return skin["source"].astype(np.int64), skin["faces"].astype(np.int64), skin["uv"].astype(np.float64)


def main() -> None:
    """Read a mesh from standard input and write its skin to standard output, both as npz archives."""
    import xatlas

    with np.load(io.BytesIO(sys.stdin.buffer.read())) as mesh:
        atlas = xatlas.Atlas()
        atlas.add_mesh(mesh["vertices"], mesh["faces"])
    atlas.generate()
    source, faces, uv = atlas[0]
    answer = io.BytesIO()
    np.savez(answer, source=source, faces=faces, uv=uv)
    sys.stdout.buffer.write(answer.getvalue())
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
