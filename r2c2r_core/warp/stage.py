"""Warping: fitted meshes as visuals of the primitives (paper sections 4.6-4.9)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.errors import StageError
from r2c2r_core.failing import apart
from r2c2r_core.geometry.raster import sample_texture
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.scene import ArticulatedScene, Link, SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.tuning import Changes
from r2c2r_core.warp.affine import AxisMap, fit_map, fit_ranges, warp_vertices
from r2c2r_core.warp.axes import face_outwards
from r2c2r_core.warp.corners import FrontFace, find_front
from r2c2r_core.warp.paper import PaperMap, fit_paper_map, paper_corners
from r2c2r_core.warp.parts import cut_apart, front_range, outline
from r2c2r_core.warp.solids import with_plain_colours

_INSIDE_RGB = (226, 222, 214)  # white melamine in the shade


@dataclass(frozen=True, slots=True, kw_only=True)
class WarpConfig:
    """Settings of this stage."""

    front_scale: tuple[float, float] = setting(
        (0.7, 1.4), "[least, most] stretch of a front in its plane: beyond, its mesh is not used"
    )
    depth_scale: tuple[float, float] = setting((0.2, 5.0), "[least, most] stretch in depth, which is mostly unobserved")
    method: Literal["axes", "paper"] = setting("axes", "axes, or paper: by the paper's corners and affine map (eq. 15-16)")
    seed: int = setting(0, "random seed", ge=0, lt=2**31)
    params: Changes = tuned_numbers("warp")


def fit_meshes(
    scene: ArticulatedScene,
    tracks: Sequence[MaskTrack],
    placements: Sequence[Placement],
    assets: Sequence[MeshAsset],
    config: WarpConfig,
    *,
    progress: Progress = SILENT,
) -> ArticulatedScene:
    """The scene with the visual of each object's mesh; where a mesh is unusable the primitive remains, with a warning."""
    placed = {p.object_name: (p, a) for p, a in zip(placements, assets, strict=True)}
    objects = []
    failures: dict[str, str] = {}
    for item in progress.each(list(scene.objects), "fitting"):
        dressed = item
        if item.name in placed:
            with apart("warp", item.name, failures):
                dressed = fit_mesh(item, *placed[item.name], config)
        if item.name in failures:
            reason = failures[item.name].removeprefix("warp: ")
            dressed = replace(item, warnings=(*item.warnings, f"the primitive is shown instead of the mesh: {reason}"))
        objects.append(dressed)
    return replace(scene, objects=tuple(objects))


def fit_mesh(item: SceneObject, placement: Placement, asset: MeshAsset, config: WarpConfig) -> SceneObject:
    """One object with the visual of its mesh."""
    vertices_world = item.final_from_placed.apply(placement.world_from_mesh.apply(asset.mesh.vertices))
    if item.movable or not item.joints:
        return _whole(item, vertices_world, asset.mesh, config)
    has_handle = any(link.of_role("handle") for link in item.links[1:])
    canonical = face_outwards(vertices_world, asset.mesh.faces, item.world_from_object, has_handle=has_handle, seed=config.seed)
    target = front_corners(item)
    paper = _paper_map(canonical.vertices, target)
    if config.method == "axes":
        warped = _warped(item, canonical.vertices, asset.mesh.faces, target, config)
    elif paper is not None:
        warped = paper.apply(canonical.vertices)
    else:
        raise StageError("the paper's corners were not found on it")
    colour = _front_colour(asset.mesh, warped, item)
    painted, paint = with_plain_colours(
        TexturedMesh(vertices=warped, faces=asset.mesh.faces, uv=asset.mesh.uv, texture=asset.mesh.texture),
        _INSIDE_RGB,
        _as_bytes(colour),
    )
    visuals = cut_apart(item, painted, paint)
    links = tuple(_dressed(link, visuals.get(link.name), colour) for link in item.links)
    return replace(
        item,
        links=links,
        warp_residual_m=_corner_residual(item, visuals, config.seed),
        warp_residual_paper_m=paper.residual_m if paper is not None else None,
        warnings=(*item.warnings, *canonical.warnings),
    )


def _warped(item: SceneObject, canonical: Points, faces: Faces, target: Points, config: WarpConfig) -> Points:
    """Vertices in the object frame: the mesh's front upright on the primitive's, its handle rigid, its depth fitted."""
    tilted = find_front(canonical, faces, seed=config.seed)
    upright = canonical if tilted is None else canonical @ tilted.upright_from_mesh.T
    front = find_front(upright, faces, seed=config.seed)
    if front is None:
        raise StageError("no flat front was found on it")
    axis_map = _believable(_map_to(front, upright, target, float(item.dimensions_m[1])), config)
    return warp_vertices(upright, faces, axis_map, float(front.centre[1]))


def _paper_map(canonical: Points, target: Points) -> PaperMap | None:
    corners = paper_corners(canonical)
    return None if corners is None else fit_paper_map(corners, target)


def front_corners(item: SceneObject) -> Points:
    """Corners (4, 3) of the primitive's front face, in the order of the mesh's."""
    x, y, z = item.dimensions_m / 2
    return np.array([[x, -y, z], [-x, -y, z], [-x, -y, -z], [x, -y, -z]])


def _whole(item: SceneObject, vertices_world: Points, mesh: TexturedMesh, config: WarpConfig) -> SceneObject:
    """A movable object or a fixed box: one visual, its range mapped onto the box."""
    if item.movable:
        vertices = item.world_from_object.inverse.apply(vertices_world)
    else:
        vertices = face_outwards(
            vertices_world, mesh.faces, item.world_from_object, has_handle=False, seed=config.seed
        ).vertices
    axis_map = fit_ranges(vertices.min(axis=0), vertices.max(axis=0), item.dimensions_m)
    visual = TexturedMesh(vertices=axis_map.apply(vertices), faces=mesh.faces, uv=mesh.uv, texture=mesh.texture)
    base, *rest = item.links
    colour = _as_unit(np.median(mesh.texture.reshape(-1, 3), axis=0))
    return replace(item, links=(_dressed(base, visual, colour), *rest))


def _map_to(front: FrontFace, vertices: Points, target: Points, depth_m: float) -> AxisMap:
    back = float(np.quantile(vertices[:, 1], 0.999))
    return fit_map(front.corners, target, max(back - float(front.centre[1]), 1e-3), depth_m)


def _believable(axis_map: AxisMap, config: WarpConfig) -> AxisMap:
    """The map, if its stretch is within the error of a placement; raises StageError otherwise."""
    across, (least, most) = axis_map.scale[[0, 2]], config.front_scale
    if (across < least).any() or (across > most).any():
        raise StageError(f"its front would have to be stretched by {across[0]:.2f} x {across[1]:.2f}")
    if not config.depth_scale[0] <= axis_map.scale[1] <= config.depth_scale[1]:
        raise StageError(f"its depth would have to be stretched by {axis_map.scale[1]:.2f}")
    return axis_map


def _corner_residual(item: SceneObject, visuals: dict[str, TexturedMesh], seed: int) -> float | None:
    """Largest distance between the corners of the front boards and those detected on the finished fronts."""
    whole = outline([visuals[link.name] for link in item.links[1:]])
    found = find_front(whole.vertices, whole.faces, seed=seed)
    if found is None:
        return None
    ranges = [front_range(link) for link in item.links[1:]]
    low, high = np.min([start for start, _ in ranges], axis=0), np.max([end for _, end in ranges], axis=0)
    corners = np.array(
        [[x, low[1], z] for x, z in ((high[0], high[2]), (low[0], high[2]), (low[0], low[2]), (high[0], low[2]))]
    )
    return float(np.linalg.norm(found.corners - corners, axis=1).max())


def _dressed(link: Link, visual_object: TexturedMesh | None, colour: tuple[float, float, float]) -> Link:
    if visual_object is None or len(visual_object.faces) == 0:
        return replace(link, colour=colour)
    vertices = link.object_from_link.inverse.apply(visual_object.vertices)
    return replace(link, visual=replace(visual_object, vertices=vertices), colour=colour)


def _front_colour(mesh: TexturedMesh, warped: Points, item: SceneObject) -> tuple[float, float, float]:
    """Median texture colour of the front face."""
    near = np.abs(warped[:, 1] + item.dimensions_m[1] / 2) < 0.004
    uv = mesh.uv[near] if near.sum() > 3 else mesh.uv
    # vertices lie on a chart's border: sample triangle centres instead
    faces = mesh.faces[near[mesh.faces].all(axis=1)] if near.sum() > 3 else mesh.faces
    centres = mesh.uv[faces].mean(axis=1) if len(faces) else uv
    return _as_unit(np.median(sample_texture(mesh.texture, centres[None].astype(np.float32))[0], axis=0))


def _as_unit(rgb: np.ndarray) -> tuple[float, float, float]:
    return float(rgb[0]) / 255, float(rgb[1]) / 255, float(rgb[2]) / 255


def _as_bytes(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    return round(colour[0] * 255), round(colour[1] * 255), round(colour[2] * 255)
