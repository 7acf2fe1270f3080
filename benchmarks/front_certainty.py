"""Fit of the logistic model for the confidence of a front's edges, on kitchens with ground truth.

    python benchmarks/front_certainty.py KITCHEN… [--clicks 5] [--workdir DIR]

Clicks, edges and the criterion for a right front are those of segment_fronts.py. The model's features are `evidence` of
r2c2r_core/segment/fronts/certainty.py; the printed coefficients belong into that module's Params. A front counts once, however
often it was clicked, and the wrong fronts of a kitchen weigh no more than MOST_WRONG: they mostly share one cause. Also prints
how many of the wrong and of the right fronts are less sure than the product's threshold, with their kitchen held out.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from segment_fronts import RIGHT_MM, clicks_on, off_mm, opened, true_fronts

from r2c2r_core.errors import R2C2RError
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.contradictions import Params, has_seams
from r2c2r_core.segment.fronts.certainty import evidence
from r2c2r_core.segment.fronts.found import FoundFront

MOST_WRONG, PRIOR = 4.0, 1.0  # PRIOR: precision of the coefficients' prior, in units of each feature's standard deviation
NAMES = ("faint", "contrast", "rival", "front", "offset")


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A front as found: features of its four edges (4, 5), which edges are wrong, and the probability of a seam inside."""

    kitchen: str
    seen: np.ndarray
    wrong: np.ndarray
    seam: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Click, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchens", type=Path, nargs="+")
    parser.add_argument("--clicks", type=int, default=5)
    parser.add_argument("--workdir", type=Path, default=Path("fronts-work"))
    options = parser.parse_args(arguments)
    cases = [case for folder in options.kitchens for case in found(folder, options.workdir / folder.name, options.clicks)]
    print(" ".join(f"{name} {number:.2f}" for name, number in zip(NAMES, fitted(cases), strict=True)))
    flagged = {case: unsure(case, fitted([other for other in cases if other.kitchen != case.kitchen])) for case in cases}
    for word, among in (("wrong", [c for c in cases if c.wrong.any()]), ("right", [c for c in cases if not c.wrong.any()])):
        print(f"{sum(flagged[case] for case in among)} of {len(among)} {word} fronts are unsure, their kitchen held out")
    return 0


def found(kitchen: Path, folder: Path, clicks: int) -> list[Case]:
    """The distinct fronts found from clicks in a kitchen."""
    session, capture = opened(kitchen, folder)
    rng, cases = np.random.default_rng(0), {}
    for front in true_fronts(kitchen / "truth.json", capture.world_from_capture):
        category = category_of(front.category)
        for click in clicks_on(session.scene, front, clicks, rng):
            try:
                one = session.find(ObjectPrompt(name=front.name, category=front.category, points=(click,)))
            except R2C2RError:
                continue
            panel = one.panel()
            if isinstance(one, FoundFront) and panel is not None:
                left, right, bottom, top = np.abs(off_mm(front, panel)) > RIGHT_MM
                seam = 0.0 if has_seams(category, panel.width_m) else panel.seam
                seen = evidence(one.front.run, one.front.cell)
                cases[front.name, one.front.cell] = Case(kitchen.name, seen, np.array([left, right, top, bottom]), seam)
    return list(cases.values())


def fitted(cases: Sequence[Case]) -> np.ndarray:
    """The five coefficients of the maximum a posteriori logistic regression, by Newton's method."""
    seen, wrong = np.stack([case.seen for case in cases]), np.stack([case.wrong for case in cases])
    bad = {case.kitchen: sum(other.wrong.any() for other in cases if other.kitchen == case.kitchen) for case in cases}
    weight = np.array([min(1.0, MOST_WRONG / bad[case.kitchen]) if case.wrong.any() else 1.0 for case in cases])
    x, y, w = seen.reshape(-1, seen.shape[-1]), ~wrong.reshape(-1), np.repeat(weight, 4)
    prior = PRIOR * x.std(axis=0) ** 2 + 1e-9
    numbers = np.zeros(x.shape[1])
    for _ in range(50):
        p = 1 / (1 + np.exp(-np.clip(x @ numbers, -30, 30)))
        bend = (x * (w * p * (1 - p))[:, None]).T @ x + np.diag(prior)
        numbers -= np.linalg.solve(bend, x.T @ (w * (p - y)) + prior * numbers)
    return numbers


def unsure(case: Case, numbers: np.ndarray) -> bool:
    """Whether the product would mark the front as unsure."""
    edges = 1 / (1 + np.exp(-(case.seen @ numbers)))
    return bool(np.prod(edges) * (1 - case.seam) < Params().unsure_front)


if __name__ == "__main__":
    sys.exit(main())
