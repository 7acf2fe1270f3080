"""Binary glTF export of one textured mesh."""

import numpy as np

from r2c2r_core.arrays import Faces, Points, Texture, TextureCoords


def glb_bytes(vertices: Points, faces: Faces, uv: TextureCoords, texture: Texture) -> bytes:
    """The mesh as GLB, in its own frame and unit: it is not rotated to glTF's +Y up."""
    import trimesh
    from PIL import Image as Pictures
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    picture = Pictures.fromarray(np.ascontiguousarray(texture))
    material = PBRMaterial(baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=0.9)
    dressed = TextureVisuals(uv=uv, material=material)
    return bytes(trimesh.Trimesh(vertices, faces, visual=dressed, process=False).export(file_type="glb"))
