"""The generation stage as the pipeline calls it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.config import config_from
from r2c2r_core.errors import Cancelled, GenerationFailed, InputError, ObjectNotSeen
from r2c2r_core.generate.candidates import select_candidate
from r2c2r_core.generate.completion import Completion
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, generate_candidates
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, join_vertices, volume
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.progress import Progress

FEW = GenerateConfig(count=3, pool_frames=10)


@pytest.fixture(scope="module")
def bottles(bottle_scene):
    return generate_candidates(*bottle_scene, "completion", FEW)


def test_every_candidate_is_closed_manifold_outward_and_textured(bottles, front_scene):
    doors = generate_candidates(*front_scene, "completion", replace(FEW, count=2))
    for asset in (*bottles.candidates, *doors.candidates):
        mesh = asset.mesh
        assert asset.watertight
        assert is_watertight(mesh.vertices, mesh.faces)
        assert is_manifold(mesh.vertices, mesh.faces)
        assert volume(*join_vertices(mesh.vertices, mesh.faces)) > 0
        assert len(mesh.uv) == len(mesh.vertices)
        assert (mesh.uv >= 0).all()
        assert (mesh.uv <= 1).all()
        assert asset.metrics["seen_fraction"] > 0.1
        assert mesh.texture.std() > 0


def test_candidates_are_normalised_and_carry_their_world_pose(bottles):
    for asset in bottles.candidates:
        vertices = asset.mesh.vertices
        assert np.ptp(vertices, axis=0).max() == pytest.approx(1.0)
        assert np.abs(vertices.max(axis=0) + vertices.min(axis=0)).max() < 1e-9
        stood = asset.world_from_mesh.apply(vertices)
        np.testing.assert_allclose((stood.max(axis=0) + stood.min(axis=0)) / 2, (0.0, 0.0, 1.04), atol=0.01)
        np.testing.assert_allclose(np.ptp(stood, axis=0), (0.08, 0.08, 0.28), atol=0.02)


def test_meshes_are_reproducible_per_seed_and_differ_between_seeds(bottles, bottle_scene):
    again = generate_candidates(*bottle_scene, "completion", FEW)
    other = generate_candidates(*bottle_scene, "completion", replace(FEW, count=1), seed=1)
    for a, b in zip(bottles.candidates, again.candidates, strict=True):
        assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
        assert np.array_equal(a.mesh.faces, b.mesh.faces)
        assert np.array_equal(a.mesh.texture, b.mesh.texture)
        assert a.metrics == b.metrics
    assert again.chosen_id == bottles.chosen_id
    for a, b in zip(bottles.candidates, other.candidates, strict=False):
        assert a.mesh.vertices.shape != b.mesh.vertices.shape or not np.allclose(a.mesh.vertices, b.mesh.vertices, atol=1e-3)
        assert a.parameters != b.parameters


def test_candidates_report_their_parameters_and_fit_metrics(bottles):
    for asset in bottles.candidates:
        assert {"frames", "erosion_px", "bbox_percentile", "carve_votes", "voxel_m", "depth_scale"} <= set(asset.parameters)
        assert {"extent_middle", "extent_short", "volume_ratio", "faces", "seen_fraction", "mask_iou"} <= set(asset.metrics)
        assert asset.metrics["mask_iou"] > 0.6
        json.dumps([asset.parameters, asset.metrics])  # plain numbers
    assert bottles.chosen.metrics["mask_iou"] > 0.85
    assert len({asset.assumes for asset in bottles.candidates}) > 1


def test_the_choice_has_a_short_reason_and_a_full_ranking(bottles):
    assert bottles.chosen_by == "consensus"
    assert bottles.ranking[0] == bottles.chosen_id
    assert sorted(bottles.ranking) == ["c0", "c1", "c2"]
    assert bottles.reason.startswith(bottles.chosen_id)
    assert "fit to masks and depth" in bottles.reason
    assert bottles.reason.count(". ") <= 2


def test_a_rejected_candidate_is_ranked_last(bottles):
    other = select_candidate(bottles, ObjectOverride(rejected=(bottles.chosen_id,)), FEW.rule)
    assert other.chosen_id != bottles.chosen_id
    assert other.ranking[-1] == bottles.chosen_id


def test_a_failing_candidate_does_not_fail_the_object(bottle_scene, monkeypatch):
    make = Completion.make

    def sometimes(self, evidence, candidate_id, seed):
        if candidate_id == "c1":
            raise ValueError("planted")
        return make(self, evidence, candidate_id, seed)

    monkeypatch.setattr(Completion, "make", sometimes)
    found = generate_candidates(*bottle_scene, "completion", FEW)
    assert [c.candidate_id for c in found.candidates] == ["c0", "c2"]


def test_failure_of_all_candidates_raises_with_cause_and_advice(bottle_scene, monkeypatch):
    def never(self, evidence, candidate_id, seed):
        raise ValueError("planted")

    monkeypatch.setattr(Completion, "make", never)
    with pytest.raises(GenerationFailed, match=r"bottle_1: all 3 candidates failed: planted; .*click"):
        generate_candidates(*bottle_scene, "completion", FEW)


def test_a_track_without_masks_raises(bottle_scene):
    capture, track = bottle_scene
    with pytest.raises(ObjectNotSeen, match="bottle_1"):
        generate_candidates(capture, replace(track, masks={}), "completion", FEW)


def test_generation_can_be_cancelled(bottle_scene):
    with pytest.raises(Cancelled):
        generate_candidates(*bottle_scene, "completion", FEW, progress=Progress(is_cancelled=lambda: True))


@pytest.mark.parametrize("count", [0, 11])
def test_a_candidate_count_outside_1_to_10_is_rejected(count):
    with pytest.raises(InputError, match="1 to 10"):
        config_from({"generate": {"count": count}}, "config.json")


def test_the_default_generator_is_available_without_extras():
    assert GENERATORS.default == "completion"
    assert GENERATORS.available("completion") == (True, "ready")
