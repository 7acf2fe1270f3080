"""Similarity from correspondences with many outliers: this project's solver and its peers on the same point sets, in one run.

`python benchmarks/registration.py` writes registration.json beside this file, docs/registration.png, and prints a table. A
thousand pairs of point sets for each outlier ratio (--shares runs some of them and keeps the others of the file: all methods
of a ratio are timed in one run); each has 1000 correspondences on the surface of a box of 0.6 x 0.54 x 0.84 m, 5 mm of noise
along each axis, a scale of 0.3 to 3, any rotation, and outliers anywhere in the box's own bounds. Open3D gets as many pairs as
fit into a minute per ratio. KISS-Matcher is optional (`pip install kiss-matcher`); it estimates no scale, so the paper's vote
over pairs (corrected by method.md row 3) provides it. OpenCV's affine inliers are fitted by a similarity. TEASER++ has no wheel
on PyPI.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.consensus import similarity_consensus
from r2c2r_core.geometry.registration import DegenerateFitError, umeyama
from r2c2r_core.geometry.transforms import Similarity3

HERE = Path(__file__).parent
SHARES = (0.6, 0.8, 0.9, 0.95, 0.98)
NOISE_M = 0.005
LIMIT_M = 3 * NOISE_M
COUNT = 1000
SECONDS = {"Open3D RANSAC, 100k": 60.0}  # for each outlier ratio; one pair takes it up to two minutes
GOOD = (3.0, 0.02, 0.02)  # degrees, metres, relative scale: stack.md section 4

Method = Callable[[np.ndarray, np.ndarray], Similarity3 | None]


class Problem(NamedTuple):
    """Correspondences, and the similarity of the inliers."""

    source: np.ndarray
    target: np.ndarray
    truth: Similarity3


def main() -> None:
    """Run all methods on all problems, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=1000, help="pairs of point sets for each share")
    parser.add_argument("--shares", type=float, nargs="*", default=SHARES)
    options = parser.parse_args()
    result = HERE / "registration.json"
    before = json.loads(result.read_text())["rows"] if result.exists() else []
    rows = [row for row in before if row["wrong"] not in options.shares]
    for method in methods().values():
        method(*problem(SHARES[0], 0)[:2])  # load what is imported on first use
    for share in options.shares:
        problems = [problem(share, seed) for seed in range(options.pairs)]
        for name, method in methods().items():
            rows.append({"method": name, "wrong": share, **measured(method, problems, SECONDS.get(name, np.inf))})
            print(rows[-1], flush=True)
    rows.sort(key=lambda row: (row["wrong"], list(methods()).index(row["method"])))
    result.write_text(json.dumps({"pairs": options.pairs, "rows": rows}, indent=1) + "\n")
    print(table(rows))
    plot(rows, HERE.parent / "docs" / "registration.png")


def methods() -> dict[str, Method]:
    """The project's solver and the installed peers."""
    found: dict[str, Method] = {"r2c2r": ours, "OpenCV estimateAffine3D": opencv}
    try:
        import kiss_matcher  # noqa: F401
    except ImportError:
        print("KISS-Matcher is not installed: left out")
    else:
        found["KISS-Matcher + scale vote"] = kiss
    try:
        import open3d  # noqa: F401
    except ImportError:
        print("Open3D is not installed: left out")
    else:
        found["Open3D RANSAC, 100k"] = open3d_ransac
    return found


def problem(share: float, seed: int) -> Problem:
    """One pair of point sets."""
    rng = np.random.default_rng([seed, round(1000 * share)])
    box = rng.uniform(-0.5, 0.5, (COUNT, 3))
    axis = rng.integers(0, 3, COUNT)
    box[np.arange(COUNT), axis] = np.sign(box[np.arange(COUNT), axis]) * 0.5
    box *= [0.6, 0.54, 0.84]
    scale = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    truth = Similarity3(scale, Rotation.random(rng=rng).as_matrix(), rng.uniform(-2, 2, 3))
    source = box / scale
    target = truth.apply(source) + rng.normal(0, NOISE_M, (COUNT, 3))
    wrong = rng.permutation(COUNT)[: round(share * COUNT)]
    target[wrong] = rng.uniform(target.min(axis=0), target.max(axis=0), (len(wrong), 3))
    return Problem(source, target, truth)


def measured(method: Method, problems: list[Problem], seconds: float) -> dict[str, float | int | None]:
    """Success rate, median errors of the successes, and median time."""
    errors, times = [], []
    for each in problems:
        started = time.perf_counter()
        found = method(each.source, each.target)
        times.append(time.perf_counter() - started)
        errors.append(error(found, each))
        if sum(times) > seconds:
            break
    off = np.array(errors)
    good = (off < GOOD).all(axis=1)
    middle = np.median(off[good], axis=0) if good.any() else [None] * 3
    return {
        "tried": len(off),
        "success": round(float(good.mean()), 4),
        "rotation_deg": None if middle[0] is None else round(float(middle[0]), 3),
        "translation_mm": None if middle[1] is None else round(1000 * float(middle[1]), 2),
        "scale_percent": None if middle[2] is None else round(100 * float(middle[2]), 3),
        "milliseconds": round(1000 * float(np.median(times)), 2),
    }


def error(found: Similarity3 | None, each: Problem) -> tuple[float, float, float]:
    """Errors in degrees, metres at the centre, and relative scale."""
    if found is None:
        return 180.0, np.inf, np.inf
    turn = Rotation.from_matrix(found.rotation.T @ each.truth.rotation).magnitude()
    middle = each.source.mean(axis=0)[None]
    apart = np.linalg.norm(found.apply(middle) - each.truth.apply(middle))
    return float(np.degrees(turn)), float(apart), abs(found.scale / each.truth.scale - 1.0)


def ours(source: np.ndarray, target: np.ndarray) -> Similarity3 | None:
    """The solver that placement and odometry use."""
    fit = similarity_consensus(source, target, threshold=LIMIT_M, rng=np.random.default_rng(0))
    return None if fit is None else fit.target_from_source


def opencv(source: np.ndarray, target: np.ndarray) -> Similarity3 | None:
    """RANSAC over affine maps, then a similarity fitted to its inliers."""
    found, _, inlier = cv2.estimateAffine3D(source[:, None], target[:, None], ransacThreshold=LIMIT_M, confidence=0.9999)
    if not found or np.count_nonzero(inlier) < 3:
        return None
    keep = inlier.ravel() > 0
    try:
        return umeyama(source[keep], target[keep])
    except DegenerateFitError:
        return None


def kiss(source: np.ndarray, target: np.ndarray) -> Similarity3 | None:
    """ROBIN pruning and a graduated non-convexity solver, at a voted scale."""
    import kiss_matcher

    scale = voted_scale(source, target)
    solver = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(LIMIT_M))
    found = solver.prune_and_solve(list((scale * source).astype(np.float32)), list(target.astype(np.float32)))
    if not found.valid:
        return None
    return Similarity3(scale, np.asarray(found.rotation, dtype=np.float64), np.ravel(found.translation).astype(np.float64))


def voted_scale(source: np.ndarray, target: np.ndarray) -> float:
    """The scale on which most of 20 000 pairs' length ratios agree, within the noise."""
    first, second = np.random.default_rng(0).integers(0, len(source), (2, 20000))
    of_source = np.linalg.norm(source[first] - source[second], axis=1)
    of_target = np.linalg.norm(target[first] - target[second], axis=1)
    long = (of_source > 1e-6) & (of_target > 0.05)
    ratio, tolerance = np.log(of_target[long] / of_source[long]), np.clip(LIMIT_M / of_target[long], 1e-3, 0.2)
    ends = np.concatenate([ratio - tolerance, ratio + tolerance])
    order = np.argsort(ends, kind="stable")
    votes = np.cumsum(np.repeat([1, -1], len(ratio))[order])
    top = int(np.argmax(votes))
    return float(np.exp((ends[order][top] + ends[order][min(top + 1, len(ends) - 1)]) / 2))


def open3d_ransac(source: np.ndarray, target: np.ndarray) -> Similarity3 | None:
    """RANSAC over similarities of three correspondences, with at most 100 000 iterations."""
    import open3d

    registration = open3d.pipelines.registration
    clouds = [open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points)) for points in (source, target)]
    pairs = np.repeat(np.arange(len(source), dtype=np.int32)[:, None], 2, axis=1)
    found = registration.registration_ransac_based_on_correspondence(
        *clouds,
        open3d.utility.Vector2iVector(pairs),
        LIMIT_M,
        registration.TransformationEstimationPointToPoint(True),
        3,
        [],
        registration.RANSACConvergenceCriteria(100_000, 0.9999),
    ).transformation
    determinant = np.linalg.det(found[:3, :3])
    if determinant <= 0:
        return None
    scale = float(np.cbrt(determinant))
    return Similarity3(scale, found[:3, :3] / scale, found[:3, 3].copy())


def table(rows: list[dict[str, object]]) -> str:
    """Success rate and time of each method and outlier ratio, in Markdown."""
    lines = [
        "| method | " + " | ".join(f"{share:.0%} wrong" for share in SHARES) + " |",
        "|---|" + "---|" * len(SHARES),
    ]
    for name in dict.fromkeys(str(row["method"]) for row in rows):
        cells = []
        for row in (r for r in rows if r["method"] == name):
            error_text = "" if row["translation_mm"] is None else f"{row['rotation_deg']:.2f}° {row['translation_mm']:.1f} mm, "
            cells.append(f"**{row['success']:.0%}**, {error_text}{row['milliseconds']:.1f} ms")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plot(rows: list[dict[str, object]], path: Path) -> None:
    """Plot of success rate and time over the outlier ratio."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), constrained_layout=True)
    for name in dict.fromkeys(str(row["method"]) for row in rows):
        own = [row for row in rows if row["method"] == name]
        style = {"marker": "o", "label": name, "linewidth": 2.4 if name == "r2c2r" else 1.2}
        places = range(len(own))
        left.plot(places, [100 * float(str(row["success"])) for row in own], **style)
        right.plot(places, [float(str(row["milliseconds"])) for row in own], **style)
    right.set_yscale("log")
    for axes, title in ((left, "recovered, %"), (right, "time of one, ms")):
        axes.set_xticks(range(len(SHARES)), [f"{share:.0%}" for share in SHARES])
        axes.set_xlabel("wrong correspondences")
        axes.set_title(title)
        axes.grid(alpha=0.3)
    left.legend(fontsize=8, loc="lower left")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
