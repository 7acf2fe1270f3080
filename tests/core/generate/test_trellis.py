"""The TRELLIS adapter against modules with the real package's names and signatures (microsoft/TRELLIS 442aa1e)."""

import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.errors import BackendUnavailable, GenerationFailed
from r2c2r_core.generate import trellis
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.geometry.meshes import is_watertight
from r2c2r_core.registry import find_weights
from tests.core.generate.stub import textured_box

WEIGHTS = Path("weights")


class FakePipeline:
    """Signatures of TrellisImageTo3DPipeline; rejects the inputs that crash the real one."""

    def __init__(self):
        self.calls = []
        self.on_gpu = False

    @staticmethod
    def from_pretrained(path):
        if "absent" in str(path):
            raise OSError(f"{path} is not a local folder and is not a valid model identifier\nmore")
        return FakePipeline()

    def cuda(self):
        self.on_gpu = True

    def run(
        self,
        image,
        num_samples=1,
        seed=42,
        sparse_structure_sampler_params=None,
        slat_sampler_params=None,
        formats=("mesh", "gaussian", "radiance_field"),
        preprocess_image=True,
    ):
        return self._outputs("run", [image], seed, sparse_structure_sampler_params, slat_sampler_params, formats, None)

    def run_multi_image(
        self,
        images,
        num_samples=1,
        seed=42,
        sparse_structure_sampler_params=None,
        slat_sampler_params=None,
        formats=("mesh", "gaussian", "radiance_field"),
        preprocess_image=True,
        mode="stochastic",
    ):
        return self._outputs("multi", images, seed, sparse_structure_sampler_params, slat_sampler_params, formats, mode)

    def _outputs(self, call, images, seed, structure, latent, formats, mode):
        assert self.on_gpu
        for image in images:
            alpha = np.asarray(image)[..., 3]
            assert image.mode == "RGBA"
            assert not (alpha == 255).all()  # the real one would call rembg
            assert (alpha > 0.8 * 255).any()  # the real one would take min() of an empty array
        self.calls.append({"call": call, "count": len(images), "seed": seed, "mode": mode, **structure, "latent": latent})
        if mode == "stochastic":
            assert structure["steps"] >= len(images)  # each step uses one image
        return {name: [name] for name in formats}


def to_glb(
    app_rep, mesh, simplify=0.95, fill_holes=True, fill_holes_max_size=0.04, texture_size=1024, debug=False, verbose=True
):
    assert (app_rep, mesh) == ("gaussian", "mesh")  # baking needs the gaussians
    return textured_box()


@pytest.fixture
def package(monkeypatch):
    pipelines, utils, post = (types.ModuleType(f"trellis.{n}") for n in ("pipelines", "utils", "utils.postprocessing_utils"))
    pipelines.TrellisImageTo3DPipeline = FakePipeline
    post.to_glb = to_glb
    utils.postprocessing_utils = post
    for name, module in {
        "trellis": types.ModuleType("trellis"),
        "trellis.pipelines": pipelines,
        "trellis.utils": utils,
    }.items():
        monkeypatch.setitem(sys.modules, name, module)
    trellis._pipeline.cache_clear()
    yield post
    trellis._pipeline.cache_clear()


@pytest.fixture(scope="module")
def evidence(bottle_scene):
    return gather_evidence(*bottle_scene, 8)


def test_samples_vary_in_images_and_settings_and_are_watertight(package, evidence):
    backend = trellis.Trellis(weights=WEIGHTS)
    assets = [backend.make(evidence, f"c{k}", 0) for k in range(10)]
    calls = backend._pipeline.calls
    assert {call["mode"] for call in calls} == {"stochastic", "multidiffusion"}
    assert len({call["seed"] for call in calls}) == 10
    assert len({asset.frames for asset in assets}) > 3
    assert all(4 <= call["count"] <= 8 for call in calls)
    assert all(5 <= call["cfg_strength"] <= 9 for call in calls)
    for asset in assets:
        assert asset.watertight
        assert is_watertight(asset.mesh.vertices, asset.mesh.faces)
        assert asset.generator == "trellis"
        assert asset.parameters["structure_steps"] == 12
    again = backend.make(evidence, "c4", 0)
    assert calls[-1] == calls[4]
    assert np.array_equal(again.mesh.vertices, assets[4].mesh.vertices)


def test_a_single_view_uses_the_single_image_pipeline(package, evidence):
    backend = trellis.Trellis(weights=WEIGHTS)
    backend.make(replace(evidence, pool=evidence.pool[:1]), "c0", 0)
    assert backend._pipeline.calls[-1]["call"] == "run"


def test_the_model_is_loaded_once_for_all_objects(package):
    assert trellis.Trellis(weights=WEIGHTS)._pipeline is trellis.Trellis(weights=WEIGHTS)._pipeline


def test_too_small_masks_raise_before_the_model_is_called(package, evidence):
    backend = trellis.Trellis(weights=WEIGHTS)
    empty = tuple(replace(view, mask=np.zeros_like(view.mask)) for view in evidence.pool)
    with pytest.raises(GenerationFailed, match="bottle_1: its masks are too small"):
        backend.make(replace(evidence, pool=empty), "c0", 0)
    assert not backend._pipeline.calls


def test_a_mask_that_fills_the_image_gives_a_watertight_mesh(package, evidence):
    backend = trellis.Trellis(weights=WEIGHTS)
    full = replace(evidence.pool[0], mask=np.ones_like(evidence.pool[0].mask))
    assert backend.make(replace(evidence, pool=(full,)), "c0", 0).watertight


def test_a_model_error_fails_only_one_candidate(package, evidence, monkeypatch):
    def out_of_memory(*args, **kwargs):
        raise MemoryError("CUDA out of memory.\nTried to allocate 2 GiB")

    monkeypatch.setattr(package, "to_glb", out_of_memory)
    with pytest.raises(GenerationFailed, match=r"bottle_1: TRELLIS failed on c0: CUDA out of memory\.$") as refusal:
        trellis.Trellis(weights=WEIGHTS).make(evidence, "c0", 0)
    assert "\n" not in str(refusal.value)


def test_a_missing_package_and_missing_weights_raise_one_line_errors(package, monkeypatch):
    with pytest.raises(BackendUnavailable, match="absent-folder cannot be loaded") as refusal:
        trellis.Trellis(weights=Path("absent-folder"))
    assert "\n" not in str(refusal.value)
    monkeypatch.setitem(sys.modules, "trellis.pipelines", None)
    with pytest.raises(BackendUnavailable, match="TRELLIS package cannot be imported"):
        trellis.Trellis(weights=Path("other"))


def test_a_trellis_weights_folder_is_recognised_by_its_files(tmp_path):
    wanted = GENERATORS.get("trellis").weights
    assert find_weights(str(tmp_path), wanted.holds) is None
    (tmp_path / "pipeline.json").write_text("{}")
    (tmp_path / "ckpts").mkdir()
    (tmp_path / "ckpts" / "slat.safetensors").write_bytes(b"")
    assert find_weights(str(tmp_path), wanted.holds) == tmp_path
