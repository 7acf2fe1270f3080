"""Accuracy of the capture doctor's verdicts and named causes, on good recordings and corrupted copies of each.

    python -m benchmarks.capture_doctor [--seeds 0-3] [--frames 50] [--size 480x360] [--data DIR] [--workdir DIR] [--json FILE]

Samples are made in the workdir and kept. DIR of --data holds the real recordings, where available. Prints a Markdown table and
writes its rows under "doctor" into benchmarks/capture.json. Exits 1 if any verdict is wrong.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.doctor import examine
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from tests.core.ingest.corruptions import CORRUPTIONS, Corruption, corrupt_r3d, corrupt_seven_scenes

REPOSITORY = Path(__file__).resolve().parents[1]
RESULTS = Path(__file__).resolve().parent / "capture.json"
KITCHEN = "kitchen-7scenes-redkitchen-seq01"
REAL = {  # verdicts of a person who looked at them
    KITCHEN: ("good",),
    "cabinet-tum-fr3-58": ("good",),
    "record3d-exr-door-handle/EXR_RGBD": ("usable with care",),  # 0.4 m of path before one door, no floor
    "record3d-exr-door-handle/derived/door-handle-repacked.r3d": ("usable with care",),
    "open3d-rgbd-5frames-synthetic": ("usable with care",),  # five frames
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One recording, and whether the doctor's verdict was right."""

    recording: str
    change: str
    verdict: str
    first: str  # the first cause named
    right: bool
    seconds: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all recordings, print, save."""
    options = _parser().parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="r2c2r-doctor-") as scratch:
        rows = []
        for row in _rows(options, Path(scratch)):
            rows.append(row)
            print(
                f"| {row.recording} | {row.change} | {row.verdict} | {row.first} | {'yes' if row.right else 'NO'} |", flush=True
            )
    right = sum(row.right for row in rows)
    print(f"\n{right} of {len(rows)} right; {max(row.seconds for row in rows):.1f} s at most")
    document = json.loads(options.json.read_text()) if options.json.exists() else {}
    kept = [{name: value for name, value in asdict(row).items() if name != "seconds"} for row in rows]  # machine-dependent
    document["doctor"] = {"right": right, "of": len(rows), "rows": kept}
    options.json.write_text(json.dumps(document, indent=1) + "\n")
    return 0 if right == len(rows) else 1


def _rows(options: argparse.Namespace, scratch: Path) -> Iterator[Row]:
    print("| recording | change | verdict | first cause | right |\n|---|---|---|---|---|")
    for seed in options.seeds:
        scan = _sample(options, seed)
        yield _clean(f"seed {seed}", scan, ("good",), scratch)
        for corruption in CORRUPTIONS:
            yield _corrupted(f"seed {seed}", corruption, corrupt_r3d(corruption, scan, _fresh(scratch) / "scan.r3d"), scratch)
    if options.data is None:
        return
    for name, expected in REAL.items():
        yield _clean(name, options.data / name, expected, scratch)
    kitchen = options.data / KITCHEN
    for corruption in CORRUPTIONS:
        if not corruption.only_r3d:
            target = corrupt_seven_scenes(corruption, kitchen, _fresh(scratch) / "kitchen", every=4)
            yield _corrupted(KITCHEN, corruption, target, scratch)
    raw = _raw_kitchen(kitchen, _fresh(scratch))
    yield _corrupted(KITCHEN, Corruption(name="its own depth_raw", causes=("unregistered",)), raw, scratch)


def _clean(name: str, source: Path, expected: tuple[str, ...], scratch: Path) -> Row:
    verdict, first, seconds = _verdict(source, scratch)
    return Row(recording=name, change="none", verdict=verdict, first=first, right=verdict in expected, seconds=seconds)


def _corrupted(name: str, corruption: Corruption, source: Path, scratch: Path) -> Row:
    verdict, first, seconds = _verdict(source, scratch)
    right = corruption.refusal in first if corruption.refusal else verdict != "good" and first in corruption.causes
    return Row(recording=name, change=corruption.name, verdict=verdict, first=first, right=right, seconds=seconds)


def _verdict(source: Path, scratch: Path) -> tuple[str, str, float]:
    started = time.monotonic()
    try:
        capture = read_capture(source, scratch / "store", IngestConfig(finest_voxel_m=0.02, fused_frames=40))
        report = examine(capture, open_recording(source))
    except CaptureError as refusal:
        return "refused", str(refusal).split(": ", 1)[-1], time.monotonic() - started
    first = report.remarks[0].cause if report.remarks else "-"
    return report.verdict, first, time.monotonic() - started


def _sample(options: argparse.Namespace, seed: int) -> Path:
    folder = options.workdir / f"seed{seed}-{options.frames}-{options.size}"
    if not (folder / "truth.json").exists():
        command = [sys.executable, "-m", "r2c2r_core.cli", "sample", str(folder), "--seed", str(seed)]
        command += ["--frames", str(options.frames), "--size", options.size]
        subprocess.run(command, check=True, cwd=REPOSITORY, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return folder / "scan.r3d"


def _raw_kitchen(kitchen: Path, folder: Path) -> Path:
    """The kitchen with its unregistered depth in place of the registered depth."""
    for name in ("color", "depth", "pose"):
        (folder / name).mkdir()
    for depth in sorted((kitchen / "depth_raw").glob("*.png")):
        shutil.copy(depth, folder / "depth")
        shutil.copy(kitchen / "color" / f"{depth.stem}.jpg", folder / "color")
        shutil.copy(kitchen / "pose" / f"{depth.stem}.txt", folder / "pose")
    for name in ("intrinsics_color.txt", "gravity-direction.txt"):
        shutil.copy(kitchen / name, folder)
    return folder


def _fresh(scratch: Path) -> Path:
    folder = scratch / "recording"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=_seeds, default=range(4))
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--size", default="480x360")
    parser.add_argument("--data", type=Path)
    parser.add_argument("--workdir", type=Path, default=Path(tempfile.gettempdir()) / "r2c2r-benchmark-doctor")
    parser.add_argument("--json", type=Path, default=RESULTS)
    return parser


def _seeds(text: str) -> range:
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


if __name__ == "__main__":
    sys.exit(main())
