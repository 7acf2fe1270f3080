"""Selection among candidate poses: stable poses are preferred to toppling ones, and rivals are compared after refinement."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.align.hypotheses import Hypothesis
from r2c2r_core.align.judge import judge
from r2c2r_core.align.observe import observe
from r2c2r_core.align.search import Case, Trial, finish_contenders, lean_deg, resized, turned_otherwise
from r2c2r_core.align.shape import prepare_shape
from r2c2r_core.geometry.transforms import Similarity3


@pytest.fixture(scope="module")
def bottle(bench: Any) -> Case:
    """A plain bottle in its place, seen in few coarse views, which hardly constrain its tilt."""
    thing, capture, track = bench.bottle()
    shape = prepare_shape(thing, point_count=4000, face_limit=6000, rng=np.random.default_rng(0))
    observation = observe(capture, track, view_count=2, size_px=64, point_count=60)
    return Case(shape=shape, observation=observation, track=track, lifted=[])


def trial(case: Case, *, lean: float = 0.0, scale: float = 1.0) -> Trial:
    """The bottle tilted about its base by `lean` degrees, as a feature match without an upright axis may propose it."""
    pose = Similarity3(scale, Rotation.from_euler("x", lean, degrees=True).as_matrix(), np.zeros(3))
    return Trial(
        hypothesis=Hypothesis(pose, None, "features"), judgement=judge(pose, case.shape, case.observation.views, case.front)
    )


def test_lean_is_measured_from_the_nearest_stable_pose(bottle: Case) -> None:
    assert lean_deg(trial(bottle).pose, bottle) == 0.0
    assert lean_deg(trial(bottle, lean=12.0).pose, bottle) == pytest.approx(12.0, abs=1.0)


def test_a_leaning_bottle_is_set_upright(bottle: Case) -> None:
    best = finish_contenders([trial(bottle, lean=25.0)], bottle)[0]
    assert lean_deg(best.pose, bottle) == 0.0


def test_what_stands_on_legs_is_placed_with_its_base_level(bottle: Case) -> None:
    """Things slide off a table top that leans with a bent scan; a bottle's rough base tells less than the scan."""
    chair = replace(bottle, track=replace(bottle.track, category="chair"))
    (base,) = [base for base in chair.shape.bases if base[2] > 0.9]
    poses = [finish_contenders([trial(case, lean=2.0)], case)[0].pose for case in (chair, bottle)]
    leans = [np.degrees(np.arccos((pose.rotation @ base)[2])) for pose in poses]
    assert leans[0] < 1e-3 < leans[1]


def test_rival_poses_are_distinguished_by_size_and_rotation(bottle: Case) -> None:
    best = trial(bottle)
    assert resized(trial(bottle, scale=1.1), best)
    assert not resized(trial(bottle, scale=1.02), best)
    assert turned_otherwise(trial(bottle, lean=180.0), best, bottle.shape)
    spun = Similarity3(1.0, Rotation.from_euler("z", 90, degrees=True).as_matrix(), np.zeros(3))
    assert not turned_otherwise(
        best.__class__(hypothesis=Hypothesis(spun, None, "box"), judgement=best.judgement), best, bottle.shape
    )


def test_rival_poses_are_refined_before_comparison(bottle: Case) -> None:
    rough = trial(bottle, scale=1.08)
    finished = finish_contenders([trial(bottle), rough], bottle)
    assert len(finished) == 2
    assert not any(resized(t, finished[0]) for t in finished[1:])  # both converge to the same size: no ambiguity
