"""scene.glb: the scene for web viewers, closed, with its joints as clips; one node a link with the link's name.

glTF is +Y up: the root node turns it.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.writers.glb_motion import with_motion
from r2c2r_core.export.writers.meshes import box_mesh

Y_UP_FROM_WORLD = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def write_glb(plan: Plan, path: Path) -> None:
    """Write the plan as one binary glTF."""
    import trimesh

    scene = trimesh.Scene(base_frame="root")
    scene.graph.update(frame_to=WORLD, frame_from="root", matrix=Y_UP_FROM_WORLD)
    pictures: dict[str, Any] = {}  # one material a texture: encoding pictures is what takes the time
    for body in plan.bodies:
        scene.graph.update(frame_to=body.name, frame_from=body.parent, matrix=body.parent_from_body.matrix)
        mesh = _mesh_of(body, pictures)
        if mesh is not None:
            scene.add_geometry(mesh, node_name=f"{body.name}_vis", geom_name=f"{body.name}_vis", parent_node_name=body.name)
    path.write_bytes(with_motion(scene.export(file_type="glb"), plan.bodies))


def check_glb(path: Path) -> Iterator[str]:
    """Whether the container is whole: its header (glTF 2.0, section 4.4) tells magic, version and length."""
    content = path.read_bytes()
    if len(content) < 12 or content[:4] != b"glTF":
        yield "does not begin with 'glTF'"
        return
    version, length = struct.unpack("<II", content[4:12])
    if version != 2:
        yield f"is glTF {version}, 2 is expected"
    if length != len(content):
        yield f"holds {len(content)} bytes, {length} are expected"


def _mesh_of(body: Body, pictures: dict[str, Any]) -> Any:
    import trimesh
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    visual = body.link.visual
    if visual is not None:
        file = body.texture_file or body.name
        if file not in pictures:
            pictures[file] = _material(file, visual.texture)
        dressed = TextureVisuals(uv=visual.uv, material=pictures[file])
        return trimesh.Trimesh(visual.vertices, visual.faces, visual=dressed, process=False)
    vertices, faces = box_mesh(body)
    if len(faces) == 0:
        return None
    colour = [*(round(255 * c) for c in body.link.colour), 255]
    material = PBRMaterial(name=f"{body.name}_vis", baseColorFactor=colour, metallicFactor=0.0, roughnessFactor=0.9)
    # flat shading: every triangle has corners of its own
    mesh = trimesh.Trimesh(vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), process=False)
    mesh.visual = TextureVisuals(material=material)
    return mesh


def _material(file: str, texture: Image) -> Any:
    from PIL.Image import fromarray
    from trimesh.visual.material import PBRMaterial

    picture = fromarray(np.ascontiguousarray(texture))
    name = Path(file).stem
    return PBRMaterial(name=name, baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=0.9, doubleSided=True)
