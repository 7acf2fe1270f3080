"""Converter of the `gymnasium-robotics` wheel's Franka kitchen (1.4.2) into a phone recording with ground truth.

    python benchmarks/franka.py WHEEL_OR_FOLDER OUT [--frames 120] [--size 640x480] [--seed 0] [--scale 0.575]

WHEEL_OR_FOLDER is the wheel, or a folder it was unpacked to. Shapes, colours, textures and joints come from its MJCF
(Apache-2.0); its robot is left out. As modelled, the worktop is 1.6 m high and the oven 1 m wide; `--scale` makes them 0.92 m
and 0.58 m. The MJCF has no oven door, so there is no joint to find.
"""

import argparse
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from worlds import Surface, World, box_of, film, joint_of, room

from r2c2r_core.synthetic.truth import TrueObject

_MODEL = "gymnasium_robotics/envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml"
_DRAWN = 1  # group of the visual geoms; the others are colliders
_GRIPS = (int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_CAPSULE))  # a model stores plain numbers
_BODIES = {  # name and category: its bodies, the one that may move last; the knobs on the hood belong to no object
    ("oven_0", "range"): ("Burner 1", "Burner 2", "Burner 3", "Burner 4", "ovenroot"),
    ("hood_0", "hood"): ("hoodroot",),
    ("microwave_0", "microwave"): ("microroot", "microdoorroot"),
    ("kettle_0", "kettle"): ("kettleroot",),
}
_FRONTS = {  # name and category: the body of the front, and of the carcass that it closes
    ("wall_cabinet_0", "wall_cabinet"): ("hingeleftdoor", "hingecab"),
    ("wall_cabinet_1", "wall_cabinet"): ("hingerightdoor", "hingecab"),
    ("wall_cabinet_2", "wall_cabinet"): ("slidelink", "slide"),
}
_EYES = (
    *((0.3, -2.9, 2.6), (-0.5, -2.2, 2.6), (-0.6, -1.4, 2.7), (0.2, -1.3, 2.9), (1.2, -1.5, 2.7)),
    *((1.6, -2.0, 2.2), (1.2, -1.7, 1.7), (0.1, -1.8, 1.8), (-0.3, -1.5, 2.2), (0.5, -1.6, 2.4)),
)
_TARGETS = (
    *((0.0, 0.6, 1.6), (-0.5, 0.7, 2.3), (-0.4, 0.7, 2.5), (0.0, 0.7, 2.5), (0.1, 0.7, 2.3)),
    *((0.2, 0.4, 1.2), (0.1, 0.3, 0.9), (0.0, 0.3, 0.8), (-0.6, 0.6, 1.8), (-0.1, 0.5, 2.0)),
)


def main() -> None:
    """Draw the recording."""
    parser = argparse.ArgumentParser(description="The Franka kitchen as a recording.")
    parser.add_argument("source", type=Path)
    parser.add_argument("--scale", type=float, default=0.575)
    film(parser, _read)


def _read(options: argparse.Namespace) -> World:
    with tempfile.TemporaryDirectory() as scratch:
        return franka_kitchen(_unpacked(options.source, Path(scratch)) / _MODEL, options.scale)


def _unpacked(source: Path, scratch: Path) -> Path:
    if source.is_dir():
        return source
    with zipfile.ZipFile(source) as wheel:
        wheel.extractall(scratch, [name for name in wheel.namelist() if "/kitchen_franka/" in name])
    return scratch


def franka_kitchen(model_file: Path, scale: float) -> World:
    """The kitchen, closed, in a plain room."""
    model = mujoco.MjModel.from_xml_path(str(model_file))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    drawn = {geom: _mesh(model, data, geom, scale) for geom in range(model.ngeom) if _is_drawn(model, geom)}
    things = tuple(_things(model, data, drawn, scale))
    owner = {geom: _owner(model, data, geom, things, scale) for geom in drawn}
    surfaces = [_surface(model, geom, mesh, owner[geom]) for geom, mesh in drawn.items()]
    low, high = np.array([-1.6, -4.5, 0.0]) * scale, np.array([3.5, 1.48, 4.4]) * scale
    return World(
        surfaces=(*surfaces, *room(low, high, (0.62, 0.60, 0.55), (0.35, 0.30, 0.25))),
        things=things,
        eyes=np.array(_EYES) * scale,
        targets=np.array(_TARGETS) * scale,
        lights=np.array([[0.8, -1.6, 4.2], [-0.4, -3.0, 4.2], [2.4, -1.0, 4.2]]) * scale,
    )


def _is_drawn(model: Any, geom: int) -> bool:
    root = model.body(model.body_rootid[model.geom_bodyid[geom]]).name
    return model.geom_group[geom] == _DRAWN and root in ("desk", "kettle")


def _mesh(model: Any, data: Any, geom: int, scale: float) -> trimesh.Trimesh:
    """A geom's mesh in the world; its vertices in its own frame are kept in `metadata` for the texture."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        at = model.geom_dataid[geom]
        vertices = model.mesh_vert[model.mesh_vertadr[at] :][: model.mesh_vertnum[at]]
        faces = model.mesh_face[model.mesh_faceadr[at] :][: model.mesh_facenum[at]]
        mesh = trimesh.Trimesh(vertices, faces, process=False)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = trimesh.creation.box(extents=2 * size)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=32)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        mesh = trimesh.creation.capsule(radius=size[0], height=2 * size[1])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    else:
        mesh = trimesh.creation.icosphere(radius=size[0])
    mesh.metadata["own"] = np.array(mesh.vertices)
    mesh.vertices = scale * (mesh.vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return mesh


def _things(model: Any, data: Any, drawn: dict[int, trimesh.Trimesh], scale: float) -> list[TrueObject]:
    bodies = {geom: model.body(model.geom_bodyid[geom]).name for geom in drawn}

    def of(names: tuple[str, ...], *, grips: bool) -> np.ndarray:
        chosen = [g for g, body in bodies.items() if body in names and (grips or model.geom_type[g] not in _GRIPS)]
        return np.concatenate([drawn[geom].vertices for geom in chosen])

    made = []
    for (name, category), names in _BODIES.items():
        whole = of(names, grips=category == "kettle")
        made.append(_thing(model, data, name, category, whole, whole, names[-1], scale))
    for (name, category), (front, carcass) in _FRONTS.items():
        face = of((front,), grips=False)
        behind = np.column_stack([face[:, 0], np.full(len(face), of((carcass,), grips=False)[:, 1].max()), face[:, 2]])
        made.append(_thing(model, data, name, category, np.concatenate([face, behind]), face, front, scale))
    return made


def _thing(
    model: Any, data: Any, name: str, category: str, whole: np.ndarray, front: np.ndarray, body: str, scale: float
) -> TrueObject:
    """Ground truth of the object whose moving part is `body`."""
    turn = data.body(body).xmat.reshape(3, 3)
    size, pose = box_of(whole, front, 0.0 if category == "kettle" else float(np.arctan2(turn[1, 0], turn[0, 0])))
    joints, first = [], model.body(body).jntadr[0]
    if first >= 0:
        slides = model.jnt_type[first] == mujoco.mjtJoint.mjJNT_SLIDE
        limits = model.jnt_range[first] * (scale if slides else 1.0)
        kind = "prismatic" if slides else "revolute"
        joints.append(joint_of(name, kind, data.xaxis[first], scale * data.xanchor[first], tuple(limits), pose))
    return TrueObject(name=name, category=category, dimensions_m=size, kitchen_from_object=pose, joints=tuple(joints))


def _owner(model: Any, data: Any, geom: int, things: tuple[TrueObject, ...], scale: float) -> int:
    """Index of the object that a geom belongs to: a carcass belongs to the front that it lies behind."""
    body = model.body(model.geom_bodyid[geom]).name
    lines = [*_BODIES.values(), *_FRONTS.values()]
    for index, (thing, names) in enumerate(zip(things, lines, strict=True)):
        own = thing.kitchen_from_object.inverse.apply(scale * data.geom_xpos[geom])
        if body in names and (names not in _FRONTS.values() or abs(own[0]) <= thing.dimensions_m[0] / 2 + 0.01):
            return index
    return -1


def _surface(model: Any, geom: int, mesh: trimesh.Trimesh, thing: int) -> Surface:
    """The surface with its material's colour, gloss and texture, mapped by the dominant axis of each face's normal."""
    material = model.geom_matid[geom]
    rgba = model.mat_rgba[material] * (model.geom_rgba[geom] if (model.geom_rgba[geom][:3] != 0.5).any() else 1.0)
    number = model.mat_texid[material][mujoco.mjtTextureRole.mjTEXROLE_RGB]
    texture = uv = None
    if number >= 0:
        height, width, channels = model.tex_height[number], model.tex_width[number], model.tex_nchannel[number]
        start = model.tex_adr[number]
        texture = model.tex_data[start : start + height * width * channels].reshape(height, width, channels)[..., :3].copy()
        own = trimesh.Trimesh(mesh.metadata["own"], mesh.faces, process=False)
        share = (own.vertices - own.bounds[0]) / np.maximum(own.extents, 1e-6)
        sides = np.array([[1, 2], [0, 2], [0, 1]])[np.abs(own.face_normals).argmax(axis=1)]
        uv = np.take_along_axis(share[mesh.faces], sides[:, None, :].repeat(3, axis=1), axis=2) * model.mat_texrepeat[material]
    return Surface(
        vertices=np.asarray(mesh.vertices),
        faces=np.asarray(mesh.faces),
        colour=rgba[:3] ** 2.2,
        texture=texture,
        uv=uv,
        gloss=0.15 * float(model.mat_specular[material]) + 0.1 * float(model.mat_reflectance[material]),
        thing=thing,
    )


if __name__ == "__main__":
    main()
