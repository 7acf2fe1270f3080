import itertools

import numpy as np

from r2c2r_core.segment.motion.path import Params, best_path


def test_best_path_matches_exhaustive_search() -> None:
    """Compared with all paths of a small problem."""
    log = np.random.default_rng(2).normal(0, 2, (6, 4))
    params = Params()

    def worth(path: tuple[int, ...]) -> float:
        moves = sum(min(params.step_cost * abs(a - b), params.jump_cost) for a, b in itertools.pairwise(path))
        return float(sum(log[k, state] for k, state in enumerate(path))) - moves

    best = max(itertools.product(range(4), repeat=6), key=worth)
    path, total = best_path(log)
    assert tuple(path) == best
    np.testing.assert_allclose(total, worth(best))
