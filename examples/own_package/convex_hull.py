"""Example generator: the convex hull of an object's observed depth points, in their mean colour, in place."""

import numpy as np
import trimesh

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.asset import centred, shape_metrics
from r2c2r_core.generate.evidence import Evidence, masked_points
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.registry import Backend


class ConvexHull(MeshGenerator):
    def make(self, evidence: Evidence, candidate_id: str, seed: int) -> MeshAsset:
        rng = np.random.default_rng([seed, int(candidate_id[1:])])  # the same candidate gives the same mesh
        views = [view for view in evidence.pool if rng.random() < 0.8] or list(evidence.pool)
        points = np.concatenate([masked_points(view) for view in views])
        if len(points) < 10:
            raise GenerationFailed(
                f"{evidence.track.name}: depth shows {len(points)} points", hint="add a click on another frame"
            )
        hull = trimesh.convex.convex_hull(points)
        vertices, faces = np.asarray(hull.vertices), np.asarray(hull.faces)
        colour = np.concatenate([view.rgb[view.mask] for view in views]).mean(axis=0).astype(np.uint8)
        texture = np.full((8, 8, 3), colour, np.uint8)
        mesh, world_from_mesh = centred(vertices, np.arange(len(vertices)), faces, np.full((len(vertices), 2), 0.5), texture)
        return MeshAsset(
            object_name=evidence.track.name,
            candidate_id=candidate_id,
            mesh=mesh,
            generator=LINE.name,
            seed=seed,
            watertight=True,
            frames=tuple(view.frame_index for view in views),
            metrics=shape_metrics(vertices, faces),
            parameters={"views": float(len(views))},
            warnings=(),
            world_from_mesh=world_from_mesh,  # None where a model does not know: align then searches for it
        )


LINE = Backend(
    name="convex-hull", target="convex_hull:ConvexHull", licence="MIT", summary="the convex hull of the seen points; no weights"
)
