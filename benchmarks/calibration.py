"""Calibration of confidences (is 0.9 right nine times in ten?) on the sample kitchens of two generators.

    python benchmarks/calibration.py [RECORDING...] [--check RECORDING...] [--until segment] [--claims FILE]

A RECORDING is a folder with scan.r3d or capture.r3d, prompts.json, truth.json and true masks (`r2c2r sample` writes one). Each
is reconstructed from one click per object up to the joints, or up to the masks alone; the product's claims, before any
calibration, are stored with their truth (--claims; recordings in that file are not computed again). The maps are fitted on all
recordings except those of --check: benchmarks/calibration.json, docs/calibration.md, docs/calibration.svg.

mask: the expected IoU of a mask with the truth, in every frame that shows 400 px of the object. edge: an edge of a front of
furniture is within 10 mm of the truth. seam: a front extends over a seam, by 35 mm or more, onto another one. hinge: a door is
hinged on the stated side. pose: an object not marked unsure is within 1.5 degrees and 15 mm along the observed axes. dimension:
a size is within 15 mm, grouped by its stated source.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence, Set
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from calibration_page import generator_of, page, picture
from recordings import clicked, record_of, recording_in, true_masks
from scipy.optimize import minimize

from r2c2r_core.calibration import calibrated
from r2c2r_core.config import ReconstructConfig, config_from
from r2c2r_core.evaluate.iou import MIN_TRUTH_PX
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.records import ObjectRecord, read_truth
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.ledger import Stage
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import Prompts
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.segment.certainty import expects_seams
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.joints import handle_hinge
from r2c2r_core.tuning import changed, tuning
from r2c2r_core.workspace import Workspace

HERE = Path(__file__).resolve().parent
RESULTS, PAGE, PICTURE = HERE / "calibration.json", *(HERE.parent / "docs" / f"calibration.{end}" for end in ("md", "svg"))
FRONTS = HERE / "front_certainty.json"
MAPS = ("mask", "hinge")
AS_CLAIMED = ("edge", "seam")  # network log-odds: evaluated, without a map
SLOPE_SPREAD = 0.5  # standard deviation of the slope's prior about 1: with few claims the ranking of confidences is preserved
MOST_FRAMES = 45  # per recording, spread over it
LOOSE = (1.5, 0.015)  # degrees, metres: the accuracy required of a placement
EDGE_M = 0.01  # tolerance of an edge
SEAM_M = 0.035  # a front that extends this far beyond the truth includes a part of the next one
Claim = dict[str, Any]


def claims_of(folder: Path, work: Workspace, config: ReconstructConfig, until: Stage) -> list[Claim]:
    """All claims of a recording, each with whether it is true; a run already finished in `work` is reused."""
    recording = recording_in(folder)
    if not work.names(until):
        reconstruct(Request(source=recording, prompts=Prompts(objects=()), config=config), work, until="ingest")
        capture: Capture = work.load_latest("ingest", "scene")
        prompts = clicked(folder, [frame.index for frame in capture.frames])
        reconstruct(Request(source=recording, prompts=prompts, config=config), work, until=until)
    capture = work.load_latest("ingest", "scene")
    truth = {item.name: item for item in read_truth(folder / "truth.json", capture.world_from_capture)}
    objects = work.load_latest("synthesize", "scene").objects if work.names("synthesize") else ()
    built = {item.name: item for item in objects if item.name in truth}  # without the worktops that were added
    return [
        *_masks(folder, work, capture),
        *_edges(truth, work),
        *(_hinges(truth, built) if built else _handled(truth, work)),
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
    """Claims of the fronts of furniture: each edge, and whether the front extends over a seam onto another."""
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
        if not expects_seams(category_of(track.category), track.front.width_m):
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


def _handled(truth: Mapping[str, ObjectRecord], work: Workspace) -> Iterator[Claim]:
    """Claims before anything is built: the hinge sides inferred from handles on fronts of furniture."""
    for name in work.names("segment"):
        track, true = work.load_latest("segment", name), truth[name]
        turning = [joint for joint in true.joints if joint.type == "revolute"]
        if track.kind != "front" or track.front is None or len(turning) != 1:
            continue
        size = np.array([track.front.width_m, 0.0, track.front.height_m])
        item = SimpleNamespace(handle=track.front.handle, dimensions_m=size, spec=category_of(track.category))
        with tuning(changed({"synthesize.joints": _AS_IT_IS})):
            hinge = handle_hinge(cast(MeasuredObject, item))
        x, _, z = true.world_from_object.inverse.apply(turning[0].origin) / true.dimensions_m
        if hinge is not None and abs(x) > abs(z):
            right = float(hinge.side == ("left" if x < 0 else "right"))
            yield {"of": "hinge", "kind": hinge.source, "object": name, "claim": hinge.confidence, "right": right}


def _poses(truth: Mapping[str, ObjectRecord], work: Workspace, built: Mapping[str, SceneObject]) -> Iterator[Claim]:
    for name, item in built.items():
        placement, true = work.load_latest("align", name), truth[name]
        turn = true.world_from_object.rotation.T @ item.world_from_object.rotation
        turned = 0.0 if true.turns_freely else float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
        turned = min(turned, abs(turned - 90), abs(turned - 180)) if not true.joints else turned  # things have no front
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


def figures(claims: Mapping[str, Sequence[Claim]], checked: Set[str]) -> dict[str, Any]:
    """Map of each confidence, and its calibration before and after; no recording is evaluated with a map fitted on it.

    The maps are fitted on all recordings except those in `checked`.
    """
    fitted = {name: said for name, said in claims.items() if name not in checked}
    others = {name: claims[name] for name in checked}
    return {
        "recordings": sorted(fitted),
        "checked": sorted(others),
        "maps": {of: _figures_of(_only(of, fitted), _only(of, others)) for of in MAPS},
        "as_claimed": {
            of: {"fitted": _measured(_all(_only(of, fitted))), "checked": _measured(_all(_only(of, others)))}
            for of in AS_CLAIMED
        },
        "words": _by_word(claims),
    }


def _only(of: str, claims: Mapping[str, Sequence[Claim]]) -> dict[str, list[Claim]]:
    own = {name: [claim for claim in said if claim["of"] == of] for name, said in claims.items()}
    return {name: said for name, said in own.items() if said}


def _all(claims: Mapping[str, Sequence[Claim]]) -> list[Claim]:
    return [claim for said in claims.values() for claim in said]


def _measured(claims: Sequence[Claim]) -> dict[str, float]:
    """The number of claims, mean confidence, accuracy, and calibration error."""
    if not claims:
        return {"claims": 0}
    return {
        "claims": len(claims),
        "claimed": _mean(claims, "claim"),
        "right": _mean(claims, "right"),
        "off": _off(claims),
    }


def _figures_of(own: Mapping[str, Sequence[Claim]], checked: Mapping[str, Sequence[Claim]]) -> dict[str, Any]:
    slope, offset = fit(own)
    held_out = []
    for name, said in own.items():
        others = {other: said for other, said in own.items() if other != name}
        numbers = fit(others) if others else (slope, offset)
        held_out += [{**claim, "claim": calibrated(claim["claim"], *numbers)} for claim in said]
    as_claimed, unfitted = _all(own), _all(checked)
    return {
        "slope": slope,
        "offset": offset,
        "claims": len(as_claimed),
        "before": {"off": _off(as_claimed), "bins": _bins(as_claimed)},
        "after": {"off": _off(held_out), "bins": _bins(held_out)},
        "checked": {
            "before": _measured(unfitted),
            "after": _measured([{**claim, "claim": calibrated(claim["claim"], slope, offset)} for claim in unfitted]),
        },
        "by_generator": {
            generator: {"claims": len(said), "claimed": _mean(said, "claim"), "right": _mean(said, "right")}
            for generator in ("own", "second")
            if (said := [c for name, each in own.items() if generator_of(name) == generator for c in each])
        },
    }


def fit(claims: Mapping[str, Sequence[Claim]]) -> tuple[float, float]:
    """Maximum a posteriori slope and offset of the logistic map, with equal weight for both generators.

    Right and wrong claims count as Platt's targets (1999), (n + 1) / (n + 2): all right is no proof of certainty.
    """
    x, y, weight = [], [], []
    each = {name: len(said) for name, said in claims.items()}
    total = {g: sum(n for name, n in each.items() if generator_of(name) == g) for g in set(map(generator_of, each))}
    rights = np.array([c["right"] for said in claims.values() for c in said])
    binary = bool(np.isin(rights, (0.0, 1.0)).all())
    high, low = (rights.sum() + 1) / (rights.sum() + 2), 1 / (len(rights) - rights.sum() + 2)
    for name, said in claims.items():
        for claim in said:
            p = min(max(claim["claim"], 1e-3), 1 - 1e-3)
            x.append(np.log(p / (1 - p)))
            y.append(low + (high - low) * claim["right"] if binary else claim["right"])
            weight.append(1 / total[generator_of(name)])
    odds, target, share = np.array(x), np.array(y), np.array(weight)

    def loss(numbers: np.ndarray) -> float:
        z = numbers[0] * odds + numbers[1]
        likelihood = (share * (np.logaddexp(0, z) - target * z)).sum() * len(odds) / len(total)
        return float(likelihood + 0.5 * ((numbers[0] - 1) / SLOPE_SPREAD) ** 2)

    slope, offset = minimize(loss, np.array([1.0, 0.0]), bounds=((0.05, 10.0), (-10.0, 10.0))).x
    return round(float(slope), 2), round(float(offset), 2)


def _bins(claims: Sequence[Claim]) -> list[dict[str, float]]:
    """Deciles of the claims, at least ten claims each: mean confidence, count, accuracy."""
    ranked = sorted(claims, key=lambda claim: claim["claim"])
    parts = np.array_split(np.arange(len(ranked)), max(min(10, len(ranked) // 10), 1))
    bins = [[ranked[k] for k in part] for part in parts]
    return [{"claimed": _mean(part, "claim"), "right": _mean(part, "right"), "claims": len(part)} for part in bins]


def _off(claims: Sequence[Claim]) -> float:
    """The expected calibration error: the mean over the bins of the distance between confidence and accuracy."""
    bins = _bins(claims)
    return round(sum(b["claims"] * abs(b["claimed"] - b["right"]) for b in bins) / sum(b["claims"] for b in bins), 4)


def _mean(claims: Sequence[Claim], key: str) -> float:
    return round(float(np.mean([claim[key] for claim in claims])), 4)


def _name(folder: Path) -> str:
    """Generator and folder name of a recording."""
    return f"{'own' if (folder / 'truth_masks').exists() else 'second'} {folder.name}"


def _by_word(claims: Mapping[str, Sequence[Claim]]) -> list[dict[str, Any]]:
    """Claims made as a word: for each word, the number of claims and the fraction that is right."""
    counts: dict[tuple[str, str, str], list[float]] = {}
    for name, said in claims.items():
        for claim in said:
            if claim["of"] in ("pose", "dimension"):
                counts.setdefault((claim["of"], claim["kind"], generator_of(name)), []).append(claim["right"])
    return [
        {"of": of, "word": word, "generator": generator, "claims": len(rights), "right": int(sum(rights))}
        for (of, word, generator), rights in sorted(counts.items())
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Collect the claims of recordings not computed yet; then write the maps, the figures and the plot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--check", nargs="*", type=Path, default=[], help="recordings excluded from the fit of the maps")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--until", choices=("segment", "synthesize"), default="synthesize")
    parser.add_argument("--workdir", type=Path)
    parser.add_argument("--claims", type=Path, default=Path("claims.json"))
    options = parser.parse_args(arguments)
    claims: dict[str, list[Claim]] = json.loads(options.claims.read_text()) if options.claims.exists() else {}
    with tempfile.TemporaryDirectory(prefix="r2c2r-calibration-") as scratch:
        for folder in (*options.recordings, *options.check):
            if _name(folder) in claims:
                continue
            started, config = time.monotonic(), config_from(RAW | {"ingest": {"most_frames": options.frames}}, "calibration")
            work = Workspace((options.workdir or Path(scratch)) / folder.name)
            claims[_name(folder)] = claims_of(folder, work, config, options.until)
            options.claims.write_text(json.dumps(claims) + "\n", encoding="utf-8")
            print(f"{folder.name}: {len(claims[_name(folder)])} claims, {time.monotonic() - started:.0f} s", flush=True)
    if claims:
        RESULTS.write_text(
            json.dumps(figures(claims, {_name(folder) for folder in options.check}), indent=1) + "\n", encoding="utf-8"
        )
    document = json.loads(RESULTS.read_text(encoding="utf-8"))
    PAGE.write_text(page(document, json.loads(FRONTS.read_text(encoding="utf-8"))), encoding="utf-8")
    PICTURE.write_text(picture(document), encoding="utf-8")
    return 0


_AS_IT_IS = {"slope": 1.0, "offset": 0.0}
RAW: dict[str, Any] = {  # claims before any map is applied
    "segment": {"params": {"expected_iou": _AS_IT_IS}},
    "synthesize": {"params": {"joints": _AS_IT_IS}},
    "generate": {"count": 1},
}

if __name__ == "__main__":
    sys.exit(main())
