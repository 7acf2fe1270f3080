"""Textured solids for Boolean cuts: manifold3d carries uv along, so seams and textures survive the cut."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Image, Points, TextureCoords, Vector3
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.model.mesh import TexturedMesh

_STRIP_PX = 8


class Paint(NamedTuple):
    """A texture with a strip of plain colours added below, and the uv of each colour."""

    texture: Image
    inside_uv: np.ndarray  # (2,) colour of the inside of furniture
    back_uv: np.ndarray  # (2,) colour of the back of a front


def with_plain_colours(
    mesh: TexturedMesh, inside: tuple[int, int, int], back: tuple[int, int, int]
) -> tuple[TexturedMesh, Paint]:
    """The same mesh on a texture that also contains two plain colours, for unobserved faces."""
    height, width = mesh.texture.shape[:2]
    strip = np.zeros((_STRIP_PX, width, 3), np.uint8)
    strip[:, : width // 2], strip[:, width // 2 :] = inside, back
    texture = np.concatenate([mesh.texture, strip])
    total = height + _STRIP_PX
    uv = mesh.uv.copy()
    uv[:, 1] = (np.clip(uv[:, 1], 0.0, 1.0) * height + _STRIP_PX) / total
    v = _STRIP_PX / 2 / total
    painted = TexturedMesh(vertices=mesh.vertices, faces=mesh.faces, uv=uv, texture=texture)
    return painted, Paint(texture, np.array([0.25, v]), np.array([0.75, v]))


def solid_of(vertices: Points, faces: Faces, uv: TextureCoords) -> Any | None:
    """A manifold3d solid that carries uv; None when the surface does not bound a solid."""
    import manifold3d

    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(np.column_stack([vertices, uv]), dtype=np.float64),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
    )
    mesh.merge()
    solid = manifold3d.Manifold(mesh)
    return solid if solid.status() == manifold3d.Error.NoError and solid.volume() > 0 else None


def box_solid(low: Vector3, high: Vector3, uv: np.ndarray) -> Any:
    """A solid box of one plain colour."""
    vertices, faces = box_mesh(np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64))
    solid = solid_of(vertices, faces, np.tile(uv, (len(vertices), 1)))
    assert solid is not None  # a box is always a solid
    return solid


def mesh_of(solid: Any, texture: Image) -> TexturedMesh:
    """The solid's surface as a textured mesh."""
    out = solid.to_mesh64()
    properties = np.asarray(out.vert_properties, dtype=np.float64)
    faces = np.asarray(out.tri_verts, dtype=np.int64)
    uv = properties[:, 3:5] if properties.shape[1] >= 5 else np.zeros((len(properties), 2))
    return TexturedMesh(vertices=properties[:, :3].copy(), faces=faces, uv=uv.copy(), texture=texture)


def joined(meshes: Sequence[TexturedMesh]) -> TexturedMesh:
    """Several meshes with one texture joined into one."""
    offsets = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return TexturedMesh(
        vertices=np.concatenate([m.vertices for m in meshes]),
        faces=np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=True)]),
        uv=np.concatenate([m.uv for m in meshes]),
        texture=meshes[0].texture,
    )


def plain_box(size_m: Vector3, uv: np.ndarray, texture: Image) -> TexturedMesh:
    """A centred box of one plain colour."""
    vertices, faces = box_mesh(-np.asarray(size_m) / 2, np.asarray(size_m) / 2)
    return TexturedMesh(vertices=vertices, faces=faces, uv=np.tile(uv, (len(vertices), 1)), texture=texture)
