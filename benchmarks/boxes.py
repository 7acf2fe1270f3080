"""Minimum bounding boxes (exact, the paper's Powell search, trimesh's oriented bounds) by volume, size error and time.

    python benchmarks/boxes.py [--poses 10] [--update]

Shapes are sampled on their surface (3000 points, 2 mm noise) in random poses. With known gravity only the yaw is random, and
rotating calipers in plan are compared too; otherwise the whole orientation is random. The ratio is a box's volume over the
smallest that any method found in that pose; size errors are relative to the shape's own box. --update writes
benchmarks/boxes.json. Takes about two minutes.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.free_boxes import powell_box, smallest_box
from r2c2r_core.geometry.meshes import box_mesh, sample_surface

FIGURES = Path(__file__).resolve().parent / "boxes.json"
POINTS, NOISE_M = 3000, 0.002
Method = Callable[[Points], np.ndarray]  # returns the sizes of the box

METHODS: dict[str, Method] = {
    "exact (hull faces)": lambda points: smallest_box(points).size_m,
    "Powell, 1 start (paper)": lambda points: powell_box(points).size_m,
    "Powell, 4 starts": lambda points: powell_box(points, starts=4).size_m,
    "trimesh oriented bounds": lambda points: np.asarray(trimesh.bounds.oriented_bounds(points)[1]),
}
UPRIGHT: dict[str, Method] = {
    "exact (calipers in plan)": lambda points: upright_box(points).size_m,
    "the same, trimmed": lambda points: upright_box(points, trim=0.004).size_m,  # as the product measures it
}
PARTS: dict[str, list[tuple[tuple[float, float, float], tuple[float, float, float]]]] = {  # boxes: low and high corner
    "drawer front": [((-0.3, -0.01, -0.1), (0.3, 0.01, 0.1))],
    "base cabinet": [((-0.3, -0.29, -0.36), (0.3, 0.29, 0.36))],
    "square base with a handle": [((-0.3, -0.29, -0.36), (0.3, 0.3, 0.36)), ((0.22, -0.325, 0.0), (0.24, -0.29, 0.2))],
    "microwave": [((-0.25, -0.18, -0.14), (0.25, 0.18, 0.14)), ((0.1, -0.215, -0.09), (0.12, -0.18, 0.09))],
    "chair": [
        ((-0.2, -0.2, -0.02), (0.2, 0.2, 0.02)),
        ((-0.2, 0.16, 0.02), (0.2, 0.2, 0.45)),
        *(((x, y, -0.45), (x + 0.04, y + 0.04, -0.02)) for x in (-0.2, 0.16) for y in (-0.2, 0.16)),
    ],
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, save."""
    parser = argparse.ArgumentParser(description="The exact box against Powell's and trimesh's.")
    parser.add_argument("--poses", type=int, default=10, help="random poses of each shape")
    parser.add_argument("--update", action="store_true", help=f"write {FIGURES.name}")
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(0)
    smallest_box(rng.random((50, 3)))  # the first call imports its dependencies
    document = {"version": 1, "poses": options.poses, "points": POINTS, "noise_mm": 1000 * NOISE_M} | {
        "gravity_unknown": measured(METHODS, options.poses, rng, upright=False),
        "gravity_known": measured(UPRIGHT | METHODS, options.poses, rng, upright=True),
    }
    print(json.dumps(document, indent=1))
    if options.update:
        FIGURES.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


def measured(methods: Mapping[str, Method], poses: int, rng: np.random.Generator, *, upright: bool) -> dict[str, Any]:
    """Each method's figures over all shapes and poses."""
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in methods}
    for name in PARTS:
        for _ in range(poses):
            points, size = shape(name, rng)
            turn = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)) if upright else Rotation.random(rng=rng)
            for method, row in one_pose(methods, points @ turn.as_matrix().T, size).items():
                found[method].append(row)
    return {name: figures(rows) for name, rows in found.items()}


def one_pose(methods: Mapping[str, Method], points: Points, size: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """Per method: volume over the smallest found here, error of the worst side (mm), time (ms)."""
    sizes, spent = {}, {}
    for name, method in methods.items():
        started = time.perf_counter()
        sizes[name] = np.sort(method(points))
        spent[name] = 1000 * (time.perf_counter() - started)
    least = min(float(s.prod()) for n, s in sizes.items() if "trimmed" not in n)
    return {n: (float(s.prod()) / least, 1000 * float(np.abs(s - np.sort(size)).max()), spent[n]) for n, s in sizes.items()}


def figures(rows: Sequence[tuple[float, float, float]]) -> dict[str, float]:
    """Means and worst cases."""
    ratio, error, spent = np.array(rows).T
    return {
        "volume_ratio_mean": round(float(ratio.mean()), 4),
        "volume_ratio_worst": round(float(ratio.max()), 4),
        "share_over_1_percent": round(float((ratio > 1.01).mean()), 4),
        "size_error_mm_mean": round(float(error.mean()), 2),
        "size_error_mm_worst": round(float(error.max()), 2),
        "ms_median": round(float(np.median(spent)), 2),
    }


def shape(name: str, rng: np.random.Generator) -> tuple[Points, np.ndarray]:
    """Noisy points of a shape's surface, and the size of its own box."""
    boxes = [box_mesh(np.array(low), np.array(high)) for low, high in PARTS[name]]
    vertices = np.concatenate([v for v, _ in boxes])
    faces = np.concatenate([f + 8 * k for k, (_, f) in enumerate(boxes)])
    points, _ = sample_surface(vertices, faces, POINTS, rng)
    return points + rng.normal(size=points.shape) * NOISE_M, np.ptp(vertices, axis=0)


if __name__ == "__main__":
    sys.exit(main())
