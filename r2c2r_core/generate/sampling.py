"""Random sampling of TRELLIS inputs for one object (paper §4.2: "randomly varying the input images and parameters").

Ranges from backends.md §1b: 4-8 of the good frames, stochastic or multidiffusion conditioning, guidance of the structure 5-9
around the model's 7.5, 12 steps of each sampler, and the seed.
"""

import zlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.cutout import usable_views
from r2c2r_core.generate.evidence import Evidence, View
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned number of views per draw."""

    fewest: int = param(4, "count", "Minimum number of views of a draw", ge=1)
    most: int = param(8, "count", "Maximum number of views of a draw", ge=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sampling:
    """Inputs and parameters of one TRELLIS sample."""

    views: tuple[View, ...]
    mode: Literal["stochastic", "multidiffusion"]
    seed: int  # never 0, which the NIM interprets as "draw one"
    structure_steps: int
    structure_guidance: float
    latent_steps: int
    latent_guidance: float

    @property
    def parameters(self) -> dict[str, float]:
        """The draw as numbers, for the record."""
        return {
            "frames": float(len(self.views)),
            "model_seed": float(self.seed),
            "multidiffusion": float(self.mode == "multidiffusion"),
            "structure_steps": float(self.structure_steps),
            "structure_guidance": self.structure_guidance,
            "latent_steps": float(self.latent_steps),
            "latent_guidance": self.latent_guidance,
        }

    @property
    def frames(self) -> tuple[int, ...]:
        """Frame.index of the model's input images."""
        return tuple(sorted(view.frame_index for view in self.views))


def draw_sampling(evidence: Evidence, candidate_id: str, seed: int) -> Sampling:
    """One draw for a candidate, deterministic in object, candidate and seed. Raises GenerationFailed without images.

    `stochastic` conditions each step on one image in turn, so images beyond the number of steps would be ignored: there are
    always at least as many steps as images.
    """
    params = tuned(Params)
    name = evidence.track.name
    views = usable_views(evidence.pool)
    if not views:
        raise GenerationFailed(f"{name}: its masks are too small for a picture", hint="add a click on a nearer frame")
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), zlib.crc32(candidate_id.encode())])
    count = min(int(rng.integers(params.fewest, params.most + 1)), len(views))
    chosen = np.sort(rng.choice(len(views), count, replace=False))
    steps = max(12, count)
    return Sampling(
        views=tuple(views[i] for i in chosen),
        mode="multidiffusion" if rng.random() < 0.5 else "stochastic",
        seed=int(rng.integers(1, 2**31 - 1)),
        structure_steps=steps,
        structure_guidance=round(float(rng.uniform(5.0, 9.0)), 2),
        latent_steps=steps,
        latent_guidance=round(float(rng.uniform(2.0, 4.0)), 2),
    )
