"""Weight-free generator: observed geometry at LiDAR noise, completed by symmetry, to the wall or to the category's depth."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.asset import centred, shape_metrics
from r2c2r_core.generate.bake import bake
from r2c2r_core.generate.boxed import front_hypotheses
from r2c2r_core.generate.charts import Atlas, planar_atlas, unwrapped_atlas
from r2c2r_core.generate.consistency import Params as ConsistencyParams
from r2c2r_core.generate.consistency import self_consistency
from r2c2r_core.generate.evidence import Evidence, View
from r2c2r_core.generate.hypothesis import Hypothesis
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.standing import stands
from r2c2r_core.generate.things import thing_hypotheses
from r2c2r_core.generate.variation import Variation, draw_variation, whole_pool
from r2c2r_core.geometry.meshes import face_areas, is_manifold, is_watertight, volume
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of texture resolution."""

    front_px: int = param(768, "px", "Minimum long side of a front's texture, where photos show no more detail", ge=16)
    finest_texel_m: float = param(
        0.0012,
        "m",
        "Minimum side of a texel, unless photos show finer detail",
        source="a phone at 1 m sees 1.3 mm per pixel",
        gt=0,
    )
    thing_px: int = param(512, "px", "Minimum side of an object's texture, where photos show no more detail", ge=16)
    most_front_px: int = param(1536, "px", "Maximum long side of a front's texture: baking 9 views of it takes 0.1 GB", ge=16)
    most_thing_px: int = param(1024, "px", "Maximum side of an object's texture: baking 20 views of it takes 0.15 GB", ge=16)
    packed: float = param(0.6, "share", "Expected fraction of an object's texture that its charts cover", gt=0, le=1)


class Completion(MeshGenerator):
    """Weight-free generator: boxes for furniture; cuboids, solids of revolution or carved solids for objects."""

    def __init__(self) -> None:
        self._known: _Known | None = None

    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        """One candidate: one of the shape hypotheses, in turn.

        With seed 0 the first turn uses all good frames; every other turn draws its own subset.
        """
        guess = self._guess(evidence, candidate_id, seed)
        atlas = cut_open(guess.shape, evidence.pool)
        shape, variation = guess.shape, guess.variation
        # a bare side may show in a few frames only, so furniture is textured from the whole pool
        views = variation.views if shape.front_y_m is None else evidence.pool
        picture = bake(atlas, shape.vertices_world, shape.faces, shape.world_from_local, views, shape.front_y_m, shape.handle)
        mesh, local_from_mesh = centred(shape.vertices_local, atlas.source, atlas.faces, atlas.uv, picture.texture)
        return MeshAsset(
            object_name=evidence.track.name,
            candidate_id=candidate_id,
            mesh=mesh,
            generator="completion",
            seed=seed,
            watertight=True,
            frames=tuple(sorted(view.frame_index for view in variation.views)),
            metrics={**_metrics(shape, evidence), "seen_fraction": picture.seen_fraction},
            parameters={**variation.parameters, **shape.parameters},
            warnings=shape.warnings,
            world_from_mesh=shape.world_from_local @ local_from_mesh,
            assumes=guess.assumes,
        )

    def measured(self, evidence: Evidence, candidate_id: str, seed: int) -> tuple[Shape, dict[str, float], str]:
        """The same candidate's posed shape without texture, its metrics, and the hypothesis it assumes."""
        guess = self._guess(evidence, candidate_id, seed)
        return guess.shape, _metrics(guess.shape, evidence), guess.assumes

    def _guess(self, evidence: Evidence, candidate_id: str, seed: int) -> "_Guess":
        """The candidate's closed shape; raises GenerationFailed."""
        known = self._hypotheses(evidence)
        turn, place = divmod(int(candidate_id.removeprefix("c")), len(known.hypotheses))
        hypothesis = known.hypotheses[place]
        variation = known.draw(turn, seed)
        shape = hypothesis.shape(variation)
        if not _is_solid(shape):
            raise GenerationFailed(f"{evidence.track.name}: candidate {candidate_id} did not close")
        return _Guess(shape, variation, hypothesis.assumes.format(**shape.parameters))

    def _hypotheses(self, evidence: Evidence) -> "_Known":
        """Shape hypotheses, computed once per object and cached until the next object."""
        if self._known is None or self._known.evidence is not evidence:
            everything = whole_pool(evidence)
            try:
                self._known = _Known(evidence, everything, _hypotheses_of(evidence, everything), {})
            except GenerationFailed as error:  # the other candidates would fail equally
                self._known = _Known(evidence, everything, (), {}, error)
        if self._known.failure is not None:
            raise self._known.failure.with_traceback(None)
        return self._known


class _Known(NamedTuple):
    evidence: Evidence
    everything: Variation  # every good frame, and the middle of each range
    hypotheses: tuple[Hypothesis, ...]
    draws: dict[tuple[int, int], Variation]
    failure: GenerationFailed | None = None  # why there are no hypotheses

    def draw(self, turn: int, seed: int) -> Variation:
        """Frames and settings that all hypotheses share in one turn: every good frame first at seed 0, else a subset."""
        if turn == 0 and seed == 0:
            return self.everything
        if (turn, seed) not in self.draws:
            self.draws[turn, seed] = draw_variation(self.evidence, _generator(self.evidence, f"turn {turn}", seed))
        return self.draws[turn, seed]


class _Guess(NamedTuple):
    shape: Shape
    variation: Variation
    assumes: str


def _generator(evidence: Evidence, purpose: str, seed: int) -> np.random.Generator:
    """Random generator for one purpose of one object."""
    return np.random.default_rng([seed, zlib.crc32(evidence.track.name.encode()), zlib.crc32(purpose.encode())])


def _metrics(shape: Shape, evidence: Evidence) -> dict[str, float]:
    """Scale-free shape metrics and the fit to masks and depth of the common judging views."""
    fit = self_consistency(shape.vertices_world, shape.faces, shape.maskable, evidence.pool[: tuned(ConsistencyParams).judges])
    more = {} if shape.unseen_error_m is None else {"unseen_error_m": shape.unseen_error_m}
    if evidence.track.kind == "thing":  # furniture hangs on its wall
        more |= {"stands": float(stands(shape.vertices_world, shape.faces)), "carved": shape.parameters.get("carved", 0.0)}
    return {**shape_metrics(shape.vertices_local, shape.faces), **fit, **more}


def _hypotheses_of(evidence: Evidence, everything: Variation) -> tuple[Hypothesis, ...]:
    """Hypotheses by the segmenter's kind of object; a front or appliance without measurements is treated as a free object."""
    track = evidence.track
    if track.kind != "thing" and track.front is not None:
        return front_hypotheses(evidence, track.front)
    return thing_hypotheses(evidence, everything)


def cut_open(shape: Shape, views: Sequence[View]) -> Atlas:
    """The shape's atlas at the resolution of the nearest photo, within the memory limits."""
    params = tuned(Params)
    pixel_m = _finest_pixel_m(shape, views)
    if shape.front_y_m is not None:
        spans = np.ptp(shape.vertices_local, axis=0)
        longest = int(np.clip(np.ceil(max(spans[0], spans[2]) / pixel_m), params.front_px, params.most_front_px))
        return planar_atlas(shape.vertices_local, shape.faces, longest, min(params.finest_texel_m, pixel_m))
    area_m2 = float(face_areas(shape.vertices_local, shape.faces).sum())
    side = int(np.clip(np.ceil(np.sqrt(area_m2 / params.packed) / pixel_m), params.thing_px, params.most_thing_px))
    return unwrapped_atlas(shape.vertices_local, shape.faces, side)


def _finest_pixel_m(shape: Shape, views: Sequence[View]) -> float:
    """Smallest footprint of a pixel at the shape's distance over all photos."""
    centre = shape.vertices_world.mean(axis=0)[None]
    depths = [max(float(view.world_from_camera.inverse.apply(centre)[0, 2]), 0.1) for view in views]
    return min((depth / view.rgb_camera.fx for depth, view in zip(depths, views, strict=True)), default=np.inf)


def _is_solid(shape: Shape) -> bool:
    """Whether the mesh is closed, manifold and wound outwards."""
    vertices, faces = shape.vertices_local, shape.faces
    return is_watertight(vertices, faces) and is_manifold(vertices, faces) and volume(vertices, faces) > 0
