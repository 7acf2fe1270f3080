"""The weight-free generator: what was seen, at LiDAR noise, completed by symmetry, to the wall or to the category's depth."""

import zlib

import numpy as np

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.asset import shape_metrics, unposed
from r2c2r_core.generate.bake import bake
from r2c2r_core.generate.boxed import appliance_shape, front_shape
from r2c2r_core.generate.charts import Atlas, planar_atlas, unwrapped_atlas
from r2c2r_core.generate.consistency import self_consistency
from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.things import thing_shape
from r2c2r_core.generate.variation import Variation, draw_variation
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, volume
from r2c2r_core.model.mesh import MeshAsset

_FRONT_PX = 768  # long side of a front's picture
_FINEST_TEXEL_M = 0.0012  # a phone at 1 m sees 1.3 mm per pixel
_THING_PX = 512
_JUDGES = 8  # views that judge every candidate of an object alike


class Completion:
    """Boxes for furniture, carved solids for things."""

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate from a random subset of the good frames and random parameters."""
        rng = _generator(evidence, candidate_id, seed)
        variation = draw_variation(evidence, rng)
        shape = _solid_shape(evidence, variation, candidate_id)
        atlas = _cut_open(shape)
        # a bare side may show in a few frames only, so furniture is pictured from the whole pool
        views = variation.views if shape.front_y_m is None else evidence.pool
        picture = bake(atlas, shape.vertices_world, shape.faces, shape.world_from_local, views, shape.front_y_m)
        return MeshAsset(
            object_name=evidence.track.name,
            candidate_id=candidate_id,
            mesh=unposed(shape.vertices_local, atlas.source, atlas.faces, atlas.uv, picture.texture, rng),
            generator="completion",
            seed=seed,
            watertight=True,
            frames=tuple(sorted(view.frame_index for view in variation.views)),
            metrics={**_metrics(shape, evidence), "seen_fraction": picture.seen_fraction},
            parameters={**variation.parameters, **shape.parameters},
            warnings=shape.warnings,
        )

    def measured(self, evidence: Evidence, candidate_id: str, seed: int) -> tuple[Shape, dict[str, float]]:
        """The same candidate where it stands, without a picture, and its measures."""
        variation = draw_variation(evidence, _generator(evidence, candidate_id, seed))
        shape = _solid_shape(evidence, variation, candidate_id)
        return shape, _metrics(shape, evidence)


def _generator(evidence: Evidence, candidate_id: str, seed: int) -> np.random.Generator:
    """Randomness of one candidate of one object."""
    return np.random.default_rng([seed, zlib.crc32(evidence.track.name.encode()), zlib.crc32(candidate_id.encode())])


def _solid_shape(evidence: Evidence, variation: Variation, candidate_id: str) -> Shape:
    """The shape, closed; raises GenerationFailed."""
    shape = _make_shape(evidence, variation)
    if not _is_solid(shape):
        raise GenerationFailed(f"{evidence.track.name}: candidate {candidate_id} did not close")
    return shape


def _metrics(shape: Shape, evidence: Evidence) -> dict[str, float]:
    """Scale-free measures, and how the shape fits the masks and depth of the frames that judge all candidates alike."""
    fit = self_consistency(shape.vertices_world, shape.faces, shape.maskable, evidence.pool[:_JUDGES])
    return {**shape_metrics(shape.vertices_local, shape.faces), **fit}


def _make_shape(evidence: Evidence, variation: Variation) -> Shape:
    """The shape by what the segmenter found; a front or appliance without its measures is treated as a thing."""
    track = evidence.track
    if track.kind == "front" and track.front is not None:
        return front_shape(evidence, variation)
    if track.kind == "appliance" and track.box is not None:
        return appliance_shape(evidence, variation)
    return thing_shape(evidence, variation)


def _cut_open(shape: Shape) -> Atlas:
    if shape.front_y_m is not None:
        return planar_atlas(shape.vertices_local, shape.faces, _FRONT_PX, _FINEST_TEXEL_M)
    return unwrapped_atlas(shape.vertices_local, shape.faces, _THING_PX)


def _is_solid(shape: Shape) -> bool:
    """Closed, manifold, wound outwards."""
    vertices, faces = shape.vertices_local, shape.faces
    return is_watertight(vertices, faces) and is_manifold(vertices, faces) and volume(vertices, faces) > 0
