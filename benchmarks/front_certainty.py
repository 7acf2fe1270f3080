"""Fit and calibration of the probability that a front or an appliance's face is right, on kitchens with ground truth.

    python benchmarks/front_certainty.py KITCHEN… [--clicks 4] [--workdir DIR] [--update]

Clicks are those of segment_fronts.py, on the faces of appliances too. A face is right if each edge is within 10 mm, or 2.5 % of
that side, of the truth's. It counts once, however often it was clicked. The model's features are `evidence` of
r2c2r_core/segment/certainty.py; the printed weights belong into that module's Params. Each maker of kitchens (the
folder's name up to the first hyphen) weighs the same. The table is of predictions with the kitchen held out. --update writes
benchmarks/front_certainty.json.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from recordings import recording_in
from segment_fronts import TrueFront, clicks_on, off_mm, opened_recording, true_fronts

from r2c2r_core.errors import R2C2RError
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.certainty import evidence
from r2c2r_core.segment.contradictions import Params

RESULTS = Path(__file__).resolve().parent / "front_certainty.json"
RIGHT_MM, RIGHT_SHARE = 10.0, 0.025
PRIOR = 1.0  # precision of the coefficients' prior, in units of each feature's standard deviation
NAMES = ("faintest", "seam", "offset")
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A face as found: the model's features (3,), and whether all of its edges are right."""

    kitchen: str
    seen: np.ndarray
    right: bool

    @property
    def maker(self) -> str:
        """Maker of the kitchen."""
        return self.kitchen.partition("-")[0]


def main(arguments: Sequence[str] | None = None) -> int:
    """Click, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchens", type=Path, nargs="+")
    parser.add_argument("--clicks", type=int, default=4)
    parser.add_argument("--workdir", type=Path, default=Path("fronts-work"))
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    cases = [case for folder in options.kitchens for case in found(folder, options.workdir / folder.name, options.clicks)]
    figures = judged(cases)
    print(json.dumps(figures, indent=1))
    if options.update:
        RESULTS.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


def found(kitchen: Path, folder: Path, clicks: int) -> list[Case]:
    """The distinct faces found from clicks in a kitchen."""
    session, capture = opened_recording(recording_in(kitchen), folder)
    rng, cases = np.random.default_rng(0), {}
    for front in true_fronts(kitchen / "truth.json", capture.world_from_capture, kinds=("front", "appliance")):
        for click in clicks_on(session.scene, front, clicks, rng):
            try:
                panel = session.find(ObjectPrompt(name=front.name, category=front.category, points=(click,))).panel()
            except R2C2RError:
                continue
            if panel is not None and panel.edges:
                seen = evidence(panel, category_of(front.category))
                cases[front.name, panel.edges] = Case(kitchen.name, seen, is_right(front, off_mm(front, panel)))
    return list(cases.values())


def is_right(front: TrueFront, off: np.ndarray) -> bool:
    """Whether errors of the edges (left, right, bottom, top) in millimetres are tolerable."""
    sides_mm = 1000 * np.array([front.width_m, front.width_m, front.height_m, front.height_m])
    return bool((np.abs(off) <= np.maximum(RIGHT_MM, RIGHT_SHARE * sides_mm)).all())


def judged(cases: Sequence[Case]) -> dict[str, Any]:
    """Weights, and the held-out predictions against what was right."""
    right, told = np.array([case.right for case in cases]), np.zeros(len(cases))
    for kitchen in {case.kitchen for case in cases}:
        held_out = np.array([case.kitchen == kitchen for case in cases])
        numbers = fitted([case for case in cases if case.kitchen != kitchen])
        told[held_out] = probabilities(np.stack([case.seen for case in cases if case.kitchen == kitchen]), numbers)
    rows = []
    for low, high in pairwise(BINS):
        inside = (told >= low) & ((told < high) | (high == 1.0))
        if inside.any():
            claimed, share = round(float(told[inside].mean()), 3), round(float(right[inside].mean()), 3)
            rows.append({"from": low, "to": high, "faces": int(inside.sum()), "claimed": claimed, "right": share})
    unsure, makers = told < Params().unsure_front, {case.maker for case in cases}
    return {
        "kitchens": len({case.kitchen for case in cases}),
        "faces": {maker: sum(case.maker == maker for case in cases) for maker in sorted(makers)},
        "weights": dict(zip(NAMES, fitted(cases).round(3).tolist(), strict=True)),
        "held_out": rows,
        "off": round(sum(row["faces"] * abs(row["claimed"] - row["right"]) for row in rows) / len(cases), 3),
        "wrong": int((~right).sum()),
        "wrong_unsure": int((unsure & ~right).sum()),
        "right_unsure": int((unsure & right).sum()),
    }


def probabilities(seen: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """The model's probability of each row of features."""
    return np.asarray(1 / (1 + np.exp(-np.clip(seen @ numbers, -30, 30))))


def fitted(cases: Sequence[Case]) -> np.ndarray:
    """Weights of the maximum a posteriori logistic regression, by Newton's method; each maker has the same total weight."""
    x, y = np.stack([case.seen for case in cases]), np.array([case.right for case in cases])
    makers = [case.maker for case in cases]
    share = np.array([len(cases) / len(set(makers)) / makers.count(maker) for maker in makers])
    prior, numbers = PRIOR * x.std(axis=0) ** 2 + 1e-9, np.zeros(x.shape[1])
    for _ in range(50):
        p = probabilities(x, numbers)
        bend = (x * (share * p * (1 - p))[:, None]).T @ x + np.diag(prior)
        numbers -= np.linalg.solve(bend, x.T @ (share * (p - y)) + prior * numbers)
    return numbers


if __name__ == "__main__":
    sys.exit(main())
