"""Validation of an uploaded file in a process of its own: `python -m app.jobs.probe recording|mesh FILE NAME`.

It opens a recording as the import does and decodes a few of its frames, or makes a candidate of a mesh as a run does and
reports a preview ({"seen": ...}), so that unusable files are refused during the request. NAME is the sender's file name, for
messages.
"""

import argparse
import base64
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from app.jobs.messages import run_stage, say
from r2c2r_core.errors import CaptureError, InputError
from r2c2r_core.limits import free_memory, limit_this_process

LOOKED_AT = 8  # number of frames examined
_Y_UP = (".glb", ".obj")  # glTF's axes are +Y up, and most programs write OBJ so
_DRAWN_FROM_Y_UP = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
MEMORY_SHARE = 0.7  # of the free memory at start, as it decodes untrusted files


class Look(NamedTuple):
    """Probe of one kind of file, with its CPU time limit in seconds."""

    probe: Callable[[Path], None]
    cpu_s: int


def main(arguments: list[str] | None = None) -> int:
    """Probe the file and report."""
    parser = argparse.ArgumentParser(prog="app.jobs.probe", description=__doc__)
    parser.add_argument("kind", choices=LOOKS)
    parser.add_argument("file", type=Path)
    parser.add_argument("name")
    options = parser.parse_args(arguments)
    look = LOOKS[options.kind]
    limit_this_process(memory_bytes=free_memory(MEMORY_SHARE), cpu_s=look.cpu_s, file_bytes=1 << 20)
    return run_stage("probe", lambda progress: _named(look.probe, options.file, options.name))


def probe_recording(file: Path) -> None:
    """Raise CaptureError unless the recording opens and most examined frames can be decoded."""
    import numpy as np

    from r2c2r_core.ingest.readers.protocol import UnreadableFrame
    from r2c2r_core.ingest.readers.table import open_recording
    from r2c2r_core.ingest.rgb import stored_jpeg

    recording = open_recording(file)
    frames = recording.frames[:: max(1, len(recording.frames) // LOOKED_AT)]
    problems = []
    for frame in frames:
        try:
            stored_jpeg(recording.colour_of(frame), frame.rgb_name, (frame.rgb_camera.width, frame.rgb_camera.height))
            metres = recording.depth_of(frame).metres
            if not (np.isfinite(metres) & (metres > 0)).any():
                problems.append(f"frame {frame.index}: its depth image has no measurement")
        except (UnreadableFrame, CaptureError) as problem:
            problems.append(str(problem))
    if len(problems) > len(frames) / 2:
        raise CaptureError(
            f"{file}: {len(problems)} of {len(frames)} frames cannot be used, first {problems[0]}",
            hint="export or copy the recording again",
        )


def probe_mesh(file: Path) -> None:
    """Report a preview of the mesh; raise OverrideError unless a closed candidate can be made from it."""
    import numpy as np

    from app.drawing import mesh_picture
    from r2c2r_core.generate.upload import read_mended

    mesh, notes = read_mended(file)
    up = _DRAWN_FROM_Y_UP if file.suffix.lower() in _Y_UP else np.eye(3)
    say(
        seen={
            "size": sorted(np.ptp(mesh.vertices, axis=0).tolist(), reverse=True),
            "triangles": len(mesh.faces),
            "notes": notes,
            "picture": base64.b64encode(mesh_picture(mesh, np.array(up))).decode(),
        }
    )


LOOKS = {"recording": Look(probe_recording, cpu_s=60), "mesh": Look(probe_mesh, cpu_s=240)}


def _named(probe: Callable[[Path], None], file: Path, name: str) -> None:
    """Probe the file, with errors that use the sender's file name, as it has another name here."""
    try:
        probe(file)
    except InputError as error:
        message = error.message.replace(str(file), name).replace(file.name, name)
        raise type(error)(message, hint=error.hint) from error


if __name__ == "__main__":
    sys.exit(main())
