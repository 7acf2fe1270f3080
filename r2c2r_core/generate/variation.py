"""Random variation between the candidates of one object: a spread over the choices that remain uncertain."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.generate.evidence import Evidence, View


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variation:
    """One draw. Ranges from backends.md §2.6: 6-14 frames, percentile 0.2-2 %, voxel 4-6 mm, 1-3 votes, prior depth ±5 %."""

    views: tuple[View, ...]
    erosion_px: float  # erosion of the masks, in depth pixels
    bbox_percentile: float  # trimmed off each end of the observed points
    carve_votes: int  # frames that must see a voxel free
    voxel_m: float
    depth_scale: float  # factor on a depth that is assumed, not observed
    depth_draw: float  # offset of a poorly measured depth in standard deviations, -1.5..1.5

    @property
    def parameters(self) -> dict[str, float]:
        """The draw as numbers, for the record."""
        return {
            "frames": float(len(self.views)),
            "erosion_px": self.erosion_px,
            "bbox_percentile": self.bbox_percentile,
            "carve_votes": float(self.carve_votes),
            "voxel_m": self.voxel_m,
            "depth_scale": self.depth_scale,
            "depth_draw": self.depth_draw,
        }


def draw_variation(evidence: Evidence, rng: np.random.Generator) -> Variation:
    """A random subset of the pool and random parameters."""
    pool = evidence.pool
    most = min(14, len(pool))
    least = min(6, max(most - 1, 1))
    count = int(rng.integers(least, most + 1))
    chosen = np.sort(rng.choice(len(pool), count, replace=False))
    return Variation(
        views=tuple(pool[i] for i in chosen),
        erosion_px=float(rng.choice([0.7, 1.0, 1.5])),
        bbox_percentile=float(rng.choice([0.2, 0.5, 1.0, 2.0])),
        carve_votes=int(rng.integers(2, 4)),
        voxel_m=float(rng.uniform(0.004, 0.006)),
        depth_scale=float(rng.uniform(0.95, 1.05)),
        depth_draw=float(rng.uniform(-1.5, 1.5)),
    )


def whole_pool(evidence: Evidence) -> Variation:
    """The deterministic variation: every good frame and the middle of each range."""
    return Variation(
        views=evidence.pool,
        erosion_px=1.0,
        bbox_percentile=0.5,
        carve_votes=2,
        voxel_m=0.005,
        depth_scale=1.0,
        depth_draw=0.0,
    )
