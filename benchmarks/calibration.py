"""Whether a confidence of 0.9 is right nine times in ten, over the sample kitchens of two generators.

    python benchmarks/calibration.py [RECORDING...] [--frames 40] [--workdir DIR] [--claims FILE]

A RECORDING is a folder with scan.r3d or capture.r3d, prompts.json, truth.json and true masks (`r2c2r sample` writes one). Each
is reconstructed as far as joints from one click an object; what the product claims, before any calibration, is written down
with what is true (--claims; recordings in it are not computed again). Without a RECORDING the maps are only fitted and drawn
again: benchmarks/calibration.json, docs/calibration.md, docs/calibration.svg.

mask: the expected IoU of a mask with the truth, in every frame that shows 400 px of the object. hinge: that a door is hinged on
the side told. pose: that an object that is not called unsure stands within 1.5 degrees and 15 mm along the axes that were seen.
dimension: that a size is within 15 mm, by where it is said to come from.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from recordings import clicked, record_of, recording_in, true_masks
from scipy.optimize import minimize

from r2c2r_core.calibration import calibrated
from r2c2r_core.config import ReconstructConfig, config_from
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.ledger import Stage
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import Prompts
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.workspace import Workspace

HERE = Path(__file__).resolve().parent
RESULTS, PAGE, PICTURE = HERE / "calibration.json", *(HERE.parent / "docs" / f"calibration.{end}" for end in ("md", "svg"))
MAPS = {  # what is fitted as one: the confidence, and of which kinds
    "mask": ("mask", ("front", "appliance", "thing")),
    "hinge": ("hinge", ("inferred", "measured", "default")),
}
RIGHT = {
    "mask": "its IoU with the truth",
    "hinge": "the door is hinged there",
}
SLOPE_SPREAD = 0.5  # standard deviation of a slope about 1 before any claim is known: few claims keep their order of sureness
MOST_FRAMES = 45  # of a recording, spread over it
LOOSE = (1.5, 0.015)  # degrees, metres: the accuracy that a placement is asked for
EDGE_M = 0.01  # an edge is right within it
SEAM_M = 0.035  # beyond the truth, a front holds some of the next one
Claim = dict[str, Any]


def claims_of(folder: Path, work: Workspace, config: ReconstructConfig, until: Stage) -> list[Claim]:
    """Everything that is claimed of a recording, and whether it is so; a run that is finished in `work` is taken as it is."""
    recording = recording_in(folder)
    if not work.names(until):
        reconstruct(Request(source=recording, prompts=Prompts(objects=()), config=config), work, until="ingest")
        capture: Capture = work.load_latest("ingest", "scene")
        prompts = clicked(folder, [frame.index for frame in capture.frames])
        reconstruct(Request(source=recording, prompts=prompts, config=config), work, until=until)
    capture = work.load_latest("ingest", "scene")
    truth = {item.name: item for item in read_truth(folder / "truth.json", capture.world_from_capture)}
    objects = work.load_latest("synthesize", "scene").objects if work.names("synthesize") else ()
    built = {item.name: item for item in objects if item.name in truth}  # not the worktops that were added
    return [
        *_masks(folder, work, capture),
        *_edges(truth, work),
        *_hinges(truth, built),
        *_poses(truth, work, built),
        *_dimensions(truth, built),
    ]


def _masks(folder: Path, work: Workspace, capture: Capture) -> Iterator[Claim]:
    masks = true_masks(folder)
    for name in work.names("segment"):
        track = work.load_latest("segment", name)
        for frame in capture.frames[:: max(len(capture.frames) // MOST_FRAMES, 1)]:
            true = masks(name, frame.index)
            if frame.index in track.masks and true is not None and np.count_nonzero(true) >= MIN_TRUTH_PX:
                iou = mask_iou(true, unpack_mask(track.masks[frame.index]))
                yield {"of": "mask", "kind": track.kind, "object": name, "claim": track.confidence[frame.index], "right": iou}


def _edges(truth: Mapping[str, ObjectRecord], work: Workspace) -> Iterator[Claim]:
    """Of fronts of furniture: each edge; and whether it reaches over a seam, onto another."""
    for name in work.names("segment"):
        track, true = work.load_latest("segment", name), truth[name]
        if track.kind != "front" or track.front is None or not track.front.edges:
            continue
        half = true.dimensions_m / 2
        corners = np.array([[x, -half[1], z] for x in (-half[0], half[0]) for z in (-half[2], half[2])])
        pose = track.front.world_from_front
        across, _, up = pose.inverse.apply(true.world_from_object.apply(corners)).T
        width, height = track.front.width_m / 2, track.front.height_m / 2
        beyond = np.array([across.min() + width, width - across.max(), height - up.max(), up.min() + height])
        for side, sure, off in zip(("left", "right", "top", "bottom"), track.front.edges, beyond, strict=True):
            yield {"of": "edge", "kind": side, "object": name, "claim": sure, "right": float(abs(off) <= EDGE_M), "off_m": off}
        over = float(beyond.max() > SEAM_M)
        yield {"of": "seam", "kind": track.category, "object": name, "claim": track.front.seam, "right": over}


def _hinges(truth: Mapping[str, ObjectRecord], built: Mapping[str, SceneObject]) -> Iterator[Claim]:
    for name, item in built.items():
        hinged = [joint for joint in item.joints if joint.confidence is not None]
        if not hinged or not any(joint.type == "revolute" for joint in truth[name].joints):
            continue
        right = next(m.value for m in joint_errors(truth[name], record_of(item)) if m.name == "hinge_side")
        told = hinged[0]
        yield {"of": "hinge", "kind": told.sources["axis"], "object": name, "claim": told.confidence, "right": right}


def _poses(truth: Mapping[str, ObjectRecord], work: Workspace, built: Mapping[str, SceneObject]) -> Iterator[Claim]:
    for name, item in built.items():
        placement, true = work.load_latest("align", name), truth[name]
        turn = true.world_from_object.rotation.T @ item.world_from_object.rotation
        turned = 0.0 if true.turns_freely else float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
        turned = min(turned, abs(turned - 90), abs(turned - 180)) if not true.joints else turned  # a thing has no front
        off = item.world_from_object.translation - true.world_from_object.translation
        along = np.abs(true.world_from_object.rotation.T @ off)[list(true.observed_axes or (True, True, True))]
        right = turned <= LOOSE[0] and float(along.max(initial=0.0)) <= LOOSE[1]
        spread = placement.spread
        yield {
            "of": "pose",
            "kind": "unsure" if placement.unsure else "sure",
            "object": name,
            "claim": None if spread is None else 2 * spread.shift_m,
            "right": float(right),
            "turned_deg": turned,
            "off_m": float(along.max(initial=0.0)),
        }


def _dimensions(truth: Mapping[str, ObjectRecord], built: Mapping[str, SceneObject]) -> Iterator[Claim]:
    for name, item in built.items():
        for axis, source in enumerate(item.dimension_sources):
            off = abs(float(item.dimensions_m[axis] - truth[name].dimensions_m[axis]))
            yield {"of": "dimension", "kind": source, "object": name, "right": float(off <= LOOSE[1]), "off_m": off}


def figures(claims: Mapping[str, Sequence[Claim]]) -> dict[str, Any]:
    """Of each confidence its map, and how right it is before and after; no kitchen is judged by a map fitted on it."""
    found = {name: _figures_of(*chosen, claims) for name, chosen in MAPS.items()}
    return {"recordings": sorted(claims), "maps": found, "words": _by_word(claims)}


def _figures_of(of: str, kinds: tuple[str, ...], claims: Mapping[str, Sequence[Claim]]) -> dict[str, Any]:
    own = {name: [c for c in said if c["of"] == of and c["kind"] in kinds] for name, said in claims.items()}
    own = {name: said for name, said in own.items() if said}
    slope, offset = fit(own)
    held_out = []
    for name, said in own.items():
        others = {other: said for other, said in own.items() if other != name}
        numbers = fit(others) if others else (slope, offset)
        held_out += [{**claim, "claim": calibrated(claim["claim"], *numbers)} for claim in said]
    as_claimed = [claim for said in own.values() for claim in said]
    return {
        "slope": slope,
        "offset": offset,
        "claims": len(as_claimed),
        "before": {"off": _off(as_claimed), "bins": _bins(as_claimed)},
        "after": {"off": _off(held_out), "bins": _bins(held_out)},
        "by_generator": {
            generator: {"claims": len(said), "claimed": _mean(said, "claim"), "right": _mean(said, "right")}
            for generator in ("own", "second")
            if (said := [c for name, each in own.items() if _generator(name) == generator for c in each])
        },
    }


def fit(claims: Mapping[str, Sequence[Claim]]) -> tuple[float, float]:
    """Slope and offset of the largest likelihood, the generators of equal weight.

    Claims that are right or wrong count as Platt's targets (1999), (n + 1) / (n + 2): all right is no proof of certainty.
    """
    x, y, weight = [], [], []
    each = {name: len(said) for name, said in claims.items()}
    total = {g: sum(n for name, n in each.items() if _generator(name) == g) for g in set(map(_generator, each))}
    rights = np.array([c["right"] for said in claims.values() for c in said])
    binary = bool(np.isin(rights, (0.0, 1.0)).all())
    high, low = (rights.sum() + 1) / (rights.sum() + 2), 1 / (len(rights) - rights.sum() + 2)
    for name, said in claims.items():
        for claim in said:
            p = min(max(claim["claim"], 1e-3), 1 - 1e-3)
            x.append(np.log(p / (1 - p)))
            y.append(low + (high - low) * claim["right"] if binary else claim["right"])
            weight.append(1 / total[_generator(name)])
    odds, target, share = np.array(x), np.array(y), np.array(weight)

    def loss(numbers: np.ndarray) -> float:
        z = numbers[0] * odds + numbers[1]
        likelihood = (share * (np.logaddexp(0, z) - target * z)).sum() * len(odds) / len(total)
        return float(likelihood + 0.5 * ((numbers[0] - 1) / SLOPE_SPREAD) ** 2)

    slope, offset = minimize(loss, np.array([1.0, 0.0]), bounds=((0.05, 10.0), (-10.0, 10.0))).x
    return round(float(slope), 2), round(float(offset), 2)


def _bins(claims: Sequence[Claim]) -> list[dict[str, float]]:
    """Tenths of the claims, at least ten each: their mean, how many, how right."""
    ranked = sorted(claims, key=lambda claim: claim["claim"])
    parts = np.array_split(np.arange(len(ranked)), max(min(10, len(ranked) // 10), 1))
    bins = [[ranked[k] for k in part] for part in parts]
    return [{"claimed": _mean(part, "claim"), "right": _mean(part, "right"), "claims": len(part)} for part in bins]


def _off(claims: Sequence[Claim]) -> float:
    """The expected calibration error: how far claims are from what is right, the mean over the bins."""
    bins = _bins(claims)
    return round(sum(b["claims"] * abs(b["claimed"] - b["right"]) for b in bins) / sum(b["claims"] for b in bins), 4)


def _mean(claims: Sequence[Claim], key: str) -> float:
    return round(float(np.mean([claim[key] for claim in claims])), 4)


def _generator(name: str) -> str:
    return name.split()[0]


def _name(folder: Path) -> str:
    """Which generator wrote it, and the folder."""
    return f"{'own' if (folder / 'truth_masks').exists() else 'second'} {folder.name}"


def _by_word(claims: Mapping[str, Sequence[Claim]]) -> list[dict[str, Any]]:
    """What is claimed in a word: of each, how many claims, and how many of them are right."""
    counts: dict[tuple[str, str, str], list[float]] = {}
    for name, said in claims.items():
        for claim in said:
            if claim["of"] in ("pose", "dimension"):
                counts.setdefault((claim["of"], claim["kind"], _generator(name)), []).append(claim["right"])
    return [
        {"of": of, "word": word, "generator": generator, "claims": len(rights), "right": int(sum(rights))}
        for (of, word, generator), rights in sorted(counts.items())
    ]


def page(document: Mapping[str, Any]) -> str:
    """The page of the documentation."""
    own = [name for name in document["recordings"] if _generator(name) == "own"]
    lines = [
        "# What a confidence is worth",
        "",
        "A confidence of 0.9 is meant to be right nine times in ten. `benchmarks/calibration.py` compares what is claimed with",
        f"the truth of {len(own)} kitchens of the project's own sample generator and {len(document['recordings']) - len(own)}",
        "of a second one that shares nothing with it, and fits a logistic map of two numbers to each confidence",
        "(`r2c2r_core/calibration.py`), the generators of equal weight. What is after calibration is held out: no kitchen",
        "is judged by a map that was fitted on it.",
        "",
        "![Claimed and right, before and after](calibration.svg)",
        "",
        "| confidence | right means | claims | off before | off after | slope | offset |",
        "|---|---|---:|---:|---:|---:|---:|",
        *(
            f"| {name} | {RIGHT[name]} | {m['claims']} | {m['before']['off']:.3f} | {m['after']['off']:.3f} "
            f"| {m['slope']:g} | {m['offset']:g} |"
            for name, m in document["maps"].items()
        ),
        "",
        "*Off* is the expected calibration error: the mean distance, over tenths of the claims, between what is claimed and",
        "what is right.",
        "",
        "Both generators hang every door opposite its handle, so a handle that is found tells the side; a side told by a",
        "neighbour, by default, or by a door seen open did not occur often enough to be measured, and keeps its stated guess.",
        "Masks are those of the weight-free segmenter. A front cut together with its neighbour is as sharp as any: what gives",
        "it away is its size, which lowers its claim before the map (`unlikely_left`).",
        "",
        "| confidence | generator | claims | claimed before | right |",
        "|---|---|---:|---:|---:|",
        *(
            f"| {name} | {generator} | {g['claims']} | {g['claimed']:.3f} | {g['right']:.3f} |"
            for name, m in document["maps"].items()
            for generator, g in m["by_generator"].items()
        ),
        "",
        "## Claims in words",
        "",
        "A placement is called unsure or not; it is right within 1.5 degrees and, along the axes that the scan shows from end",
        "to end, within 15 mm of the truth once the scene is built. A size says where it comes from; it is right within 15 mm.",
        "",
        "| claim | generator | claims | right |",
        "|---|---|---:|---:|",
        *(f"| {w['of']}: {w['word']} | {w['generator']} | {w['claims']} | {w['right']} |" for w in document["words"]),
        "",
    ]
    return "\n".join(lines)


def picture(document: Mapping[str, Any]) -> str:
    """The reliability diagram from 0.5 to 1, SVG: right over claimed; a circle's area is its number of claims."""
    side, gap = 220, 50
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{(side + gap) * len(document["maps"]) + gap}" height="{side + 90}" '
        'font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="white"/>',
        '<text x="50" y="16">right over claimed: before (orange) and after calibration (blue, held out)</text>',
    ]
    for number, (name, found) in enumerate(document["maps"].items()):
        left, bottom = gap + number * (side + gap), side + 40
        lines += [
            f'<rect x="{left}" y="40" width="{side}" height="{side}" fill="none" stroke="black" stroke-width="0.5"/>',
            f'<line x1="{left}" y1="{bottom}" x2="{left + side}" y2="40" stroke="grey" stroke-dasharray="4"/>',
            f'<text x="{left + side / 2:.0f}" y="{bottom + 32}" text-anchor="middle">{name}</text>',
        ]
        for tick in (0.5, 0.75, 1.0):
            lines += [
                f'<text x="{left + (2 * tick - 1) * side:.0f}" y="{bottom + 14}" text-anchor="middle">{tick:g}</text>',
                f'<text x="{left - 5}" y="{bottom - (2 * tick - 1) * side + 4:.0f}" text-anchor="end">{tick:g}</text>',
            ]
        for when, colour in (("before", "#ef7820"), ("after", "#2166d6")):
            for part in found[when]["bins"]:
                x, y = left + side * (2 * part["claimed"] - 1), bottom - side * (2 * part["right"] - 1)
                radius = 2 + 10 * (part["claims"] / found["claims"]) ** 0.5
                lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}" fill-opacity="0.55"/>')
    return "\n".join([*lines, "</svg>", ""])


def main(arguments: Sequence[str] | None = None) -> int:
    """Claims of what is given and not known yet; then the maps, the figures and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--until", choices=("segment", "synthesize"), default="synthesize")
    parser.add_argument("--workdir", type=Path)
    parser.add_argument("--claims", type=Path, default=Path("claims.json"))
    options = parser.parse_args(arguments)
    claims: dict[str, list[Claim]] = json.loads(options.claims.read_text()) if options.claims.exists() else {}
    with tempfile.TemporaryDirectory(prefix="r2c2r-calibration-") as scratch:
        for folder in options.recordings:
            if _name(folder) in claims:
                continue
            started, config = time.monotonic(), config_from(RAW | {"ingest": {"most_frames": options.frames}}, "calibration")
            work = Workspace((options.workdir or Path(scratch)) / folder.name)
            claims[_name(folder)] = claims_of(folder, work, config, options.until)
            options.claims.write_text(json.dumps(claims) + "\n", encoding="utf-8")
            print(f"{folder.name}: {len(claims[_name(folder)])} claims, {time.monotonic() - started:.0f} s", flush=True)
    if claims:
        RESULTS.write_text(json.dumps(figures(claims), indent=1) + "\n", encoding="utf-8")
    document = json.loads(RESULTS.read_text(encoding="utf-8"))
    PAGE.write_text(page(document), encoding="utf-8")
    PICTURE.write_text(picture(document), encoding="utf-8")
    return 0


_AS_IT_IS = {"slope": 1.0, "offset": 0.0}
RAW: dict[str, Any] = {  # claims before any map
    "segment": {"params": {"expected_iou": _AS_IT_IS}},
    "synthesize": {"params": {"joints": _AS_IT_IS}},
    "generate": {"count": 1},
}

if __name__ == "__main__":
    sys.exit(main())
