"""A kind of solid that cannot be made does not prevent the others."""

import numpy as np
import pytest

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate import completion, things
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.shape import thing_model
from r2c2r_core.generate.variation import whole_pool
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3


def fails(variation):
    raise GenerationFailed("carving left nothing")


def cube(variation):
    return thing_model(box_mesh(np.array([-0.04, -0.04, 0.9]), np.array([0.04, 0.04, 1.0])), Rigid3(), {})


@pytest.fixture
def evidence(bottle_scene):
    return gather_evidence(*bottle_scene, 4)


@pytest.mark.parametrize("usable", ["round", "box"])
def test_a_usable_hypothesis_precedes_a_failing_carved_one(evidence, monkeypatch, usable):
    made = {name: (Hypothesis(name, cube),) if name == usable else () for name in ("round", "box")}
    monkeypatch.setattr(things, "round_family", lambda *_: (made["round"], False))
    monkeypatch.setattr(things, "carton_family", lambda *_: made["box"])
    monkeypatch.setattr(things, "carved_family", lambda *_, **__: (Hypothesis("carved", fails),))
    assert [h.assumes for h in things.thing_hypotheses(evidence, whole_pool(evidence))] == [usable, "carved"]


def test_failing_hypotheses_are_computed_once_for_all_candidates(evidence, monkeypatch):
    asked = []
    monkeypatch.setattr(completion, "thing_hypotheses", lambda *_: asked.append(1) or fails(None))
    generator = completion.Completion()
    for name in ("c0", "c1", "c2"):
        with pytest.raises(GenerationFailed, match="carving left nothing"):
            generator.make(evidence, name, 0)
    assert len(asked) == 1
