"""SAM 3D Objects in this process: one masked photo and its measured points to a textured mesh.

Of current models this one uses what a LiDAR scan provides and the others ignore: a metric point for every pixel. It needs the
environment of github.com/facebookresearch/sam-3d-objects (start with LIDRA_SKIP_INIT=true; a GPU with 32 GB) and the folder
with its pipeline.yaml.

Frames, from its code and threads 57, 78 and 100: the point map is in PyTorch3D's camera axes (x left, y up, z forward, that is
diag(-1, -1, 1) of ours), NaN where unmeasured; the mesh is +Y up, its pose maps the +Z-up mesh as rows, p_camera = scale *
p_mesh @ R(quat_wxyz) + translation. The pose only serves to score the candidate in all its frames; the next stage places it.
"""

import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Points
from r2c2r_core.errors import BackendUnavailable, GenerationFailed
from r2c2r_core.generate.consistency import self_consistency, sensor_depth
from r2c2r_core.generate.cutout import bounded, usable_views
from r2c2r_core.generate.delivered import delivered_asset, first_line
from r2c2r_core.generate.evidence import Evidence, View
from r2c2r_core.generate.meshfile import parts_of
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.tuning import param, tuned

_P3D_FROM_CAMERA = np.diag([-1.0, -1.0, 1.0])
_Z_UP_FROM_Y_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
_OWN_CODE = ("sam3d_objects", "torch", "torchvision", "moge")  # packages that its pipeline.yaml may instantiate


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters for accepting the model's own poses."""

    judges: int = param(8, "count", "Number of views on which a candidate is judged, as for the weight-free ones", ge=1)
    least_iou: float = param(0.3, "score", "Minimum mask IoU for the model's pose to be used")


class Sam3dObjects(MeshGenerator):
    """Generator that runs InferencePipelinePointMap."""

    def __init__(self, *, weights: Path) -> None:
        self._pipeline = _pipeline(weights)

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One sample from one of the better frames; raises GenerationFailed when the model gives no usable mesh."""
        name = evidence.track.name
        views = usable_views(evidence.pool)
        if not views:
            raise GenerationFailed(f"{name}: its masks are too small for a picture", hint="add a click on a nearer frame")
        rng = np.random.default_rng([seed, zlib.crc32(name.encode()), zlib.crc32(candidate_id.encode())])
        view = bounded(views[int(rng.integers(max(len(views) // 2, 1)))])
        model_seed = int(rng.integers(2**31 - 1))
        try:
            mesh, posed = _sample(self._pipeline, view, model_seed)
        except Exception as error:  # any error of CUDA, spconv or the mesh extraction fails this sample only
            raise GenerationFailed(f"{name}: SAM 3D failed on {candidate_id}: {first_line(error)}") from error
        return delivered_asset(
            parts_of([mesh]),
            object_name=name,
            candidate_id=candidate_id,
            generator="sam3d",
            seed=seed,
            frames=(view.frame_index,),
            parameters={"model_seed": float(model_seed)},
            metrics=_judged(posed, np.asarray(mesh.faces, dtype=np.int64), evidence),
        )


@cache
def _pipeline(weights: Path) -> Any:
    """The pipeline, loaded once per process."""
    try:
        import sam3d_objects  # noqa: F401  # registers the classes that the file names
        from hydra.utils import instantiate
        from omegaconf import OmegaConf
    except ImportError as error:
        raise BackendUnavailable(
            f"generator 'sam3d': its package cannot be imported ({error})",
            hint="install github.com/facebookresearch/sam-3d-objects, or use the 'remote' generator",
        ) from error
    path = min(weights.glob("**/pipeline.yaml"), key=lambda p: len(p.parts))
    try:
        config = OmegaConf.load(path)
        _check_targets(OmegaConf.to_container(config, resolve=False), path)
        config.rendering_engine = "pytorch3d"  # nvdiffrast has a non-commercial licence
        config.compile_model = False
        config.workspace_dir = str(path.parent)
        return instantiate(config)
    except BackendUnavailable:
        raise
    except Exception as error:  # file, CUDA and configuration errors of every kind: each means that it cannot be used here
        raise BackendUnavailable(
            f"generator 'sam3d': {path} cannot be loaded ({first_line(error)})", hint="check the folder and the GPU's memory"
        ) from error


def _check_targets(node: Any, path: Path) -> None:
    """Refuse a file that would instantiate anything but its own models: hydra calls whatever `_target_` names."""
    if isinstance(node, dict):
        target = str(node.get("_target_", _OWN_CODE[0]))
        if target.split(".")[0] not in _OWN_CODE:
            raise BackendUnavailable(f"{path}: it would run '{target}'", hint="download the weights again from their source")
        for child in node.values():
            _check_targets(child, path)
    elif isinstance(node, list):
        for child in node:
            _check_targets(child, path)


def _sample(pipeline: Any, view: View, seed: int) -> tuple[Any, Points]:
    """The mesh as the model returns it (+Y up), and its vertices in the world by the model's own pose."""
    import torch

    rgba, points = _centred(view)
    output = pipeline.run(
        rgba,
        None,
        seed,
        stage1_only=False,
        with_mesh_postprocess=False,
        with_texture_baking=False,
        with_layout_postprocess=False,
        use_vertex_color=True,
        pointmap=torch.from_numpy(points),
    )
    mesh = output["glb"]
    if mesh is None or not len(mesh.faces):
        raise ValueError("no mesh")
    quat_wxyz, translation, scale = (_numbers(output[name]) for name in ("rotation", "translation", "scale"))
    turn = Rotation.from_quat(quat_wxyz, scalar_first=True).as_matrix()
    upright = np.asarray(mesh.vertices, dtype=np.float64) @ _Z_UP_FROM_Y_UP.T
    camera = (scale * upright) @ turn + translation
    return mesh, view.world_from_camera.apply(camera @ _P3D_FROM_CAMERA)


def _centred(view: View) -> tuple[np.ndarray, np.ndarray]:
    """RGBA and point map (h, w, 3) float32, padded so that the principal point is at the centre, as the model assumes."""
    depth = sensor_depth(view, view.mask.shape)
    points = depth_points(depth, view.rgb_camera) @ _P3D_FROM_CAMERA
    points[depth <= 0] = np.nan
    rgba = np.dstack([view.rgb, view.mask.astype(np.uint8) * 255])
    camera = view.rgb_camera
    pads = (_either_side(camera.cy, camera.height), _either_side(camera.cx, camera.width))
    return (
        np.pad(rgba, (*pads, (0, 0))),
        np.pad(points.astype(np.float32), (*pads, (0, 0)), constant_values=np.nan),
    )


def _either_side(centre: float, size: int) -> tuple[int, int]:
    """Padding in pixels before and after that centres `centre` to within half a pixel."""
    return max(round(size - 2 * centre), 0), max(round(2 * centre - size), 0)


def _judged(posed: Points, faces: np.ndarray, evidence: Evidence) -> dict[str, float]:
    """Agreement with masks and depth at the model's own pose; empty when that pose is clearly wrong."""
    params = tuned(Params)
    measures = self_consistency(posed, faces, np.ones(len(faces), dtype=bool), evidence.pool[: params.judges])
    return measures if measures.get("mask_iou", 0.0) >= params.least_iou else {}


def _numbers(tensor: Any) -> np.ndarray:
    return np.asarray(tensor.detach().cpu().numpy(), dtype=np.float64).reshape(-1)
