"""Read a recording and print its contents: python examples/read_a_capture.py SCAN.r3d"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from r2c2r_core.ingest.stage import IngestConfig, read_capture


def main(scan: str) -> None:
    with tempfile.TemporaryDirectory() as store:  # colour and depth are stored here, one file per frame
        capture = read_capture(Path(scan), Path(store) / "frames", IngestConfig())
        frame = capture.frames[len(capture.frames) // 2]
        depth = capture.images.depth(frame.index)
        metres = np.median(depth.metres[depth.valid])
        print(f"{capture.name}: {capture.format}, {len(capture.frames)} frames")
        print(f"frame {frame.index}: camera at {frame.world_from_camera.translation.round(2)} m, median depth {metres:.2f} m")
        print(f"up from {capture.room.up_source}, {len(capture.room.walls)} walls, {len(capture.surface.faces)} triangles")
        for notice in capture.notices:
            print(f"notice: {notice}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
