"""Converter of ReplicaCAD's articulated pieces into a phone recording with ground truth.

    python benchmarks/replicacad.py FOLDER OUT [--frames 120] [--size 640x480] [--seed 0]

FOLDER holds replicacad-kitchen_counter, replicacad-fridge and replicacad-doubledoor (URDF and GLB, CC BY 4.0). They stand in a
row in a plain room; the two doors, which come without a carcass, close a cupboard drawn here, 0.6 m deep. A drawer's depth is
the counter's.
"""

import argparse
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation
from worlds import Surface, World, box_of, film, joint_of, room

from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.truth import TrueJoint, TrueObject

_TURN = np.column_stack([[0, -1, 0], [0, 0, 1], [-1, 0, 0]]).astype(float)  # theirs: front +x, +y up; ours: front -y, +z up
_CUPBOARD_M, _BOARD_M = 0.6, 0.02
_WOOD = np.array([0.45, 0.36, 0.26])
_FACING = 0.95  # minimum cosine for a triangle to face the front
_HANDLE_SHARE = 0.15  # maximum fraction of a front's area


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """A link of a URDF in its closed pose, with its parent joint."""

    name: str
    joint: ElementTree.Element
    place: Rigid3  # world_from_link
    meshes: tuple[trimesh.Trimesh, ...]  # world

    @property
    def vertices(self) -> np.ndarray:
        """All of its vertices, with a handle's projected onto the front face."""
        points = np.concatenate([mesh.vertices for mesh in self.meshes])
        points[:, 1] = np.maximum(points[:, 1], self._face())
        return points

    def _face(self) -> float:
        """The y of the front face: the foremost triangles that face -y, except for the small area of a handle."""
        normals = np.concatenate([mesh.face_normals for mesh in self.meshes])
        areas = np.concatenate([mesh.area_faces for mesh in self.meshes])
        y = np.concatenate([mesh.triangles_center[:, 1] for mesh in self.meshes])
        chosen = np.flatnonzero(normals[:, 1] < -_FACING)
        order = chosen[np.argsort(y[chosen])]
        return float(y[order][np.searchsorted(np.cumsum(areas[order]), _HANDLE_SHARE * areas[order].sum())])


def main() -> None:
    """Draw the recording."""
    parser = argparse.ArgumentParser(description="ReplicaCAD's articulated pieces as a recording.")
    parser.add_argument("folder", type=Path)
    film(parser, lambda options: replica_room(options.folder))


def replica_room(folder: Path) -> World:
    """The three pieces side by side, their backs to one wall."""
    counter = _standing(folder / "replicacad-kitchen_counter" / "kitchen_counter.urdf", 0.0)
    fridge = _standing(folder / "replicacad-fridge" / "fridge.urdf", _end(counter, 1) + 0.06)
    doors = _standing(folder / "replicacad-doubledoor" / "doubledoor.urdf", 0.0)
    doors = [_moved(link, [-_end(doors, 1) + _end(counter, -1) - 0.08, _BOARD_M - _CUPBOARD_M, 0.06]) for link in doors]
    things, surfaces = _drawers(counter)
    for more, drawn in (_refrigerator(fridge, len(things)), _cupboard(doors, len(things) + 1)):
        things, surfaces = [*things, *more], [*surfaces, *drawn]
    low, high = _end(doors, -1) - 0.8, _end(fridge, 1) + 0.9
    middle = (low + high) / 2
    places = np.array([middle, high - 1.4, high - 2.2, middle, low + 1.9, low + 1.2, low + 1.9, middle, high - 1.6])
    heights = np.array([1.5, 1.45, 1.3, 1.2, 1.35, 1.5, 1.6, 1.0, 1.4])
    away = -np.array([3.0, 2.3, 1.9, 1.8, 2.0, 2.4, 2.2, 1.7, 2.2])
    ahead = np.array([0.0, 0.5, -0.2, -0.5, -0.5, 0.1, 0.3, 0.5, 0.7])
    looks = np.array([0.9, 0.9, 0.7, 0.5, 0.8, 1.2, 0.7, 0.45, 1.2])
    return World(
        surfaces=(*surfaces, *room((low, -4.2, 0.0), (high, 0.0, 2.6), (0.55, 0.53, 0.48), (0.33, 0.28, 0.22))),
        things=tuple(things),
        eyes=np.column_stack([places, away, heights]),
        targets=np.column_stack([places + ahead, np.full(len(places), -0.5), looks]),
        lights=np.array([[middle - 1.5, -2.2, 2.45], [middle + 1.5, -2.4, 2.45]]),
    )


def _standing(urdf: Path, left: float) -> list[Link]:
    """The links of a piece on the floor with its back to y = 0, its left end at `left`."""
    links = read_urdf(urdf)
    points = np.concatenate([mesh.vertices for link in links for mesh in link.meshes])
    low, high = points.min(axis=0), points.max(axis=0)
    return [_moved(link, [left - low[0], -high[1], -low[2]]) for link in links]


def read_urdf(urdf: Path) -> list[Link]:
    """Links with meshes, all joints at 0, in this project's axes."""
    robot = ElementTree.parse(urdf).getroot()
    joints = {joint.find("child").attrib["link"]: joint for joint in robot.findall("joint")}  # type: ignore[union-attr]
    links = []
    for element in robot.findall("link"):
        visuals = element.findall("visual")
        if visuals:
            place = Rigid3(_TURN) @ _place(element.attrib["name"], joints)
            meshes = tuple(mesh for visual in visuals for mesh in _meshes(visual, urdf.parent, place))
            links.append(Link(name=element.attrib["name"], joint=joints[element.attrib["name"]], place=place, meshes=meshes))
    return links


def _place(link: str, joints: dict[str, ElementTree.Element]) -> Rigid3:
    if link not in joints:
        return Rigid3()
    joint = joints[link]
    return _place(joint.find("parent").attrib["link"], joints) @ _origin(joint)  # type: ignore[union-attr]


def _origin(element: ElementTree.Element) -> Rigid3:
    origin = element.find("origin")
    turn, shift = (_numbers(origin.attrib[key]) for key in ("rpy", "xyz")) if origin is not None else (np.zeros(3),) * 2
    quarters = np.round(turn / (np.pi / 2)) * np.pi / 2  # theirs are rounded to 1.56, which would tilt a fridge
    return Rigid3(Rotation.from_euler("xyz", quarters).as_matrix(), shift)


def _numbers(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.replace(",", " ").split()])


def _meshes(visual: ElementTree.Element, folder: Path, place: Rigid3) -> list[trimesh.Trimesh]:
    source = visual.find("geometry/mesh")
    assert source is not None
    pieces = trimesh.load(folder / source.attrib["filename"]).dump(concatenate=False)
    pose = place @ _origin(visual)
    for mesh in pieces:
        mesh.vertices = pose.apply(np.asarray(mesh.vertices) * _numbers(source.attrib["scale"]))
    return list(pieces)


def _moved(link: Link, shift: list[float]) -> Link:
    moved = tuple(mesh.copy().apply_translation(shift) for mesh in link.meshes)
    return Link(name=link.name, joint=link.joint, place=Rigid3(np.eye(3), np.array(shift)) @ link.place, meshes=moved)


def _end(links: list[Link], side: int) -> float:
    """The piece's x at its left (-1) or right (1) end."""
    x = np.concatenate([mesh.vertices[:, 0] for link in links for mesh in link.meshes])
    return float(x.max() if side > 0 else x.min())


def _drawers(counter: list[Link]) -> tuple[list[TrueObject], list[Surface]]:
    body, *drawers = counter
    back = max(mesh.vertices[:, 1].max() for mesh in body.meshes)
    things = [
        _thing(f"drawer_{index}", "drawer", _reaching(link.vertices, back), link.vertices, [link])
        for index, link in enumerate(drawers)
    ]
    owned = [surface for index, link in enumerate(drawers) for surface in _surfaces(link, index)]
    return things, [*_surfaces(body, -1), *owned]


def _refrigerator(fridge: list[Link], index: int) -> tuple[list[TrueObject], list[Surface]]:
    front = np.concatenate([door.vertices for door in fridge[1:]])
    whole = np.concatenate([front, *(mesh.vertices for mesh in fridge[0].meshes)])
    thing = _thing("fridge_0", "fridge_freezer", whole, front, fridge[1:])
    return [thing], [surface for link in fridge for surface in _surfaces(link, index)]


def _cupboard(doors: list[Link], index: int) -> tuple[list[TrueObject], list[Surface]]:
    """Each door with its half of a box of boards behind it."""
    things, surfaces = [], []
    for number, (door, side) in enumerate(zip(doors, (-1, 1), strict=True)):
        front = door.vertices
        low, high = front.min(axis=0), front.max(axis=0)
        start = high[1]
        outer = low[0] if side < 0 else high[0]
        upright = ([outer - _BOARD_M * (side > 0), start, low[2]], [outer + _BOARD_M * (side < 0), 0.0, high[2]])
        top = ([low[0], start, high[2] - _BOARD_M], [high[0], 0.0, high[2]])
        things.append(_thing(f"cupboard_{number}", "tall_cabinet", _reaching(front, 0.0), front, [door]))
        surfaces += _surfaces(door, index + number)
        surfaces += [_board(*ends, index + number) for ends in (upright, top)]
    return things, surfaces


def _board(low: list[float], high: list[float], thing: int) -> Surface:
    vertices, faces = box_mesh(np.array(low), np.array(high))
    return Surface(vertices=vertices, faces=faces, colour=_WOOD, thing=thing)


def _reaching(front: np.ndarray, back: float) -> np.ndarray:
    """The front's vertices, extended backwards to y = `back`."""
    return np.concatenate([front, np.column_stack([front[:, 0], np.full(len(front), back), front[:, 2]])])


def _thing(name: str, category: str, whole: np.ndarray, front: np.ndarray, movers: list[Link]) -> TrueObject:
    size, pose = box_of(whole, front, 0.0)
    joints = tuple(_joint(f"{name}_{link.name}", link, pose) for link in movers)
    return TrueObject(name=name, category=category, dimensions_m=size, kitchen_from_object=pose, joints=joints)


def _joint(name: str, link: Link, pose: Rigid3) -> TrueJoint:
    axis, limit = link.joint.find("axis"), link.joint.find("limit")
    assert axis is not None
    assert limit is not None
    world_axis = link.place.turn(_numbers(axis.attrib["xyz"]))
    limits = (float(limit.attrib["lower"]), float(limit.attrib["upper"]))
    return joint_of(name, link.joint.attrib["type"], world_axis, link.place.translation, limits, pose)


def _surfaces(link: Link, thing: int) -> list[Surface]:
    return [_surface(mesh, thing) for mesh in link.meshes]


def _surface(mesh: trimesh.Trimesh, thing: int) -> Surface:
    material, uv = mesh.visual.material, mesh.visual.uv
    image, factor = getattr(material, "baseColorTexture", None), getattr(material, "baseColorFactor", None)
    colour = np.ones(3) if factor is None else (np.asarray(factor[:3]) / 255.0) ** 2.2
    textured = image is not None and uv is not None
    return Surface(
        vertices=np.asarray(mesh.vertices),
        faces=np.asarray(mesh.faces),
        colour=colour,
        texture=np.asarray(image.convert("RGB")) if textured else None,
        uv=np.column_stack([uv[:, 0], 1 - uv[:, 1]])[mesh.faces] if textured else None,
        thing=thing,
    )


if __name__ == "__main__":
    main()
