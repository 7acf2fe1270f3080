"""Peak memory of reading and examining a recording, by its number of frames, at 1920x1440.

    python benchmarks/memory.py [--frames 250 500 1000] [--sample scan.r3d] [--update] [--workdir DIR]

A synthetic kitchen's frames (colour enlarged to 1920x1440) are repeated along its path until the recording is long enough, so
that the fused room and the file sizes are realistic. Each recording is read, and examined by the capture doctor, in a separate
process with all its frames kept. --update writes the figures under "memory" in benchmarks/capture.json.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from measure import run_measured

from r2c2r_core.ingest.doctor import examine
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture

REPOSITORY = Path(__file__).resolve().parents[1]
FIGURES = Path(__file__).resolve().parent / "capture.json"
SIZE = (1920, 1440)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the recordings, read each, print and save the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, nargs="+", default=[250, 500, 1000])
    parser.add_argument("--sample", type=Path, help="a synthetic Record3D recording (default: made, 60 frames)")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--workdir", type=Path)
    parser.add_argument("--read", type=Path, nargs=2, metavar=("SOURCE", "STORE"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.read:
        source, store = options.read
        examine(read_capture(source, store, IngestConfig(most_frames=10**6)), open_recording(source))
        return 0
    with tempfile.TemporaryDirectory(prefix="r2c2r-memory-", dir=options.workdir) as folder:
        figures = measure(options.frames, options.sample or _sample(Path(folder)), Path(folder))
    print(json.dumps(figures, indent=1, sort_keys=True))
    if options.update:
        update_figures("memory", figures)
    return 0


def measure(counts: Sequence[int], sample: Path, folder: Path) -> dict[str, Any]:
    """Peak resident memory and seconds per frame, by number of frames."""
    peaks, speeds = {}, {}
    for count in counts:
        source = lengthened(sample, folder / "long.r3d", count)
        command = [sys.executable, str(Path(__file__).resolve()), "--read", str(source), str(folder / "store")]
        cost = run_measured(command, cwd=REPOSITORY, log=folder / "log.txt")
        if cost.exit_code:
            raise RuntimeError((folder / "log.txt").read_text())
        peaks[str(count)], speeds[str(count)] = round(cost.peak_bytes / 2**20), round(cost.wall_s / count * 1000, 1)
        print(f"{count} frames: {peaks[str(count)]} MiB, {speeds[str(count)]} ms a frame", file=sys.stderr, flush=True)
    return {
        "import_ms_per_frame": speeds,
        "import_peak_mib": peaks,
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "size_px": list(SIZE),
    }


def lengthened(sample: Path, target: Path, count: int) -> Path:
    """The recording extended to `count` frames of SIZE by playing it forwards and backwards."""
    with zipfile.ZipFile(sample) as short, zipfile.ZipFile(target, "w") as long:
        metadata = json.loads(short.read("metadata"))
        have = len(metadata["poses"])
        order = [have - 1 - abs(k % (2 * have - 2) - (have - 1)) for k in range(count)]
        scale = SIZE[0] / metadata["w"]
        metadata |= {
            "w": SIZE[0],
            "h": SIZE[1],
            "K": [*(scale * value for value in metadata["K"][:8]), 1.0],
        }
        metadata["perFrameIntrinsicCoeffs"] = (np.array(metadata["perFrameIntrinsicCoeffs"])[order] * scale).tolist()
        metadata["poses"] = [metadata["poses"][k] for k in order]
        metadata["frameTimestamps"] = [n / metadata["fps"] for n in range(count)]
        long.writestr("metadata", json.dumps(metadata))
        pictures = {k: _enlarged(short.read(f"rgbd/{k}.jpg")) for k in set(order)}
        for n, k in enumerate(order):
            long.writestr(f"rgbd/{n}.jpg", pictures[k])
            for ending in ("depth", "conf"):
                long.writestr(f"rgbd/{n}.{ending}", short.read(f"rgbd/{k}.{ending}"))
    return target


def update_figures(part: str, figures: dict[str, Any]) -> None:
    """Store a part's figures in benchmarks/capture.json, keeping the others."""
    document = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else {}
    FIGURES.write_text(json.dumps({**document, part: figures}, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _enlarged(jpeg: bytes) -> bytes:
    image = cv2.resize(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), SIZE, interpolation=cv2.INTER_CUBIC)
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()


def _sample(folder: Path) -> Path:
    command = [sys.executable, "-m", "r2c2r_core.cli", "sample", str(folder / "sample"), "--frames", "60", "--size", "960x720"]
    subprocess.run(command, check=True, cwd=REPOSITORY, stdout=subprocess.DEVNULL)
    return folder / "sample" / "scan.r3d"


if __name__ == "__main__":
    sys.exit(main())
