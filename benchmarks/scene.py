"""Quality of the scene and its certificate: synthesis, warp, export and certificate of finished runs, against issue 5's bars.

    python benchmarks/scene.py --workdir DIR [--seeds 0-9] [--json FILE] [--update]

DIR holds seed<N> and kitchen, the workdirs of finished `r2c2r run`s (of `r2c2r sample` and of the real kitchen); missing ones
are skipped. Only the stages after the alignment are run again, into a temporary folder; the workdirs are not modified. Seconds
are scaled to 20 objects by their number; a true room of 20 is timed, against its bar, by galley.py. --update writes
benchmarks/scene.json. SAPIEN is included if R2C2R_SAPIEN_PYTHON names its environment.
"""

import argparse
import json
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from proof import certificate_figures, mm, placed_by, prove
from run import _seeds
from scene_truth import true_limits, true_meetings

from r2c2r_core.config import ReconstructConfig
from r2c2r_core.export.certify import certificate_to_json
from r2c2r_core.export.simulate import compiled
from r2c2r_core.export.together import meetings
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.warp.stage import fit_meshes
from r2c2r_core.workspace import Workspace

FIGURES = Path(__file__).resolve().parent / "scene.json"
OBJECTS = 20

# name, bar, better direction; None: no bar, for information
BARS: tuple[tuple[str, float | None, str], ...] = (
    ("rest_mm", 0.5, "lower"),
    ("sweep_mm", 1.0, "lower"),
    ("together_where_free_mm", 1.0, "lower"),
    ("travel_percent", 98.0, "higher"),
    ("drift_mm", 1.0, "lower"),
    ("cavity_percent", 90.0, "higher"),
    ("opening_percent", 90.0, "higher"),
    ("loaders", 6.0, "higher"),
    ("errors", 0.0, "lower"),
    ("realtime_factor", 20.0, "higher"),
    ("corner_residual_mm", 1.0, "lower"),
    ("corner_residual_paper_mm", None, "lower"),
    ("paper_equation_15_mm", None, "lower"),
    ("without_mesh", None, "lower"),
    ("seconds_20_objects", None, "lower"),
    ("cpu_seconds_20_objects", None, "lower"),
)

# Table 3 of the paper. It does not state what its columns count: most likely limits of stock assets against the truth.
PAPER_TABLE_3 = {"cabinets": {"BK": 1.0, "SFK": 1.0}, "drawers": {"BK": 0.9525, "SFK": 0.9125}}
MEANING = {
    "paper": "range of the joint over the true one: doors in radians, drawers over the drawer's WIDTH; n unstated",
    "range_ratio": "1 - |our range - true range| / true range, mean over joints; the limits are mostly defaults, not measured",
    "travel_of_range": "share of our own range reached in MuJoCo under 30 N or 10 N m: what a robot would get",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure every finished workdir, print, and save the figures."""
    options = _parser().parse_args(arguments)
    kitchens = {f"seed{seed}": seed for seed in options.seeds} | {"kitchen": None}
    measured: dict[str, Any] = {}
    for name, seed in kitchens.items():
        work = options.workdir / name
        if not (work / "nouns" / "align").is_dir():
            print(f"{work}: not a finished workdir, left out", file=sys.stderr)
            continue
        measured[name] = measure(work, seed)
        print(name, json.dumps({k: v for k, v in measured[name].items() if k != "details"}), flush=True)
    document = {
        "version": 1,
        "kitchens": measured,
        "worst": worst(measured),
        "table_3": {"paper": PAPER_TABLE_3, "ours": _table_3(measured), "meaning": MEANING},
    }
    print(json.dumps({"worst": document["worst"], "table_3": document["table_3"]["ours"]}, indent=1))
    for path in (options.json, FIGURES if options.update else None):
        if path is not None:
            path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0 if all(entry["met"] is not False for entry in document["worst"].values()) else 1


def measure(workdir: Path, seed: int | None) -> dict[str, Any]:
    """All figures of one kitchen; lists of anomalies under "details"."""
    placed = placed_by(Workspace(workdir))
    with tempfile.TemporaryDirectory(prefix="r2c2r-scene-") as folder:
        proof = prove(placed, Path(folder) / "bundle.zip")
        with zipfile.ZipFile(proof.bundle) as archive:
            archive.extract("scene.xml", folder)
            archive.extractall(folder, [name for name in archive.namelist() if "/" in name])
        free_mm, details = _where_truth_is_free(Path(folder) / "scene.xml", seed)
    scene, certificate, objects = proof.scene, proof.certificate, len(proof.scene.objects)
    by_paper = replace(ReconstructConfig().warp, method="paper")
    paper = fit_meshes(proof.primitives, placed.tracks, placed.placements, placed.assets, by_paper)
    figures = certificate_figures(certificate) | {
        "together_where_free_mm": free_mm,
        "corner_residual_mm": _residual_mm(scene),
        "corner_residual_paper_mm": _residual_mm(paper),
        "paper_equation_15_mm": max(
            (mm(o.warp_residual_paper_m) for o in scene.objects if o.warp_residual_paper_m), default=None
        ),
        "without_mesh": sum("the primitive is shown" in line for item in scene.objects for line in item.warnings),
        "objects": objects,
        "joints": len(certificate.joints),
        "seconds": {name: round(value, 2) for name, value in proof.seconds.items()},
        "seconds_20_objects": round(sum(proof.seconds.values()) * OBJECTS / objects, 1),
        "cpu_seconds_20_objects": round(proof.cpu_seconds * OBJECTS / objects, 1),
    }
    table = {name: round(value, 4) for name, value in _ratios(scene, seed, certificate).items()}
    return figures | {"table_3": table, "details": details | {"findings": _findings(certificate)}}


def worst(measured: dict[str, Any]) -> dict[str, Any]:
    """The worst figure over all kitchens beside its bar."""
    table = {}
    for name, bar, better in BARS:
        values = [kitchen[name] for kitchen in measured.values() if kitchen.get(name) is not None]
        value = (max if better == "lower" else min)(values, default=None)
        met = None if bar is None or value is None else bool(value <= bar if better == "lower" else value >= bar)
        table[name] = {"value": value, "bar": bar, "better": better, "met": met}
    return table


def _where_truth_is_free(mjcf: Path, seed: int | None) -> tuple[float | None, dict[str, Any]]:
    """Deepest overlap between the open parts of two joints that do not meet in the true kitchen, within the true limits."""
    if seed is None:
        return None, {}
    model, limits, true = compiled(mjcf, strict=True), true_limits(seed), true_meetings(seed)
    for name, upper in limits.items():
        if any(model.joint(j).name == name for j in range(model.njnt)):
            model.joint(name).range[1] = min(upper, float(model.joint(name).range[1]))
    found = [one for one in meetings(model) if set(one.joints) <= set(limits) and frozenset(one.joints) not in true]
    listed = [{"joints": one.joints, "mm": mm(one.depth_m)} for one in found]
    return max((mm(one.depth_m) for one in found), default=0.0), {"true_meetings": len(true), "only_ours": listed}


def _ratios(scene: ArticulatedScene, seed: int | None, certificate: Certificate) -> dict[str, float]:
    """Table 3's figure for our doors and drawers, and the fraction of our own range that a hand's force reaches."""
    reached = {joint.joint: joint.travel_reached for joint in certificate.joints}
    limits = true_limits(seed) if seed is not None else {}
    table: dict[str, float] = {}
    for title, kind in (("cabinets", "revolute"), ("drawers", "prismatic")):
        joints = [joint for item in scene.objects for joint in item.joints if joint.type == kind]
        ratios = [1 - min(1.0, abs(j.upper - limits[j.name]) / limits[j.name]) for j in joints if j.name in limits]
        pushed = [reached[joint.name] for joint in joints if joint.name in reached]
        for name, values in ((f"{title}_range_ratio", ratios), (f"{title}_travel_of_range", pushed)):
            if values:
                table[name] = sum(values) / len(values)
    return table


def _table_3(measured: dict[str, Any]) -> dict[str, float]:
    names = sorted({name for kitchen in measured.values() for name in kitchen["table_3"]})
    columns = {name: [k["table_3"][name] for k in measured.values() if name in k["table_3"]] for name in names}
    return {name: round(sum(values) / len(values), 4) for name, values in columns.items()}


def _residual_mm(scene: ArticulatedScene) -> float | None:
    return max((mm(item.warp_residual_m) for item in scene.objects if item.warp_residual_m is not None), default=None)


def _findings(certificate: Certificate) -> list[str]:
    said = certificate_to_json(certificate)["findings"]
    return [f"{f['severity']}: {f['rule']}: {f['where']}: {f['message']}" for f in said]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Synthesis, warp, export and certificate of finished reconstructions.")
    parser.add_argument("--workdir", type=Path, required=True)
    parser.add_argument("--seeds", type=_seeds, default=_seeds("0-9"))
    parser.add_argument("--json", type=Path)
    parser.add_argument("--update", action="store_true", help="write benchmarks/scene.json")
    return parser


if __name__ == "__main__":
    sys.exit(main())
