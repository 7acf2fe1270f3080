"""Accuracy of proposals without any click, against the truth of synthetic kitchens.

    python benchmarks/segment_proposals.py SAMPLES [--seeds 0-9] [--workdir DIR] [--pictures DIR] [--update]

SAMPLES holds seed0, seed1 … as `r2c2r sample` writes them. A front is an object of the truth with a joint; it is found if a
proposal's masks have a mean IoU of 0.8 with its own, over every 9th frame that shows 400 px of it. A proposal is false if in
its own frame no true object overlaps it by IoU 0.5. Free-standing objects that the truth does not list (decoration of a
worktop) count as false. --update writes benchmarks/segment.json.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX, read_mask
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace

RESULTS = Path(__file__).resolve().parent / "segment.json"
FOUND_IOU, TRUE_IOU, EVERY = 0.8, 0.5, 9


@dataclass(slots=True)
class Match:
    """One proposal matched against the truth."""

    proposal: Proposal
    name: str | None  # of the true object with the largest overlap, at least IoU 0.5 in the proposal's own frame
    iou: float  # mean over frames


def main(arguments: Sequence[str] | None = None) -> int:
    """Propose on each seed, compare, print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", type=Path)
    parser.add_argument("--seeds", default="0-9")
    parser.add_argument("--workdir", type=Path, default=Path("proposals-work"))
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    first, _, last = options.seeds.partition("-")
    seeds = {}
    for seed in range(int(first), int(last or first) + 1):
        sample = options.samples / f"seed{seed}"
        if not (sample / "truth.json").is_file():
            print(f"{sample}: no truth.json; left out", file=sys.stderr)
            continue
        seeds[str(seed)] = bench_seed(sample, options.workdir / f"seed{seed}", options.pictures)
        print(seed, json.dumps(seeds[str(seed)]), flush=True)
        if options.update:
            store({str(seed): seeds[str(seed)]})
    if not seeds:
        return 2
    print(_table(seeds))
    return 0


def store(seeds: dict[str, dict[str, Any]]) -> None:
    """Merge these seeds' figures into the stored ones."""
    stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    merged = dict(sorted((stored.get("proposals", {}).get("seeds", {}) | seeds).items()))
    stored["proposals"] = {"seeds": merged, "all": _all(merged)}
    RESULTS.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")


def bench_seed(sample: Path, folder: Path, pictures: Path | None) -> dict[str, Any]:
    """Counts and figures of one kitchen."""
    work = Workspace(folder)
    capture = work.load_latest("ingest", "scene")
    if capture is None:
        read = read_capture(sample / "scan.r3d", work.store(sample.name), IngestConfig())
        work.save("ingest", "scene", read, {"key": "benchmark", "seconds": 0.0})
        capture = work.load_latest("ingest", "scene")
    session: Any = open_session(capture, work.cache)
    started = time.monotonic()
    proposals: tuple[Proposal, ...] = list(session.propose())[-1][1]
    seconds = time.monotonic() - started
    truth = {entry["name"]: entry for entry in json.loads((sample / "truth.json").read_text())["objects"]}
    matches = [_match(session, proposal, sample / "truth_masks") for proposal in proposals]
    for match in matches:
        p = match.proposal
        line = f"  {p.kind:9} {p.category:20} {p.confidence:.2f} -> {match.name} {match.iou:.2f}"
        print(line, [round(side, 2) for side in p.size_m], f"frame {p.click.frame}", file=sys.stderr)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for match in matches:
            _draw(session, matches, match.proposal.click.frame, pictures, sample.name)
    return _figures(matches, truth, seconds)


def _figures(matches: list[Match], truth: dict[str, Any], seconds: float) -> dict[str, Any]:
    fronts = {name for name, entry in truth.items() if entry["joints"]}
    found = {match.name for match in matches if match.name in fronts and match.iou >= FOUND_IOU}
    flat = [match for match in matches if match.proposal.kind != "thing"]
    things = [match for match in matches if match.proposal.kind == "thing"]
    named = {match.name: match for match in reversed(matches) if match.name in found and match.iou >= FOUND_IOU}
    return {
        "fronts": len(fronts),
        "fronts_found": len(found),
        "missed": sorted(fronts - found),
        "flat_proposals": len(flat),
        "false": sum(match.name is None for match in flat),
        "not_found_or_twice": len(flat) - len({m.name for m in flat if m.name in fronts and m.iou >= FOUND_IOU}),
        "category_right": sum(match.proposal.category == truth[name or ""]["category"] for name, match in named.items()),
        "with_handle": sum(bool(match.proposal.handle_px) for match in named.values()),
        "things": len(truth) - len(fronts),
        "things_found": len({match.name for match in things if match.name in truth and match.name not in fronts}),
        "thing_proposals": len(things),
        "seconds": round(seconds, 1),
    }


def _match(session: Any, proposal: Proposal, masks: Path) -> Match:
    index = proposal.click.frame
    overlaps = {
        folder.name: mask_iou(unpack_mask(proposal.outline), read_mask(folder / f"{index:06d}.png"))
        for folder in sorted(masks.iterdir())
        if (folder / f"{index:06d}.png").is_file()
    }
    name = max(overlaps, key=lambda key: overlaps[key], default=None)
    if name is None or overlaps[name] < TRUE_IOU:
        return Match(proposal, None, 0.0)
    found = session.find(ObjectPrompt(name="proposal", category=proposal.category, points=(proposal.click,)))
    frames = {frame.index: frame for frame in session.scene.frames[::EVERY]}
    ious = []
    for file in sorted((masks / name).glob("*.png")):
        frame = frames.get(int(file.stem))
        if frame is None:
            continue
        true_mask: Mask = read_mask(file)
        if np.count_nonzero(true_mask) >= MIN_TRUTH_PX:
            ious.append(mask_iou(true_mask, found.see(frame).mask))
    return Match(proposal, name, float(np.mean(ious)) if ious else 0.0)


def _draw(session: Any, matches: list[Match], frame: int, folder: Path, name: str) -> None:
    image = session.scene.rgb(frame)[..., ::-1].copy()
    for match in matches:
        proposal = match.proposal
        if proposal.click.frame != frame:
            continue
        colour = (80, 220, 80) if match.name else (60, 60, 255)
        outline = unpack_mask(proposal.outline).astype(np.uint8)
        contours, _ = cv2.findContours(outline, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        cv2.drawContours(image, contours, -1, colour, 2)
        at = (int(proposal.click.x), int(proposal.click.y))
        cv2.circle(image, at, 5, colour, -1)
        cv2.putText(image, f"{proposal.category} {proposal.confidence:.2f}", (at[0] - 60, at[1] - 8), 0, 0.5, colour, 1)
        if proposal.handle_px:
            cv2.polylines(image, [np.round(proposal.handle_px).astype(np.int32)], True, (0, 220, 255), 1)
    cv2.imwrite(str(folder / f"{name}-{frame:06d}.jpg"), image)


def _all(seeds: dict[str, dict[str, Any]]) -> dict[str, float]:
    def total(key: str) -> int:
        return sum(entry[key] for entry in seeds.values())

    return {
        "recall": round(total("fronts_found") / max(total("fronts"), 1), 4),
        "false_share": round(total("false") / max(total("flat_proposals"), 1), 4),
        "false_share_strict": round(total("not_found_or_twice") / max(total("flat_proposals"), 1), 4),
        "category_right": round(total("category_right") / max(total("fronts_found"), 1), 4),
        "with_handle": round(total("with_handle") / max(total("fronts_found"), 1), 4),
        "thing_recall": round(total("things_found") / max(total("things"), 1), 4),
        "seconds": round(total("seconds") / len(seeds), 1),
    }


def _table(seeds: dict[str, dict[str, Any]]) -> str:
    keys = [key for key in next(iter(seeds.values())) if key != "missed"]
    lines = ["| seed | " + " | ".join(keys) + " | missed |", "|---" * (len(keys) + 2) + "|"]
    lines += [f"| {s} | " + " | ".join(str(e[k]) for k in keys) + f" | {', '.join(e['missed'])} |" for s, e in seeds.items()]
    return "\n".join([*lines, "", *(f"{key}: {value}" for key, value in _all(seeds).items())])


if __name__ == "__main__":
    sys.exit(main())
