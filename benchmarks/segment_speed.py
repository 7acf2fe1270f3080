"""Latency of clicks on a prepared capture, compared with GrabCut per frame and Open3D's clustering and plane detection.

    python benchmarks/segment_speed.py SAMPLE [--workdir DIR] [--clicks N] [--objects a,b] [--no-stream] [--update]

SAMPLE is a folder of `r2c2r sample`. For every object: the first click, the same object clicked at N random pixels of its
true masks, a second click, and all frames. --update writes the key "speed" of benchmarks/segment.json.

Times are wall clock; `cpu` beside them is the CPU time of the process, which is less affected by other load.
"""

import argparse
import json
import os
import platform
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app.jobs.mask_wire import mask_bits
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace

RESULTS = Path(__file__).resolve().parent / "segment.json"
_PREVIEW_WIDTH = 960  # width of the app's masks
_SEEN_PX = 400  # smaller true masks are neither clicked nor compared


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure one sample and print the numbers as JSON."""
    options = _parser().parse_args(arguments)
    with _folder(options.workdir) as folder:
        capture = _capture(options.sample, folder)
        numbers = measure(options.sample, capture, folder / "cache", options)
    print(json.dumps(numbers, indent=1))
    if options.update:
        document = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {"version": 1}
        document["speed"] = numbers
        RESULTS.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


def measure(sample: Path, capture: Capture, cache: Path, options: argparse.Namespace) -> dict[str, Any]:
    """All numbers of one sample."""
    camera = capture.frames[0].rgb_camera
    numbers: dict[str, Any] = {
        "sample": {"frames": len(capture.frames), "size": [camera.width, camera.height]},
        "machine": {"cpu": _processor(), "cores": os.cpu_count(), "load": round(os.getloadavg()[0], 1)},
    }
    if not options.warm:
        shutil.rmtree(cache, ignore_errors=True)
        with _timed() as first:
            open_session(capture, cache).prepare()
        numbers["prepare"] = first.seconds
    with _timed() as second:
        session = open_session(capture, cache)
    numbers["reopen"] = second.seconds
    fresh = open_session(capture, cache)  # has no object yet
    prompts = [p for p in read_prompts(sample / "prompts.json").objects if not options.objects or p.name in options.objects]
    truth = {prompt.name: _truth(sample, prompt.name) for prompt in prompts}
    rng = np.random.default_rng(options.seed)
    first_clicks: list[_Span] = []
    second_clicks: list[_Span] = []
    objects: dict[str, Any] = {}
    for prompt in prompts:
        clicks = [prompt, *_random_clicks(prompt, truth[prompt.name], options.clicks, rng)]
        spans = [_click(session, click) for click in clicks]
        again = [_click(session, _with_second(click, truth[prompt.name], rng)) for click in clicks[:2]]
        first_clicks += spans
        second_clicks += again
        entry: dict[str, Any] = {"first_ms": [span.millis for span in spans], "second_ms": [span.millis for span in again]}
        if options.stream:
            entry |= _stream(session, fresh, prompt, truth[prompt.name])
        objects[prompt.name] = entry
        print(prompt.name, entry, file=sys.stderr, flush=True)
    numbers |= {"first_click": _distribution(first_clicks), "second_click": _distribution(second_clicks)}
    if options.stream:
        numbers["stream"] = _by_kind(objects)
    numbers["objects"] = objects
    numbers["peak_memory_gb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2)
    numbers["peers"] = _peers(capture, prompts, truth) if options.peers else {}
    return numbers


@dataclass(slots=True)
class _Span:
    """Duration of a piece of work."""

    wall_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def seconds(self) -> dict[str, float]:
        return {"s": round(self.wall_s, 2), "cpu_s": round(self.cpu_s, 2)}

    @property
    def millis(self) -> list[float]:
        """Wall and CPU milliseconds."""
        return [round(self.wall_s * 1000, 1), round(self.cpu_s * 1000, 1)]


@contextmanager
def _timed() -> Iterator[_Span]:
    span = _Span()
    wall, cpu = time.perf_counter(), time.process_time()
    yield span
    span.wall_s, span.cpu_s = time.perf_counter() - wall, time.process_time() - cpu


def _click(session: SegmentSession, prompt: ObjectPrompt) -> _Span:
    """Time from a click to the first mask in the frame that was clicked last, as in the app."""
    with _timed() as span:
        try:
            first = session.glimpse(prompt) or next(session.stream(prompt))
            mask_bits(first[1], _PREVIEW_WIDTH)
        except Exception as error:  # a click may miss; its time still counts
            print(f"{prompt.name}: {error}", file=sys.stderr)
    return span


def _stream(session: SegmentSession, fresh: SegmentSession, prompt: ObjectPrompt, truth: dict[int, Path]) -> dict[str, Any]:
    """All frames of one object: masks per second, their quality, and the agreement of the first mask with them."""
    with _timed() as span:
        masks = {index: packed for index, packed, _ in session.stream(prompt)}
    overlaps = []
    for index, path in truth.items():
        true = _mask(path)
        if true.sum() >= _SEEN_PX:
            overlaps.append(mask_iou(unpack_mask(masks[index]), true) if index in masks else 0.0)
    kind = session.track(prompt).kind
    coarse = fresh.glimpse(prompt)
    return {
        "kind": kind,
        "frames": len(masks),
        "fps": round(len(masks) / span.wall_s, 1),
        "cpu_fps": round(len(masks) / span.cpu_s, 1),
        "iou": round(float(np.mean(overlaps)), 4) if overlaps else None,
        "preview_iou": round(mask_iou(unpack_mask(coarse[1]), unpack_mask(masks[coarse[0]])), 3) if coarse else None,
    }


def _by_kind(objects: dict[str, Any]) -> dict[str, Any]:
    """The slowest and the mean of each kind."""
    kinds = sorted({entry["kind"] for entry in objects.values()})
    table = {}
    for kind in kinds:
        members = [entry for entry in objects.values() if entry["kind"] == kind]
        table[kind] = {
            "least_fps": min(entry["fps"] for entry in members),
            "least_cpu_fps": min(entry["cpu_fps"] for entry in members),
            "least_preview_iou": min((entry["preview_iou"] for entry in members if entry["preview_iou"]), default=None),
            "mean_iou": round(float(np.mean([entry["iou"] for entry in members if entry["iou"] is not None])), 4),
        }
    return table


def _distribution(spans: list[_Span]) -> dict[str, Any]:
    result: dict[str, Any] = {"clicks": len(spans)}
    for name, values in (("wall", [span.wall_s for span in spans]), ("cpu", [span.cpu_s for span in spans])):
        millis = np.array(values) * 1000
        result[f"{name}_ms"] = {
            "p50": round(float(np.quantile(millis, 0.5)), 1),
            "p95": round(float(np.quantile(millis, 0.95)), 1),
            "max": round(float(millis.max()), 1),
        }
    return result


def _random_clicks(prompt: ObjectPrompt, truth: dict[int, Path], count: int, rng: np.random.Generator) -> list[ObjectPrompt]:
    """Alternative prompts of the object: random pixels of its true masks, each in a different frame."""
    found = []
    for index in rng.permutation(sorted(truth)).tolist():
        if len(found) == count:
            break
        point = _pixel_of(truth[index], index, rng)
        if point is not None:
            found.append(replace(prompt, points=(point,)))
    return found


def _with_second(prompt: ObjectPrompt, truth: dict[int, Path], rng: np.random.Generator) -> ObjectPrompt:
    """The prompt with one more click on the object, in another frame."""
    for index in rng.permutation(sorted(truth)).tolist():
        point = _pixel_of(truth[index], index, rng)
        if point is not None and index != prompt.points[0].frame:
            return replace(prompt, points=(*prompt.points, point))
    return prompt


def _pixel_of(path: Path, frame_index: int, rng: np.random.Generator) -> PromptPoint | None:
    """A pixel at least three inside the mask; None if the mask is too small for a click."""
    mask = _mask(path)
    rows, columns = np.nonzero(cv2.erode(mask.astype(np.uint8), np.ones((7, 7), np.uint8)))
    if mask.sum() < _SEEN_PX or len(rows) == 0:
        return None
    i = int(rng.integers(len(rows)))
    return PromptPoint(frame=frame_index, x=float(columns[i]) + 0.5, y=float(rows[i]) + 0.5, label=1)


def _peers(capture: Capture, prompts: Sequence[ObjectPrompt], truth: dict[str, dict[int, Path]]) -> dict[str, Any]:
    """The same work by common tools: GrabCut from an object's true box, Open3D's clusters and planes of the surface."""
    times, overlaps = [], []
    for prompt in prompts[::3]:
        frame = prompt.points[0].frame
        true = _mask(truth[prompt.name][frame])
        rows, columns = np.flatnonzero(true.any(axis=1)), np.flatnonzero(true.any(axis=0))
        box = (int(columns[0]), int(rows[0]), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1)
        labels = np.zeros(true.shape, np.uint8)
        with _timed() as span:
            image = np.ascontiguousarray(capture.images.rgb(frame))
            cv2.grabCut(image, labels, box, np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_RECT)
        times.append(span)
        overlaps.append(mask_iou((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD), true))
    peers: dict[str, Any] = {
        "grabcut": _distribution(times) | {"note": "given the true box, one frame", "iou": round(float(np.mean(overlaps)), 3)}
    }
    try:
        import open3d
    except ImportError:
        return peers
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(capture.surface.vertices_world))
    with _timed() as span:
        cloud.segment_plane(distance_threshold=0.02, ransac_n=3, num_iterations=1000)
    peers["open3d_segment_plane"] = span.seconds | {"note": "one plane of the fused surface"}
    with _timed() as span:
        cloud.voxel_down_sample(0.02).cluster_dbscan(eps=0.05, min_points=10)
    peers["open3d_cluster_dbscan"] = span.seconds | {"note": "parts of the fused surface at 2 cm"}
    return peers


def _capture(sample: Path, folder: Path) -> Capture:
    """The recording, read once per workdir."""
    work = Workspace(folder / "work")
    found: Capture | None = work.load_latest("ingest", "scene")
    if found is not None:
        return found
    capture = read_capture(sample / "scan.r3d", work.store(sample.name), IngestConfig())
    work.save("ingest", "scene", capture, {"key": "benchmark", "seconds": 0.0})
    return capture


def _truth(sample: Path, name: str) -> dict[int, Path]:
    return {int(path.stem): path for path in sorted((sample / "truth_masks" / name).glob("*.png"))}


def _mask(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise SystemExit(f"{path}: not a readable mask")
    return np.asarray(image > 127)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


@contextmanager
def _folder(given: Path | None) -> Iterator[Path]:
    if given is not None:
        yield given
        return
    with tempfile.TemporaryDirectory(prefix="r2c2r-speed-") as folder:
        yield Path(folder)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Click latency and propagation speed on a sample with exact truth.")
    parser.add_argument("sample", type=Path, help="folder of `r2c2r sample`")
    parser.add_argument("--workdir", type=Path, help="kept afterwards; the capture read into it is reused")
    parser.add_argument("--clicks", type=int, default=5, help="random clicks per object, besides the one of prompts.json")
    parser.add_argument("--objects", type=lambda text: set(text.split(",")), default=set(), help="comma-separated, default all")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random clicks")
    parser.add_argument("--warm", action="store_true", help="keep the prepared cache and skip measuring the preparation")
    parser.add_argument("--no-stream", dest="stream", action="store_false", help="measure clicks only")
    parser.add_argument("--no-peers", dest="peers", action="store_false", help="skip GrabCut and Open3D")
    parser.add_argument("--update", action="store_true", help=f"write {RESULTS.name}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
