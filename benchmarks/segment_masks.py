"""Mask accuracy of the weight-free segmenter against exact truth, on synthetic kitchens.

    python benchmarks/segment_masks.py --samples DIR [--seeds 0-9] [--every N] [--workdir DIR] [--random N]
                                       [--overlays DIR] [--keep] [--update]

DIR holds seed<N>/ as `r2c2r sample` writes it. One click per object (the sample's own), then a second one as an annotator would
place it: among a few frames shown, in the worst, at the centre of the largest wrong region. --random adds N one-click trials
per object from clicks anywhere on it. Every Nth frame that shows 400 px of the object counts, at RGB resolution. --overlays
draws the worst frames; --update writes the key "masks" of benchmarks/segment.json.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from run import _seeds

from r2c2r_core.arrays import Image, Mask
from r2c2r_core.errors import R2C2RError
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX, read_mask
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace

RESULTS = Path(__file__).resolve().parent / "segment.json"
BARS = {"front": (0.92, None), "appliance": (0.90, None), "thing": (0.80, 0.90)}  # after one click, after two
SHOWN = 6  # frames that an annotator inspects before the second click


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Result for one object in one frame."""

    seed: int
    name: str
    category: str
    clicks: str  # "one", "two" or "random"
    frame: int
    iou: float
    confidence: float

    @property
    def kind(self) -> str:
        """The object's kind: front, appliance or thing."""
        return category_of(self.category).kind


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and save the figures."""
    options = _parser().parse_args(arguments)
    seen: list[Seen] = []
    for seed in options.seeds:
        started = time.monotonic()
        seen += measure_seed(seed, options)
        print(f"seed {seed}: {time.monotonic() - started:.0f} s\n{report([s for s in seen if s.seed == seed])}", flush=True)
    print(f"\nall seeds\n{report(seen)}")
    summary = {"seeds": options.seeds, "every": options.every, **summarise(seen)}
    if options.rows:
        options.rows.write_text(json.dumps([asdict(s) for s in seen]), encoding="utf-8")
    if options.update:
        document = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
        RESULTS.write_text(json.dumps(document | {"masks": summary}, indent=1) + "\n", encoding="utf-8")
    return 0


def measure_seed(seed: int, options: argparse.Namespace) -> Iterator[Seen]:
    """Every object of one sample: after one click, after two, and from random clicks."""
    sample, work = options.samples / f"seed{seed}", Workspace(options.workdir / f"seed{seed}")
    prompts = read_prompts(sample / "prompts.json")
    session = open_session(ingested(sample / "scan.r3d", work, keep=options.keep), work.cache)
    assert isinstance(session, GeometricSession)
    for prompt in prompts.objects:
        if options.only and prompt.category not in options.only.split(",") and prompt.name not in options.only.split(","):
            continue
        truth = _truth(sample / "truth_masks" / prompt.name)
        if not truth:
            continue
        trial = _Trial(seed, session, truth, sorted(truth)[:: options.every], options.overlays)
        yield from trial.measure(prompt, "one")
        second = trial.with_second_click(prompt)
        yield from trial.measure(second, "two")
        rng = np.random.default_rng(seed)
        for _ in range(options.random):
            yield from trial.measure(trial.clicked_anywhere(prompt, rng), "random", stride=3)


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    seed: int
    session: GeometricSession
    truth: dict[int, Mask]
    frames: list[int]
    overlays: Path | None

    def measure(self, prompt: ObjectPrompt, clicks: str, stride: int = 1) -> list[Seen]:
        rows = []
        for frame in self.frames[::stride]:
            mask, confidence = self.mask(prompt, frame)
            iou = mask_iou(self.truth[frame], mask)
            rows.append(
                Seen(
                    seed=self.seed,
                    name=prompt.name,
                    category=prompt.category,
                    clicks=clicks,
                    frame=frame,
                    iou=iou,
                    confidence=confidence,
                )
            )
        if self.overlays is not None and clicks != "random":
            self._draw(prompt, clicks, rows)
        return rows

    def mask(self, prompt: ObjectPrompt, frame: int) -> tuple[Mask, float]:
        """Mask and confidence from the session; an empty mask if it does not find the object."""
        try:
            view = self.session.find(prompt).see(self.session.scene.frame(frame))
            return view.mask, view.trust
        except R2C2RError as error:
            if frame == self.frames[0]:
                print(f"seed {self.seed}: {error}", file=sys.stderr)
            return np.zeros_like(self.truth[frame]), 0.0

    def with_second_click(self, prompt: ObjectPrompt) -> ObjectPrompt:
        """The prompt with a further click in the worst of the frames shown, at the centre of the largest wrong region."""
        numbers = sorted(self.truth)
        shown = sorted({prompt.points[0].frame, *numbers[:: max(1, len(numbers) // SHOWN)]} & set(numbers))
        masks = {frame: self.mask(prompt, frame)[0] for frame in shown}
        worst = min(shown, key=lambda frame: mask_iou(self.truth[frame], masks[frame]))
        return _added(prompt, correction(worst, self.truth[worst], masks[worst]))

    def clicked_anywhere(self, prompt: ObjectPrompt, rng: np.random.Generator) -> ObjectPrompt:
        """One click, at least three pixels inside the object, in any frame that shows it."""
        frame = int(rng.choice(sorted(self.truth)))
        rows, columns = np.nonzero(cv2.erode(self.truth[frame].astype(np.uint8), np.ones((7, 7), np.uint8)))
        if len(rows) == 0:
            return prompt
        at = int(rng.integers(len(rows)))
        point = PromptPoint(frame=frame, x=float(columns[at]) + 0.5, y=float(rows[at]) + 0.5, label=1)
        return replace(prompt, points=(point,))

    def _draw(self, prompt: ObjectPrompt, clicks: str, rows: list[Seen]) -> None:
        """The worst frame, the median one and the click's: truth in green, ours in red."""
        assert self.overlays is not None
        self.overlays.mkdir(parents=True, exist_ok=True)
        ordered = sorted(rows, key=lambda row: row.iou)
        tiles = [self._tile(prompt, ordered[k]) for k in (0, len(ordered) // 8, len(ordered) // 2)]
        mean = float(np.mean([row.iou for row in rows]))
        path = self.overlays / f"{prompt.category}-{mean:.2f}-seed{self.seed}-{prompt.name}-{clicks}.jpg"
        cv2.imwrite(str(path), np.hstack(tiles))

    def _tile(self, prompt: ObjectPrompt, row: Seen) -> np.ndarray:
        truth, (mask, _) = self.truth[row.frame], self.mask(prompt, row.frame)
        clicks = [point for point in prompt.points if point.frame == row.frame]
        tile = outlined(self.session.scene.rgb(row.frame), truth, mask, clicks)
        label = f"frame {row.frame} IoU {row.iou:.2f} conf {row.confidence:.2f}"
        cv2.putText(tile, label, (4, 434), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1)
        return tile


def outlined(rgb: Image, truth: Mask, mask: Mask, clicks: Sequence[PromptPoint] = ()) -> np.ndarray:
    """A tile (BGR) of a frame's relevant part: truth outlined in green, ours in red."""
    image = np.ascontiguousarray(rgb[:, :, ::-1])
    for shape, colour in ((truth, (0, 255, 0)), (mask, (0, 0, 255))):
        outline, _ = cv2.findContours(shape.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, outline, -1, colour, 1)
    for point in clicks:
        cv2.circle(image, (int(point.x), int(point.y)), 4, (255, 255, 0) if point.label else (255, 0, 255), -1)
    y, x = np.nonzero(truth | mask)
    image = image[max(y.min() - 20, 0) : y.max() + 20, max(x.min() - 20, 0) : x.max() + 20]
    scale = min(420 / image.shape[1], 420 / image.shape[0])
    image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST if scale > 1 else cv2.INTER_AREA)
    tile = np.zeros((440, 430, 3), np.uint8)
    tile[: image.shape[0], : image.shape[1]] = image
    return tile


def ingested(source: Path, work: Workspace, *, keep: bool) -> Capture:
    """The capture of a recording, cached in the workspace; `keep` reuses a cached one of any version."""
    if not (keep and work.load_latest("ingest", "scene")):
        reconstruct(Request(source=source, prompts=Prompts(objects=())), work, until="ingest")
    capture = work.load_latest("ingest", "scene")
    assert isinstance(capture, Capture)
    return capture


def correction(frame: int, truth: Mask, found: Mask) -> PromptPoint:
    """A click at the centre of the largest wrong region: positive where the mask is missing, negative where it is too large."""
    best: tuple[float, PromptPoint] | None = None
    for label, wrong in ((1, truth & ~found), (0, found & ~truth)):
        depth = cv2.distanceTransform(np.pad(wrong, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
        y, x = np.unravel_index(int(depth.argmax()), depth.shape)
        _, regions = cv2.connectedComponents((depth > 1.5).astype(np.uint8))
        size = float((regions == regions[y, x]).sum()) if regions[y, x] else float(wrong.any())
        point = PromptPoint(frame=frame, x=float(x) + 0.5, y=float(y) + 0.5, label=1 if label else 0)
        if wrong.any() and (best is None or size > best[0]):
            best = size, point
    if best is None:
        y, x = np.argwhere(truth).mean(axis=0)
        return PromptPoint(frame=frame, x=float(x) + 0.5, y=float(y) + 0.5, label=1)
    return best[1]


def summarise(seen: list[Seen]) -> dict[str, object]:
    """Mean IoU over objects of the mean over frames, by group and by category; and the quality of the confidence."""
    one = [row for row in seen if row.clicks == "one"]
    return {
        "groups": {kind: {clicks: _mean_of(seen, kind, clicks) for clicks in ("one", "two", "random")} for kind in BARS},
        "categories": {c: round(_mean([r for r in one if r.category == c]), 4) for c in sorted({r.category for r in one})},
        "confidence": _confidence(one),
    }


def report(seen: list[Seen]) -> str:
    """The same figures as text, with the worst objects."""
    lines = []
    for kind, (bar, second_bar) in BARS.items():
        figures = {clicks: _mean_of(seen, kind, clicks) for clicks in ("one", "two", "random")}
        shown = "  ".join(f"{clicks} {value:.3f}" for clicks, value in figures.items() if value is not None)
        lines.append(f"  {kind:10} {shown}   (bar {bar}{f', {second_bar} with two' if second_bar else ''})")
    one = [row for row in seen if row.clicks == "one"]
    objects = sorted({(row.seed, row.name) for row in one})
    rated = []
    for seed, name in objects:
        rows = {c: [r for r in seen if (r.seed, r.name, r.clicks) == (seed, name, c)] for c in ("one", "two", "random")}
        rated.append((_mean(rows["one"]), seed, name, _mean(rows["two"]), _mean(rows["random"]), len(rows["one"])))
    for iou, seed, name, two, anywhere, count in sorted(rated)[: max(12, len(rated) // 5)]:
        lines.append(f"    {iou:.3f}  seed {seed} {name:22} two {two:.3f}  random {anywhere:.3f}  {count} frames")
    lines.append(
        "  " + ", ".join(f"{c} {_mean([r for r in one if r.category == c]):.3f}" for c in sorted({r.category for r in one}))
    )
    lines.append(f"  confidence: {_confidence(one)}")
    return "\n".join(lines)


def _mean_of(seen: list[Seen], kind: str, clicks: str) -> float | None:
    rows = [row for row in seen if row.kind == kind and row.clicks == clicks]
    return round(_mean(rows), 4) if rows else None


def _mean(rows: list[Seen]) -> float:
    """Mean over objects of the mean over frames, so that large objects weigh no more than small ones."""
    objects = sorted({(row.seed, row.name) for row in rows})
    means = [np.mean([row.iou for row in rows if (row.seed, row.name) == key]) for key in objects]
    return float(np.mean(means)) if means else float("nan")


def _confidence(rows: list[Seen]) -> dict[str, float]:
    """Rank correlation of the confidence with the IoU, and its mean absolute error."""
    from scipy.stats import spearmanr

    iou, confidence = np.array([row.iou for row in rows]), np.array([row.confidence for row in rows])
    if len(rows) < 3:
        return {}
    return {
        "spearman": round(float(spearmanr(iou, confidence).statistic), 3),
        "off_by": round(float(np.abs(iou - confidence).mean()), 3),
    }


def _truth(folder: Path) -> dict[int, Mask]:
    masks = {int(path.stem): read_mask(path) for path in sorted(folder.glob("*.png"))}
    return {frame: mask for frame, mask in masks.items() if np.count_nonzero(mask) >= MIN_TRUTH_PX}


def _added(prompt: ObjectPrompt, point: PromptPoint) -> ObjectPrompt:
    return replace(prompt, points=(*prompt.points, point))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Mask accuracy on synthetic kitchens with exact truth.")
    parser.add_argument("--samples", type=Path, required=True, help="folder with seed<N>/ as r2c2r sample writes it")
    parser.add_argument("--seeds", type=_seeds, default=_seeds("0-9"))
    parser.add_argument("--every", type=int, default=1, help="use every Nth frame that shows the object")
    parser.add_argument("--workdir", type=Path, required=True, help="keeps captures between runs")
    parser.add_argument("--random", type=int, default=0, help="number of one-click trials from anywhere on the object")
    parser.add_argument("--only", help="comma-separated categories or names")
    parser.add_argument("--overlays", type=Path)
    parser.add_argument("--rows", type=Path, help="JSON file for the result of every object in every frame")
    parser.add_argument("--keep", action="store_true", help="use the capture in the workdir whatever version made it")
    parser.add_argument("--update", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
