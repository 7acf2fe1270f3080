"""Min-cut over surface voxels: the part of a surface that the clicks select, cut along creases and colour edges."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Colours, Faces, Points, Vector3
from r2c2r_core.geometry.graphs import components, source_side
from r2c2r_core.tuning import param, tuned

_CAPACITY_SCALE = 1000.0
_LARGE = 1e5

Solid = Callable[[Points], np.ndarray]
"""Mask of the places (n, 3) that may be solid: no frame sees through them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the surface cut."""

    convex_cost: float = param(
        2.0,
        "score",
        "Decay rate of link capacity with bend and colour difference across a convex crease, where objects seldom separate",
    )
    concave_cost: float = param(
        9.0, "score", "Decay rate of link capacity with bend and colour difference across a concave crease, where objects meet"
    )
    colour_cost: float = param(
        0.6, "score", "Weight of the colour difference between neighbours relative to the angle between their normals"
    )
    asked: int = param(100, "count", "Maximum number of places between two parts that must be solid", ge=1)
    solid_share: float = param(
        0.25, "share", "Minimum solid fraction of these places", source="0.4 to 1 within hoods, 0 between a hood and a cabinet"
    )


@dataclass(frozen=True, slots=True, eq=False)
class VoxelGraph:
    """Voxels containing surface, with mean position, normal, colour and area, and the pairs that touch (26 neighbours)."""

    positions: Points
    normals: Points
    lab: np.ndarray  # (n, 3) float
    area_m2: np.ndarray
    edges: np.ndarray  # (m, 2)
    voxel_of_face: np.ndarray
    size_m: float

    def nearest(self, point_world: Vector3) -> int:
        """Index of the voxel whose surface is closest to a point."""
        return int(np.argmin(((self.positions - point_world) ** 2).sum(axis=1)))


def build_graph(vertices: Points, faces: Faces, colours: Colours, size_m: float) -> VoxelGraph:
    """Voxel graph of a triangle surface."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))  # sums over axes of length three are many times slower
    cross = np.cross(b - a, c - a)
    area = 0.5 * np.sqrt(cross[:, 0] ** 2 + cross[:, 1] ** 2 + cross[:, 2] ** 2)
    centres = (a + b + c) / 3
    keys = np.floor((centres - centres.min(axis=0)) / size_m).astype(np.int64) + 1
    span = keys.max(axis=0) + 2
    flat = (keys[:, 0] * span[1] + keys[:, 1]) * span[2] + keys[:, 2]
    unique, member = np.unique(flat, return_inverse=True)
    count = len(unique)
    weight = np.bincount(member, area, count)
    safe = np.maximum(weight, 1e-12)
    positions = np.stack([np.bincount(member, area * centres[:, k], count) / safe for k in range(3)], axis=1)
    normals = np.stack([np.bincount(member, cross[:, k], count) for k in range(3)], axis=1)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rgb = sum(colours[faces[:, k]].astype(np.uint16) for k in range(3)) // 3
    face_lab = cv2.cvtColor(np.asarray(rgb, np.uint8)[None], cv2.COLOR_RGB2LAB)[0].astype(np.float32)
    lab = np.stack([np.bincount(member, area * face_lab[:, k], count) / safe for k in range(3)], axis=1)
    return VoxelGraph(positions, normals, lab, weight, touching(unique, span), member, size_m)


def cut(
    graph: VoxelGraph,
    positive: list[int],
    negative: list[int],
    radius_m: float,
    background: np.ndarray,
    *,
    gap_m: float = 0.0,
    solid: Solid | None = None,
    upright: bool = False,
) -> tuple[np.ndarray, float]:
    """Min-cut of the voxels joined to the positive ones, and its cost per square root of area (lower is a cleaner cut).

    `background` marks voxels of structure (floor, worktop, walls). The prior of a voxel falls with distance, on the scale of
    `radius_m`; for `upright` objects (chairs), which extend down to the floor, only plan distance counts. Parts up to `gap_m`
    from each other count as joined: scans lose dark and thin pieces; with `solid`, those with solid between them.
    """
    a, b = graph.edges.T
    capacity = _capacities(graph)
    positions = graph.positions[:, :2] if upright else graph.positions
    seeds = [*positions[positive], positions[positive].mean(axis=0)]
    distance = np.min([np.linalg.norm(positions - seed, axis=1) for seed in seeds], axis=0)
    prior = np.exp(-((distance / radius_m) ** 2))
    weight = graph.area_m2 * 1e4 * 0.25
    source, sink = weight * prior * 0.35, weight * (1 - prior) * 0.5
    sink[background] += weight[background] * 3 + 20
    source[positive], sink[positive] = _LARGE, 0
    sink[negative], source[negative] = _LARGE, 0
    inside = source_side(a, b, *(value * _CAPACITY_SCALE for value in (capacity, source, sink)))
    chosen = connected_to(graph, inside, positive, gap_m, solid)
    crossing = capacity[chosen[a] != chosen[b]].sum()
    return chosen, float(crossing / np.sqrt(max(graph.area_m2[chosen].sum() * 1e4, 1e-6)))


def connected_to(
    graph: VoxelGraph, inside: np.ndarray, seeds: list[int], gap_m: float = 0.0, solid: Solid | None = None
) -> np.ndarray:
    """Mask of the voxels of `inside` that are connected to a seed within it, across gaps of up to `gap_m` (if solid)."""
    from scipy.spatial import cKDTree

    links = graph.edges[inside[graph.edges].all(axis=1)]
    if gap_m > 0:
        members = np.flatnonzero(inside)
        near = members[cKDTree(graph.positions[members]).query_pairs(gap_m, output_type="ndarray")]
        if solid is not None:
            near = _across_solid(graph.positions, near, components(len(inside), links), solid)
        links = np.concatenate([links, near])
    labels = components(len(inside), links)
    return np.asarray(inside & np.isin(labels, labels[seeds]))


def _across_solid(positions: Points, pairs: np.ndarray, part: np.ndarray, solid: Solid) -> np.ndarray:
    """Pairs of voxels of different parts between which enough places are solid."""
    ends = np.sort(part[pairs], axis=1)
    pairs, ends = pairs[ends[:, 0] != ends[:, 1]], ends[ends[:, 0] != ends[:, 1]]
    if not len(pairs):
        return pairs
    params = tuned(Params)
    _, gap, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(gap.ravel(), kind="stable")
    gap = gap.ravel()[order]
    rank = np.arange(len(gap)) - (np.cumsum(count) - count)[gap]
    some = rank % -(-count // params.asked)[gap] == 0
    pairs, gap = pairs[order][some], gap[some]
    filled = np.bincount(gap, solid(positions[pairs].mean(axis=1))) / np.bincount(gap)
    return np.asarray(pairs[filled[gap] > params.solid_share])


def _capacities(graph: VoxelGraph) -> np.ndarray:
    params = tuned(Params)
    a, b = graph.edges.T
    towards = graph.positions[b] - graph.positions[a]
    length = np.linalg.norm(towards, axis=1)
    cosine = np.clip(_dot(graph.normals[a], graph.normals[b]), -1, 1)
    bend = _dot(graph.normals[b] - graph.normals[a], towards) / np.maximum(length, 1e-9)
    colour = _dot(graph.lab[a] - graph.lab[b], graph.lab[a] - graph.lab[b]) / 40**2
    weight = np.arccos(cosine) + params.colour_cost * colour
    cost = np.where(bend > 0.02, params.convex_cost, params.concave_cost)
    share = np.minimum(graph.area_m2[a], graph.area_m2[b]) / graph.size_m**2  # slivers are weak links
    return np.asarray(graph.size_m * 100 * (np.exp(-cost * weight) + 0.02) * np.clip(share, 0.05, 1.0) / 2)


def _dot(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("nk,nk->n", first, second))


def touching(unique: np.ndarray, span: np.ndarray) -> np.ndarray:
    """Pairs of touching cells (26 neighbours), given by sorted flat indices in a grid of shape `span`."""
    offsets = [(dx * span[1] + dy) * span[2] + dz for dx in (-1, 0, 1) for dy in (-1, 0, 1) for dz in (-1, 0, 1)]
    pairs = []
    for offset in sorted(int(o) for o in offsets if o > 0):
        target = np.searchsorted(unique, unique + offset)
        found = (target < len(unique)) & (unique[np.minimum(target, len(unique) - 1)] == unique + offset)
        pairs.append(np.stack([np.flatnonzero(found), target[found]], axis=1))
    return np.concatenate(pairs) if pairs else np.zeros((0, 2), np.int64)
