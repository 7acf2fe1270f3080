"""Completed shapes against truth: extents, centre and yaw of the scene, quality of the ranking, and time per object.

    python benchmarks/generate.py [--seeds 0-9] [--samples DIR] [--workdir DIR] [--parts a,b] [--json FILE] [--update]

--workdir holds workspaces named seedN, finished or not: their results are reused, the rest is computed there. --samples
holds samples named seedN. --update rewrites benchmarks/generate.json. Parts: scene, ranking, seconds.

The truth of the scene is the sample's boxes; that of the ranking is the solids the sample was drawn from (a bottle's profile,
otherwise the box without its handle), with the centres of round objects aligned. The paper's tables are given for comparison,
in its metrics: E_avg (eq. 17-20, along the object's axes instead of the world's) and IoU, here of exact solids instead of
voxels of unstated size (a point cloud has no volume).
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from solids import overlap, true_solids

from r2c2r_core.align.stage import Placer
from r2c2r_core.errors import R2C2RError
from r2c2r_core.evaluate.stage import evaluate_bundle
from r2c2r_core.generate.completion import Completion
from r2c2r_core.generate.consensus import choose_candidate
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.geometry.meshes import join_vertices
from r2c2r_core.ledger import Stage
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.synthetic.stage import write_sample
from r2c2r_core.workspace import Workspace

RESULTS = Path(__file__).resolve().parent / "generate.json"
COUNT = 10  # candidates per object
NEAR_BEST = 0.9  # fraction of the best candidate's overlap with the truth
FURNITURE = 2  # fronts ranked per kitchen: their candidates differ in hidden depth only
PARTS = ("scene", "ranking", "seconds")
PAPER = {
    "E_avg": {"drawer": 4.192, "bottle": 3.264, "microwave": 5.182, "refrigerator": 5.172},  # Table 1, percent
    "IoU": {"drawer": 91.25, "bottle": 93.19, "microwave": 89.44, "refrigerator": 91.02},  # Table 2, percent
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Kitchen:
    """A sample and its workspace."""

    seed: int
    sample: Path
    work: Path

    @property
    def capture(self) -> Capture:
        """The recording as the pipeline read it."""
        return Workspace(self.work).load_latest("ingest", "scene")  # type: ignore[return-value]  # main() made sure

    def tracks(self) -> Iterator[MaskTrack]:
        """Every object's mask track."""
        work = Workspace(self.work)
        for name in work.names("segment"):
            track = work.load_latest("segment", name)
            assert isinstance(track, MaskTrack)
            yield track


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and write the document."""
    options = _parser().parse_args(arguments)
    kitchens = [_kitchen(seed, options) for seed in options.seeds]
    document = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {"version": 1}
    document["seeds"] = options.seeds
    if "scene" in options.parts:
        document |= scene_figures(kitchens)
    if "ranking" in options.parts:
        document["ranking"] = ranking_figures(kitchens, options.processes)
    if "seconds" in options.parts:
        document["seconds"] = seconds_figures(kitchens[0])
    text = json.dumps(_rounded(document), indent=1) + "\n"
    print(json.dumps({key: _headline(value) for key, value in document.items()}, indent=1))
    if options.json:
        options.json.write_text(text, encoding="utf-8")
    if options.update:
        RESULTS.write_text(text, encoding="utf-8")
    return 0


def scene_figures(kitchens: list[Kitchen]) -> dict[str, Any]:
    """The scene's boxes against the true ones, and the paper's categories in its own metrics."""
    rows = [row for kitchen in kitchens for row in _scene_rows(kitchen)]
    return {"scene": {"mean": _means(rows), "worst": _worst(rows), "objects": rows}, "paper": _paper_tables(rows)}


def _scene_rows(kitchen: Kitchen) -> list[dict[str, Any]]:
    """One entry per object; the overlap is that of the placed mesh, before it is fitted to the scene."""
    found = evaluate_bundle(Workspace(kitchen.work).bundle, kitchen.sample / "truth.json")
    solids = true_solids(kitchen.seed, kitchen.sample / "truth.json", kitchen.capture.world_from_capture)
    rows = []
    for row in found.rows:
        values = {metric.name: metric.value for metric in row.metrics}
        entry: dict[str, Any] = {"seed": kitchen.seed, "name": row.name, "category": row.category}
        for name in ("width_error", "depth_error", "height_error", "extents", "extents_observed", "extents_unobserved"):
            entry[name] = values.get(name)
        entry |= {"centre_mm": values.get("centre"), "yaw_deg": values.get("yaw")}
        placed = _placed_mesh(kitchen, row.name)
        entry["solid_iou"] = None if placed is None else 100 * overlap(*placed, solids[row.name])
        rows.append(entry)
    return rows


def _placed_mesh(kitchen: Kitchen, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    work = Workspace(kitchen.work)
    candidates, placement = work.load_latest("generate", name), work.load_latest("align", name)
    if candidates is None or placement is None:
        return None
    mesh = next(c.mesh for c in candidates.candidates if c.candidate_id == placement.candidate_id)
    return join_vertices(placement.world_from_mesh.apply(mesh.vertices), mesh.faces)


def _means(rows: list[dict[str, Any]]) -> dict[str, float]:
    names = [name for name in rows[0] if name not in ("seed", "name", "category")]
    columns = {name: [row[name] for row in rows if row[name] is not None] for name in names}
    return {name: float(np.mean(values)) for name, values in columns.items() if values}


def _worst(rows: list[dict[str, Any]]) -> list[str]:
    """The ten objects with the largest errors of the observed extents."""
    known = [row for row in rows if row["extents_observed"] is not None]
    known.sort(key=lambda row: -row["extents_observed"])
    return [f"seed {row['seed']} {row['name']}: {row['extents_observed']:.1f} %" for row in known[:10]]


def _paper_tables(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Our figures beside the paper's, in percent."""
    tables: dict[str, Any] = {}
    for title, ours in (("E_avg", "extents"), ("IoU", "solid_iou")):
        tables[title] = {}
        for category, theirs in PAPER[title].items():
            values = [row[ours] for row in rows if row["category"] == category and row[ours] is not None]
            mean = float(np.mean(values)) if values else None
            tables[title][category] = {"ours": mean, "paper": theirs, "objects": len(values)}
    return tables


def ranking_figures(kitchens: list[Kitchen], processes: int) -> dict[str, Any]:
    """Distance of the chosen candidate from the truly best one, and of the choices of other rules."""
    with ProcessPoolExecutor(processes) as pool:
        rows = [row for found in pool.map(_ranked, kitchens) for row in found]
    figures: dict[str, Any] = {"candidates": COUNT, "objects": len(rows)}
    for rule in ("chosen", "paper", "medoid", "random"):
        share = [row[rule] >= NEAR_BEST * row["best"] for row in rows] if rule != "random" else [row["near"] for row in rows]
        figures[rule] = {
            "within_10_percent_of_best": float(np.mean(share)),
            "solid_iou": float(np.mean([row[rule] for row in rows])),
            "extents_error_percent": float(np.mean([row[f"{rule}_error"] for row in rows])),
        }
    figures["best_solid_iou"] = float(np.mean([row["best"] for row in rows]))
    figures["best_extents_error_percent"] = float(np.mean([row["best_error"] for row in rows]))
    figures["spread_solid_iou"] = float(np.mean([row["best"] - row["worst"] for row in rows]))
    figures["rank_correlation"] = float(np.nanmean([row["correlation"] for row in rows]))
    figures["rows"] = rows
    return figures


def _ranked(kitchen: Kitchen) -> list[dict[str, Any]]:
    """The candidates of every selected object, evaluated against the truth."""
    capture = kitchen.capture
    solids = true_solids(kitchen.seed, kitchen.sample / "truth.json", capture.world_from_capture)
    tracks = list(kitchen.tracks())
    fronts = [track.name for track in tracks if track.kind == "front"]
    left_out = set(fronts) - set(fronts[:: max(len(fronts) // FURNITURE, 1)][:FURNITURE])
    rows = []
    for track in tracks:
        if track.name not in left_out:
            rows.append({"seed": kitchen.seed, "name": track.name, **_judged(capture, track, solids[track.name])})
    return rows


def _judged(capture: Capture, track: MaskTrack, solid: Any) -> dict[str, Any]:
    evidence = gather_evidence(capture, track, GenerateConfig().pool_frames)
    generator = Completion()
    assets, overlaps, errors = [], [], []
    for k in range(COUNT):
        try:
            shape, metrics, assumes = generator.measured(evidence, f"c{k}", 0)
        except R2C2RError:
            continue
        assets.append(_asset(track.name, f"c{k}", metrics, assumes))
        overlaps.append(overlap(solid.recentred(shape.vertices_world), shape.faces, solid))
        errors.append(100 * solid.extents_error(shape.vertices_world))
    by_id = {asset.candidate_id: k for k, asset in enumerate(assets)}
    ours = choose_candidate(assets)
    picks = {
        "chosen": by_id[ours.chosen_id],
        "paper": by_id[choose_candidate([_shape_only(a) for a in assets], rule="mean").chosen_id],
        "medoid": by_id[choose_candidate([_shape_only(a) for a in assets]).chosen_id],
    }
    order = [by_id[name] for name in ours.ranking]
    row: dict[str, Any] = {"made": len(assets), "best": max(overlaps), "worst": min(overlaps), "best_error": min(errors)}
    row |= {"random": float(np.mean(overlaps)), "random_error": float(np.mean(errors))}
    row["near"] = float(np.mean(np.array(overlaps) >= NEAR_BEST * max(overlaps)))
    for rule, k in picks.items():
        row |= {rule: overlaps[k], f"{rule}_error": errors[k]}
    row["correlation"] = _rank_correlation(order, overlaps)
    row["ranked"] = [(assets[k].assumes, overlaps[k]) for k in order]
    return row


def _rank_correlation(order: list[int], overlaps: list[float]) -> float:
    """Spearman's rank correlation of our order with the true one; nan if all overlaps are equal."""
    if np.ptp(overlaps) < 1e-6:
        return float("nan")
    place = np.argsort(order)
    true_place = np.argsort(np.argsort(-np.array(overlaps)))
    return float(np.corrcoef(place, true_place)[0, 1])


def _asset(name: str, candidate_id: str, metrics: dict[str, float], assumes: str = "") -> MeshAsset:
    """An asset with the fields that the choice reads; its mesh is not needed to rank its shape."""
    nothing = TexturedMesh(
        vertices=np.zeros((0, 3)),
        faces=np.zeros((0, 3), np.int64),
        uv=np.zeros((0, 2)),
        texture=np.zeros((1, 1, 3), np.uint8),
    )
    return MeshAsset(
        object_name=name,
        candidate_id=candidate_id,
        mesh=nothing,
        generator="completion",
        seed=0,
        watertight=True,
        frames=(),
        metrics=metrics,
        parameters={},
        warnings=(),
        assumes=assumes,
    )


def _shape_only(asset: MeshAsset) -> MeshAsset:
    shape = {name: asset.metrics[name] for name in ("extent_middle", "extent_short", "volume_ratio")}
    return _asset(asset.object_name, asset.candidate_id, shape)


def seconds_figures(kitchen: Kitchen) -> dict[str, Any]:
    """Wall and CPU time of ten candidates, the choice and the placement, for one object per category."""
    capture, seen, figures = kitchen.capture, set[str](), {}
    config = GenerateConfig(count=COUNT)
    for track in kitchen.tracks():
        if track.category in seen:
            continue
        seen.add(track.category)
        wall, cpu = time.perf_counter(), time.process_time()
        found = generate_candidates(capture, track, "completion", config)
        made = time.perf_counter()
        Placer()(capture, track, found.chosen)
        placed, spent = time.perf_counter(), time.process_time() - cpu
        Placer()(capture, track, replace(found.chosen, world_from_mesh=None))
        figures[track.category] = {
            "candidates": made - wall,
            "placement": placed - made,
            "total": placed - wall,
            "cpu": spent,
            "search": time.perf_counter() - placed,  # of the same mesh, treated as one from another source
        }
    return {"candidates": COUNT, "cores": os.cpu_count(), "by_category": figures}


def _rounded(value: Any) -> Any:
    """The document rounded to four decimals, with null for missing figures."""
    if isinstance(value, float):
        return round(value, 4) if np.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    return [_rounded(part) for part in value] if isinstance(value, list) else value


def _headline(value: Any) -> Any:
    """The part of a result that fits on a page."""
    if not isinstance(value, dict):
        return value
    return {key: part for key, part in value.items() if key not in ("objects", "rows") or isinstance(part, int)}


def _kitchen(seed: int, options: argparse.Namespace) -> Kitchen:
    """The sample and the finished workspace, computed if they are missing."""
    sample, work = options.samples / f"seed{seed}", options.workdir / f"seed{seed}"
    if not (sample / "scan.r3d").exists():
        write_sample(sample, seed=seed)
    stage: Stage = "export" if "scene" in options.parts else "segment"
    if not Workspace(work).names(stage):
        print(f"seed {seed}: {stage} …", file=sys.stderr, flush=True)
        request = Request(source=sample / "scan.r3d", prompts=read_prompts(sample / "prompts.json"))
        reconstruct(request, Workspace(work), until=stage)
    return Kitchen(seed=seed, sample=sample, work=work)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=_seeds, default=list(range(10)))
    parser.add_argument("--samples", type=Path, default=Path("samples"))
    parser.add_argument("--workdir", type=Path, default=Path("work"))
    parser.add_argument("--parts", type=partial(str.split, sep=","), default=list(PARTS), help=", ".join(PARTS))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--update", action="store_true")
    return parser


def _seeds(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


if __name__ == "__main__":
    sys.exit(main())
