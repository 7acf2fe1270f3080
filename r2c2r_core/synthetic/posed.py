"""A lit scene with its fronts moved to their states in one frame."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.atlas import LitScene
from r2c2r_core.synthetic.patches import Patch

_PAD_PX = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """One scene lit twice: with every front closed, and with the opening fronts half open.

    Moving parts are lit by a blend of the two; interiors by the second alone.
    """

    closed: LitScene
    opened: LitScene  # the same patches in the same places of the atlas
    vertices_of: Mapping[str, np.ndarray]  # vertices moved by each joint, closed
    atlas: Image  # atlas of the closed scene, with the interiors as lit when open

    @staticmethod
    def of(closed: LitScene, opened: LitScene, inner: np.ndarray) -> "Stage":
        """Stage from both scenes; `inner` (patches,) marks the interiors."""
        owner = _patch_of_vertex(closed)
        movers = np.array(closed.mover_of_patch)[owner]
        atlas = closed.atlas.copy()
        for patch in np.flatnonzero(inner):
            rows, columns = _tile(closed, owner == patch)
            atlas[rows, columns] = opened.atlas[rows, columns]
        vertices = {str(name): np.flatnonzero(movers == name) for name in np.unique(movers) if name}
        return Stage(closed=closed, opened=opened, vertices_of=vertices, atlas=atlas)

    def at(self, poses: Mapping[str, Rigid3 | None], openness: Mapping[str, float]) -> LitScene:
        """The scene with each mover at its pose (None: absent), lit according to its openness, 0..1."""
        scene, owner = self.closed, _patch_of_vertex(self.closed)
        vertices, gone = scene.vertices.copy(), np.zeros(len(scene.vertices), bool)
        normals, atlas = scene.normal_of_patch.copy(), self.atlas
        movers = np.array(scene.mover_of_patch)
        for name, pose in poses.items():
            mine = self.vertices_of[name]
            if pose is None:
                gone[mine] = True
                continue
            vertices[mine] = pose.apply(vertices[mine])
            normals[movers == name] = pose.turn(normals[movers == name])
        blended = [name for name, share in openness.items() if share > 0]
        if blended:
            atlas = atlas.copy()
        for name in blended:
            for patch in np.flatnonzero(movers == name):
                rows, columns = _tile(scene, owner == patch)
                share = min(openness[name], 1.0)
                mixed = (1 - share) * atlas[rows, columns] + share * self.opened.atlas[rows, columns]
                atlas[rows, columns] = np.rint(mixed).astype(np.uint8)
        faces = scene.faces[~gone[scene.faces[:, 0]]]
        first, second, third = (vertices[faces[:, k]] for k in range(3))
        face_normals = np.cross(second - first, third - first)
        return replace(
            scene,
            vertices=vertices,
            faces=faces,
            atlas=atlas,
            normal_of_patch=normals,
            pane_faces=scene.pane_faces[~gone[scene.faces[:, 0]]],
            face_normals=face_normals,
            face_offsets=np.einsum("ij,ij->i", face_normals, first),
        )


def moved_patches(patches: list[Patch], poses: Mapping[str, Rigid3]) -> list[Patch]:
    """The patches with the moving ones at their joints' poses."""
    return [
        replace(p, grid=poses[p.mover].apply(p.grid.reshape(-1, 3)).reshape(p.grid.shape)) if p.mover in poses else p
        for p in patches
    ]


def _patch_of_vertex(scene: LitScene) -> np.ndarray:
    return np.asarray(np.rint(scene.attributes[:, 2]).astype(int))


def _tile(scene: LitScene, mine: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns of a patch's piece of the atlas, with its padding."""
    low = np.floor(scene.attributes[mine, :2].min(axis=0)).astype(int) - _PAD_PX
    high = np.ceil(scene.attributes[mine, :2].max(axis=0)).astype(int) + _PAD_PX
    return slice(low[1], high[1]), slice(low[0], high[0])
