"""The SAM 3D Objects adapter against a pipeline with the real one's signature (facebookresearch/sam-3d-objects 79671e9)."""

import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

torch = pytest.importorskip("torch", reason="no torch: pip install --group learned")

from r2c2r_core.errors import BackendUnavailable, GenerationFailed  # noqa: E402  # after the skip
from r2c2r_core.generate import repair, sam3d  # noqa: E402
from r2c2r_core.generate.evidence import gather_evidence  # noqa: E402
from r2c2r_core.geometry.meshes import box_mesh, is_watertight  # noqa: E402
from r2c2r_core.tuning import tuning  # noqa: E402

pytestmark = pytest.mark.slow  # torch is large: `make test` does not install it

LOW, HIGH = np.array([-0.23, 0.0, 0.9]), np.array([0.23, 0.34, 1.18])  # the scene's microwave, in world coordinates
SCALE, TURN, SHIFT = 0.6, Rotation.from_euler("xyz", [0.3, -0.8, 1.2]), np.array([0.1, -0.2, 1.3])


class FakePipeline:
    """Stand-in pipeline that returns the true microwave in the real model's frames, and checks the frames of its input."""

    def __init__(self):
        self.asked = []
        self.true_points_camera = None  # set by the test: the box's corners in our camera frame, by frame

    def run(
        self,
        image,
        mask=None,
        seed=None,
        stage1_only=False,
        with_mesh_postprocess=True,
        with_texture_baking=True,
        with_layout_postprocess=False,
        use_vertex_color=False,
        stage1_inference_steps=None,
        stage2_inference_steps=None,
        use_stage1_distillation=False,
        use_stage2_distillation=False,
        pointmap=None,
        decode_formats=None,
        estimate_plane=False,
        steps_prefix=None,
        guidance=None,
    ):
        assert image.dtype == np.uint8
        assert image.shape[2] == 4
        assert mask is None
        assert pointmap.shape == (*image.shape[:2], 3)
        points = pointmap.numpy()
        seen = np.isfinite(points[..., 2])
        assert (points[seen][:, 2] > 0).all()
        rows, columns = np.nonzero(seen)
        # x to the left, y up, principal point in the centre: a pixel right of the centre has negative x
        x = -points[seen][:, 0] / points[seen][:, 2]
        y = -points[seen][:, 1] / points[seen][:, 2]
        focal = np.polyfit(x, columns + 0.5 - image.shape[1] / 2, 1)
        assert focal[1] == pytest.approx(0, abs=1.0)
        assert np.polyfit(y, rows + 0.5 - image.shape[0] / 2, 1) == pytest.approx([focal[0], 0], rel=0.01, abs=1.0)
        self.asked.append({"seed": seed, "pixels": image.shape, "known": int(seen.sum())})
        vertices, faces = box_mesh(LOW, HIGH)
        p3d = self.camera_from_world.apply(vertices) * [-1, -1, 1]
        upright = (p3d - SHIFT) @ TURN.as_matrix().T / SCALE  # inverts: scale, then rows times the rotation, then shift
        glb = trimesh.Trimesh(upright @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).T, faces, process=False)  # +Y up
        glb.visual.vertex_colors = [80, 80, 90, 255]
        return {
            "glb": glb,
            "rotation": torch.tensor(TURN.as_quat(scalar_first=True))[None],
            "translation": torch.tensor(SHIFT)[None],
            "scale": torch.full((1, 3), SCALE),
        }


class Config(dict):
    """The used part of omegaconf's DictConfig."""

    def __setattr__(self, name, value):
        self[name] = value


@pytest.fixture
def package(monkeypatch, tmp_path):
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "checkpoints" / "pipeline.yaml").write_text("")
    pipeline = FakePipeline()
    targets = {"_target_": "sam3d_objects.pipeline.X", "depth_model": {"_target_": "moge.model"}}
    omegaconf, hydra, utils = types.ModuleType("omegaconf"), types.ModuleType("hydra"), types.ModuleType("hydra.utils")
    omegaconf.OmegaConf = types.SimpleNamespace(load=lambda path: Config(targets), to_container=lambda c, resolve: dict(c))
    utils.instantiate = lambda config: pipeline
    hydra.utils = utils
    modules = {"omegaconf": omegaconf, "hydra": hydra, "hydra.utils": utils, "sam3d_objects": types.ModuleType("sam3d_objects")}
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    sam3d._pipeline.cache_clear()
    with tuning({repair.Params: repair.Params(texture_px=256)}):  # 1024 px take over a second
        yield types.SimpleNamespace(pipeline=pipeline, targets=targets, weights=tmp_path)
    sam3d._pipeline.cache_clear()


@pytest.fixture(scope="module")
def evidence(appliance_scene):
    return gather_evidence(*appliance_scene, 8)


def made(package, evidence, candidate="c0"):
    """A candidate from a pool of one frame, so that the stand-in knows the camera's pose."""
    one = replace(evidence, pool=evidence.pool[:1])
    package.pipeline.camera_from_world = evidence.pool[0].world_from_camera.inverse
    return sam3d.Sam3dObjects(weights=package.weights).make(one, candidate, 0)


def test_point_maps_and_poses_use_the_coordinate_frames_of_the_model(package, evidence):
    """The fake gives the true mesh where the convention puts it; any slip in axes, order or scale shows in the masks."""
    asset = made(package, evidence)
    assert asset.metrics["mask_iou"] > 0.9
    assert asset.metrics["depth_residual_m"] < 0.02
    assert asset.watertight
    assert is_watertight(asset.mesh.vertices, asset.mesh.faces)
    assert asset.generator == "sam3d"
    assert asset.frames == (evidence.pool[0].frame_index,)
    assert package.pipeline.asked[0]["known"] > 1000
    assert tuple(np.median(asset.mesh.texture.reshape(-1, 3), axis=0)) == (80, 80, 90)


def test_a_pose_that_does_not_fit_its_photo_is_discarded(package, evidence, monkeypatch):
    monkeypatch.setattr(sam3d, "_Z_UP_FROM_Y_UP", np.diag([1.0, -1.0, -1.0]))
    asset = made(package, evidence)
    assert "mask_iou" not in asset.metrics
    assert asset.watertight


def test_samples_differ_in_seed_and_frame(package, evidence):
    package.pipeline.camera_from_world = evidence.pool[0].world_from_camera.inverse
    backend = sam3d.Sam3dObjects(weights=package.weights)
    assets = [backend.make(evidence, f"c{k}", 0) for k in range(3)]
    assert len({asked["seed"] for asked in package.pipeline.asked}) == 3
    assert len({asset.frames for asset in assets}) > 1


def test_a_model_error_fails_only_one_candidate(package, evidence, monkeypatch):
    def out_of_memory(*args, **kwargs):
        raise RuntimeError("CUDA out of memory.\nTried")

    monkeypatch.setattr(package.pipeline, "run", out_of_memory)
    with pytest.raises(GenerationFailed, match=r"microwave_1: SAM 3D failed on c0: CUDA out of memory\.$"):
        made(package, evidence)


def test_a_pipeline_file_with_foreign_targets_is_rejected(package):
    package.targets["depth_model"] = {"nested": [{"_target_": "os.system"}]}
    with pytest.raises(BackendUnavailable, match=r"pipeline\.yaml: it would run 'os\.system'"):
        sam3d.Sam3dObjects(weights=package.weights)


def test_a_missing_package_raises_a_one_line_error(package, monkeypatch):
    monkeypatch.setitem(sys.modules, "hydra.utils", None)
    with pytest.raises(BackendUnavailable, match="package cannot be imported") as refusal:
        sam3d.Sam3dObjects(weights=Path("other"))
    assert "\n" not in str(refusal.value)
