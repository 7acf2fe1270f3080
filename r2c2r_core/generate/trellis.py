"""TRELLIS in this process: several masked photos to a textured mesh (paper §4.2; Xiang et al. 2025).

Needs the repository's own environment (github.com/microsoft/TRELLIS; Linux, an NVIDIA GPU with 16 GB) and its weights in a
folder. TRELLIS also loads DINOv2 through torch.hub: run it once with a network, or fill torch.hub's cache.
"""

from functools import cache
from pathlib import Path
from typing import Any

from r2c2r_core.errors import BackendUnavailable, GenerationFailed
from r2c2r_core.generate.cutout import rgba_cutout
from r2c2r_core.generate.delivered import delivered_asset, first_line
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.meshfile import parts_of
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.sampling import Sampling, draw_sampling
from r2c2r_core.model.mesh import MeshAsset

_SIMPLIFY = 0.95  # share of the faces that to_glb removes (its own default; the authors of the paper: 0.85)
_TEXTURE_PX = 1024


class Trellis(MeshGenerator):
    """Generator that runs TrellisImageTo3DPipeline."""

    def __init__(self, *, weights: Path) -> None:
        self._pipeline = _pipeline(weights)

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One sample from a random subset of the good frames; raises GenerationFailed when the model gives no usable mesh."""
        sampling = draw_sampling(evidence, candidate_id, seed)
        name = evidence.track.name
        try:
            mesh = _textured(_sample(self._pipeline, sampling))
        except Exception as error:  # any error of CUDA, spconv or the mesh extraction fails this sample only
            raise GenerationFailed(f"{name}: TRELLIS failed on {candidate_id}: {first_line(error)}") from error
        return delivered_asset(
            parts_of([mesh]),
            object_name=name,
            candidate_id=candidate_id,
            generator="trellis",
            seed=seed,
            frames=sampling.frames,
            parameters=sampling.parameters,
        )


@cache
def _pipeline(weights: Path) -> Any:
    """The pipeline, loaded once per process: loading takes most of a minute and 16 GB of GPU memory."""
    try:
        from trellis.pipelines import TrellisImageTo3DPipeline
    except ImportError as error:
        raise BackendUnavailable(
            f"generator 'trellis': the TRELLIS package cannot be imported ({error})",
            hint="install github.com/microsoft/TRELLIS, or use the 'remote' generator",
        ) from error
    try:
        pipeline = TrellisImageTo3DPipeline.from_pretrained(str(weights))
        pipeline.cuda()
    except Exception as error:  # hub, file and CUDA errors of every kind: each means that it cannot be used here
        raise BackendUnavailable(
            f"generator 'trellis': {weights} cannot be loaded ({first_line(error)})",
            hint="check the folder, that DINOv2 is in torch.hub's cache, and that the GPU has 16 GB",
        ) from error
    return pipeline


def _sample(pipeline: Any, sampling: Sampling) -> dict[str, Any]:
    from PIL import Image

    pictures = [Image.fromarray(rgba_cutout(view)) for view in sampling.views]
    settings: dict[str, Any] = {
        "num_samples": 1,
        "seed": sampling.seed,
        "sparse_structure_sampler_params": {
            "steps": sampling.structure_steps,
            "cfg_strength": sampling.structure_guidance,
        },
        "slat_sampler_params": {"steps": sampling.latent_steps, "cfg_strength": sampling.latent_guidance},
        "formats": ["mesh", "gaussian"],
        "preprocess_image": True,
    }
    if len(pictures) == 1:
        return dict(pipeline.run(pictures[0], **settings))
    return dict(pipeline.run_multi_image(pictures, mode=sampling.mode, **settings))


def _textured(outputs: dict[str, Any]) -> Any:
    """The mesh after to_glb: hidden faces culled, small holes filled, simplified, its texture baked, +Y up."""
    from trellis.utils import postprocessing_utils

    return postprocessing_utils.to_glb(
        outputs["gaussian"][0], outputs["mesh"][0], simplify=_SIMPLIFY, texture_size=_TEXTURE_PX, verbose=False
    )
