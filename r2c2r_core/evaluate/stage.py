"""Evaluation of a bundle against truth (paper section 5, with the definitions of the product's metric set)."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.extents import extent_errors
from r2c2r_core.evaluate.iou import mask_errors, mask_not_given
from r2c2r_core.evaluate.joints import joint_errors
from r2c2r_core.evaluate.motions import motion_errors, open_frames
from r2c2r_core.evaluate.pose import pose_errors
from r2c2r_core.evaluate.records import ObjectRecord, read_bundle, read_truth
from r2c2r_core.evaluate.shape import box_iou, shape_errors
from r2c2r_core.evaluate.table import to_text
from r2c2r_core.model.report import Metric

MIN_BOX_IOU = 0.25  # minimum overlap for matching objects of different names
VERSION = 1

Comparison = Callable[[ObjectRecord, ObjectRecord], tuple[Metric, ...]]
COMPARISONS: tuple[Comparison, ...] = (extent_errors, pose_errors, joint_errors, motion_errors, shape_errors)


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectRow:
    """One true object with its reconstruction metrics."""

    name: str
    category: str
    matched: str | None  # name in the bundle; None: it is missing there
    metrics: tuple[Metric, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """Metrics of all objects, and their means."""

    rows: tuple[ObjectRow, ...]
    scene: tuple[Metric, ...]
    surplus: tuple[str, ...]  # objects of the bundle that match no true one

    def to_json(self) -> dict[str, Any]:
        """The versioned document of `--json`."""
        return {
            "version": VERSION,
            "scene": {metric.name: _metric_entry(metric) for metric in self.scene},
            "objects": [
                {
                    "name": row.name,
                    "category": row.category,
                    "matched": row.matched,
                    "metrics": {metric.name: _metric_entry(metric) for metric in row.metrics},
                }
                for row in self.rows
            ],
            "surplus": list(self.surplus),
        }

    def to_text(self) -> str:
        """A table for a terminal."""
        lines = [to_text([(row.name, row.category, row.metrics) for row in self.rows], self.scene)]
        missing = [row.name for row in self.rows if row.matched is None]
        if missing:
            lines.append(f"not in the bundle: {', '.join(missing)}")
        if self.surplus:
            lines.append(f"in the bundle, without ground truth: {', '.join(self.surplus)}")
        return "\n".join(lines)


def evaluate_bundle(bundle: Path, truth: Path, *, masks: Path | None = None) -> Evaluation:
    """Compare a bundle (zip or folder) with truth.json; `masks` is the output of `r2c2r run --masks`.

    Raises BundleError when a file cannot be read. True masks are read from truth_masks/ beside the truth file.
    """
    if masks is not None and not masks.is_dir():
        raise BundleError(f"{masks}: no such folder", hint="give the folder that r2c2r run --masks wrote")
    record = read_bundle(bundle)
    truths = read_truth(truth, record.world_from_capture)
    rows = compare_objects(truths, record.objects, truth.parent / "truth_masks", masks)
    taken = {row.matched for row in rows}
    surplus = tuple(thing.name for thing in record.objects if thing.name not in taken)
    return Evaluation(rows=rows, scene=scene_metrics(rows), surplus=surplus)


def compare_objects(
    truths: tuple[ObjectRecord, ...], found: tuple[ObjectRecord, ...], truth_masks: Path, masks: Path | None
) -> tuple[ObjectRow, ...]:
    """Every true object with its figures; without `masks`, those of masks are None."""
    return tuple(
        _row(true, match, truth_masks, masks) for true, match in zip(truths, match_objects(truths, found), strict=True)
    )


def match_objects(truths: tuple[ObjectRecord, ...], found: tuple[ObjectRecord, ...]) -> list[ObjectRecord | None]:
    """The found object for each true one: by name, the rest by box IoU (Hungarian, at least MIN_BOX_IOU)."""
    by_name = {thing.name: thing for thing in found}
    matches = [by_name.get(true.name) for true in truths]
    taken = {thing.name for thing in matches if thing is not None}
    rest = [i for i, match in enumerate(matches) if match is None]
    free = [thing for thing in found if thing.name not in taken]
    if rest and free:
        overlap = np.array([[box_iou(truths[i], thing) for thing in free] for i in rest])
        for row, column in zip(*linear_sum_assignment(-overlap), strict=True):
            if overlap[row, column] >= MIN_BOX_IOU:
                matches[rest[row]] = free[column]
    return matches


def _row(true: ObjectRecord, found: ObjectRecord | None, truth_masks: Path, masks: Path | None) -> ObjectRow:
    if found is None:
        return ObjectRow(name=true.name, category=true.category, matched=None, metrics=())
    compared = [metric for compare in COMPARISONS for metric in compare(true, found)]
    if masks is None:
        compared += mask_not_given("no masks were given")
    elif not (truth_masks / true.name).is_dir():
        compared += mask_not_given("the truth has no masks")
    else:
        compared += mask_errors(truth_masks / true.name, masks / found.name, open_frames(true))
    return ObjectRow(name=true.name, category=true.category, matched=found.name, metrics=tuple(compared))


def scene_metrics(rows: tuple[ObjectRow, ...]) -> tuple[Metric, ...]:
    """The fraction of objects found, and the mean of every metric over the objects it applies to."""
    share = float(np.mean([row.matched is not None for row in rows])) if rows else None
    means = [
        Metric(
            name="objects_found", value=share, unit="share", better="higher", tolerance=0.0, note=f"{len(rows)} true objects"
        )
    ]
    columns: dict[str, list[Metric]] = {}
    for row in rows:
        for metric in row.metrics:
            columns.setdefault(metric.name, []).append(metric)
    for name, metrics in columns.items():
        values = [metric.value for metric in metrics if metric.value is not None]
        first = metrics[0]
        means.append(
            Metric(
                name=name,
                value=float(np.mean(values)) if values else None,
                unit=first.unit,
                better=first.better,
                tolerance=first.tolerance,
                note=f"mean over {len(values)} objects",
            )
        )
    return tuple(means)


def _metric_entry(metric: Metric) -> dict[str, Any]:
    return {
        "value": metric.value,
        "unit": metric.unit,
        "better": metric.better,
        "tolerance": metric.tolerance,
        "note": metric.note,
    }
