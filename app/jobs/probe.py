"""A first look at an uploaded recording, in a process of its own: `python -m app.jobs.probe FILE NAME`.

It opens the recording as the import will, and decodes a few of its frames, so that what cannot be read is refused while its
sender is still there. NAME is the sender's name of it, for messages.
"""

import argparse
import sys
from pathlib import Path

from app.jobs.limits import limit_this_process
from app.jobs.messages import run_stage
from r2c2r_core.errors import CaptureError

LOOKED_AT = 8  # frames
CPU_S = 60


def main(arguments: list[str] | None = None) -> int:
    """Look, say."""
    parser = argparse.ArgumentParser(prog="app.jobs.probe", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("name")
    options = parser.parse_args(arguments)
    limit_this_process(cpu_s=CPU_S, file_bytes=1 << 20)
    return run_stage("probe", lambda progress: probe(options.file, options.name))


def probe(file: Path, name: str) -> None:
    """Raise CaptureError, in the sender's words, unless the recording opens and most frames looked at can be decoded."""
    import numpy as np

    from r2c2r_core.ingest.readers.protocol import UnreadableFrame
    from r2c2r_core.ingest.readers.table import open_recording
    from r2c2r_core.ingest.rgb import stored_jpeg

    try:
        recording = open_recording(file)
        frames = recording.frames[:: max(1, len(recording.frames) // LOOKED_AT)]
        problems = []
        for frame in frames:
            try:
                stored_jpeg(recording.colour_of(frame), frame.rgb_name, (frame.rgb_camera.width, frame.rgb_camera.height))
                metres = recording.depth_of(frame).metres
                if not (np.isfinite(metres) & (metres > 0)).any():
                    problems.append(f"frame {frame.index}: its depth holds no measurement")
            except (UnreadableFrame, CaptureError) as problem:
                problems.append(str(problem))
        if len(problems) > len(frames) / 2:
            raise CaptureError(
                f"{file}: {len(problems)} of {len(frames)} frames cannot be used, first {problems[0]}",
                hint="export or copy the recording again",
            )
    except CaptureError as error:
        raise CaptureError(error.message.replace(str(file), name), hint=error.hint) from error


if __name__ == "__main__":
    sys.exit(main())
