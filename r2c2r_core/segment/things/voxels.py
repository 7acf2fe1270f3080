"""Regular voxel grid around a small object: connected parts, refinement, and its surface by marching cubes."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.segment.things.thing import Thing
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the voxel grid."""

    headroom_m: float = param(0.025, "m", "Extra height above the observed solid")


@dataclass(frozen=True, slots=True, eq=False)
class Voxels:
    """Regular grid around the clicks, in the world."""

    origin: Vector3
    size_m: float
    shape: tuple[int, int, int]

    @property
    def centres(self) -> Points:
        """All voxel centres, (n, 3), z fastest."""
        axes = [self.origin[k] + (np.arange(self.shape[k]) + 0.5) * self.size_m for k in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def with_headroom(solid: np.ndarray, voxels: Voxels) -> np.ndarray:
    """The solid with the space just above its parts: depth loses thin tops such as caps."""
    from scipy import ndimage

    tall = round(tuned(Params).headroom_m / voxels.size_m)
    up = np.zeros((3, 3, 2 * tall + 1), bool)
    up[1, 1, :] = True
    up[:, :, tall] = True
    up[:, :, tall + 1 :] = False
    up[1, 1, : tall + 1] = True
    return np.asarray(ndimage.binary_dilation(solid, structure=up[:, :, ::-1]))


def cropped(voxels: Voxels, solid: np.ndarray) -> tuple[Voxels, np.ndarray]:
    """Finer voxels around the solid part alone, and the solid resampled on them."""
    filled = np.argwhere(solid)
    low, high = np.maximum(filled.min(axis=0) - 2, 0), np.minimum(filled.max(axis=0) + 3, solid.shape)
    high[2] = min(high[2] + round(tuned(Params).headroom_m / voxels.size_m), solid.shape[2])
    origin, extent = voxels.origin + low * voxels.size_m, (high - low) * voxels.size_m
    size = max(0.0025, float(np.prod(extent) / 80_000) ** (1 / 3))
    fine = Voxels(origin, size, tuple(np.ceil(extent / size).astype(int).tolist()))
    at = np.floor((fine.centres - voxels.origin) / voxels.size_m).astype(int)
    at = np.minimum(at, np.array(solid.shape) - 1)
    return fine, solid[at[:, 0], at[:, 1], at[:, 2]].reshape(fine.shape)


def part_at(solid: np.ndarray, voxels: Voxels, positives: Points, negatives: Points, reach_m: float) -> np.ndarray | None:
    """Connected part nearest to the positive clicks, without parts joined to it only by a neck one voxel wide."""
    from scipy import ndimage

    opened = ndimage.binary_opening(solid, iterations=1)
    labels, count = ndimage.label(opened)
    if count == 0:
        return None
    chosen: set[int] = set()
    for point in positives:
        label = label_near(labels, voxels, point, reach_m)
        if label:
            chosen.add(label)
    refused = {label_near(labels, voxels, point, reach_m / 2) for point in negatives}
    chosen = chosen - refused or chosen  # a negative click beside its border rejects no part that a positive click chose
    if not chosen:
        return None
    part = np.isin(labels, sorted(chosen))
    return np.asarray(ndimage.binary_dilation(part, iterations=1) & solid)


def label_near(labels: np.ndarray, voxels: Voxels, point: Vector3, reach_m: float) -> int:
    """Label of the filled voxel nearest to a point, 0 when there is none within reach."""
    at = (point - voxels.origin) / voxels.size_m - 0.5
    reach = int(np.ceil(reach_m / voxels.size_m))
    low = np.clip(np.floor(at).astype(int) - reach, 0, labels.shape)
    high = np.clip(np.floor(at).astype(int) + reach + 2, 0, labels.shape)
    block = labels[low[0] : high[0], low[1] : high[1], low[2] : high[2]]
    filled = np.argwhere(block > 0)
    if len(filled) == 0:
        return 0
    nearest = filled[np.argmin(((filled + low - at) ** 2).sum(axis=1))]
    return int(block[tuple(nearest)])


def grown(inside: np.ndarray) -> np.ndarray:
    """The part dilated by two voxels."""
    from scipy import ndimage

    return np.asarray(ndimage.binary_dilation(inside, iterations=2))


def mesh_of(field: np.ndarray, level: float, voxels: Voxels, support: float | None) -> Thing | None:
    """Level surface of a field over the voxels, by marching cubes; None where the field stays below."""
    from skimage.measure import marching_cubes

    padded = np.pad(field, 1)
    if padded.max() <= level:
        return None
    vertices, faces, _, _ = marching_cubes(padded, level)
    world = voxels.origin + (vertices - 1 + 0.5) * voxels.size_m
    return Thing(world.astype(np.float64), faces.astype(np.int64), support, voxels.size_m)
