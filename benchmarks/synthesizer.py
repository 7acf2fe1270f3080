"""Converter of a kitchen of NVIDIA's scene_synthesizer (1.15) into a phone recording with ground truth.

    python benchmarks/synthesizer.py OUT [--frames 120] [--size 640x480] [--seed 0]

Layout, units, appliances, doors and handles are `kitchen_single_wall` of that package (Apache-2.0); it has no materials, so
colours are drawn here. Doors and drawers are objects of their own, appliances are one each.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import shapely
import trimesh
from worlds import Surface, World, box_of, film, joint_of, room

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.truth import TrueJoint, TrueObject

_TYPES = ("revolute", "prismatic")
_APPLIANCES = ("dishwasher", "range", "refrigerator", "range_hood")
_CATEGORIES = {"range_hood": "hood"}
_FRONTS = ((0.72, 0.71, 0.66), (0.05, 0.05, 0.055), (0.34, 0.2, 0.1), (0.2, 0.3, 0.26), (0.62, 0.55, 0.42))
_TOPS = ((0.04, 0.04, 0.04), (0.55, 0.52, 0.48), (0.3, 0.2, 0.12), (0.7, 0.7, 0.7))
_STEEL, _WHITE, _BLACK, _SPLASH = (0.42, 0.43, 0.45), (0.75, 0.75, 0.76), (0.03, 0.03, 0.035), (0.66, 0.64, 0.6)


class Piece(NamedTuple):
    """One mesh in the world, by the link and the unit that it belongs to."""

    name: str
    unit: str
    link: str
    mesh: trimesh.Trimesh


def main() -> None:
    """Draw the recording."""
    parser = argparse.ArgumentParser(description="A kitchen of scene_synthesizer as a recording.")
    film(parser, lambda options: kitchen(options.seed))


def kitchen(seed: int) -> World:
    """The kitchen, closed, its back to one wall of a plain room."""
    scene = _drawn(seed)
    pieces = list(_pieces(scene))
    moved = {link: joint for link, joint in _joints(scene).items() if joint[0] in _TYPES}
    things = list(_things(pieces, moved))
    owner = {each.name: number for number, each in enumerate(things)}
    rng = np.random.default_rng([seed, 5])
    colours = {
        "front": _FRONTS[rng.integers(len(_FRONTS))],
        "top": _TOPS[rng.integers(len(_TOPS))],
        "machine": (_STEEL, _WHITE, _BLACK)[rng.integers(3)],
    }
    surfaces = [
        Surface(
            vertices=np.asarray(each.mesh.vertices),
            faces=np.asarray(each.mesh.faces),
            colour=np.array(_colour(each, colours)),
            gloss=0.25 if each.unit in _APPLIANCES else 0.08,
            thing=owner.get(each.unit, owner.get(_name_of(each.link), -1)),
        )
        for each in pieces
    ]
    bounds = np.array([each.mesh.bounds for each in pieces])
    (left, _, _), (right, back, _) = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    low, high = (left - 0.7, back - 4.3, 0.0), (right + 0.7, back, 2.6)
    places = np.linspace(left + 0.5, right - 0.5, 7)
    out = np.array([*places, *places[-2::-1]])
    ahead = np.concatenate([np.full(7, 0.25), np.full(6, -0.25)])
    heights = np.array([1.5, 1.3, 1.45, 1.25, 1.5, 1.35, 1.4, 1.0, 1.2, 1.0, 1.3, 1.5, 1.4])
    away = back - np.array([2.5, 2.1, 2.4, 2.2, 2.5, 2.2, 2.6, 2.0, 2.2, 1.9, 2.1, 2.0, 2.4])
    looks = np.array([0.9, 0.5, 1.2, 0.5, 1.1, 0.6, 0.9, 0.4, 0.5, 0.4, 1.5, 1.6, 0.9])
    return World(
        surfaces=(*surfaces, *room(low, high, _SPLASH, (0.33, 0.28, 0.22))),
        things=tuple(things),
        eyes=np.column_stack([out, away, heights]),
        targets=np.column_stack([out + ahead, np.full(13, back - 0.5), looks]),
        lights=np.array([[left + 0.8, back - 2.0, 2.5], [right - 0.8, back - 2.3, 2.5]]),
    )


def _drawn(seed: int) -> Any:
    """The package's scene; manifold replaces the triangulator it asks for, whose licence forbids commercial use."""
    from scene_synthesizer import procedural_scenes  # takes seconds

    with_engine = trimesh.creation.triangulate_polygon
    trimesh.creation.triangulate_polygon = lambda polygon, **_: with_engine(shapely.force_2d(polygon), engine="manifold")
    try:
        return procedural_scenes.kitchen_single_wall(seed=seed)
    finally:
        trimesh.creation.triangulate_polygon = with_engine


def _pieces(scene: Any) -> Iterator[Piece]:
    """Visible meshes; the racks of ovens and dishwashers are behind their doors and left out."""
    graph = scene.scene.graph
    for name in graph.nodes_geometry:
        if "_collision" in name or "basket" in name or "/shelf_" in name:
            continue
        place, geometry = graph.get(name)
        mesh = scene.scene.geometry[geometry].copy()
        mesh.apply_transform(place)
        yield Piece(name, name.split("/")[0], str(graph.transforms.parents[name]), mesh)


def _joints(scene: Any) -> dict[str, tuple[str, np.ndarray, np.ndarray, tuple[float, float]]]:
    """Joint type, axis, origin and limits by child link, in the world."""
    found = {}
    for (_, child), edge in scene.scene.graph.transforms.edge_data.items():
        joint = (edge.get("metadata") or {}).get("joint")
        if joint is not None and joint["type"] in _TYPES:
            place = scene.scene.graph.get(child)[0]
            limits = (float(joint["limit_lower"]), float(joint["limit_upper"]))
            found[child] = (joint["type"], place[:3, :3] @ np.asarray(joint["axis"], float), place[:3, 3], limits)
    return found


def _things(pieces: list[Piece], joints: dict[str, Any]) -> Iterator[TrueObject]:
    """Doors and drawers of furniture with the unit behind them, and whole appliances."""
    for unit in dict.fromkeys(each.unit for each in pieces):
        own = [each for each in pieces if each.unit == unit and "handle" not in each.name]
        whole = np.concatenate([each.mesh.vertices for each in own])
        links = [link for link in dict.fromkeys(each.link for each in own) if link in joints]
        if unit in _APPLIANCES:
            category = "fridge_freezer" if unit == "refrigerator" and len(links) == 2 else _CATEGORIES.get(unit, unit)
            yield _thing(unit, category, whole, whole, [(link, joints[link]) for link in links])
            continue
        for link in links:
            front = np.concatenate([e.mesh.vertices for e in own if e.link == link and _is_front(e)])
            behind = np.column_stack([front[:, 0], np.full(len(front), whole[:, 1].max()), front[:, 2]])
            category = "drawer" if joints[link][0] == "prismatic" else "wall_cabinet" if unit.startswith("wall") else "cabinet"
            yield _thing(_name_of(link), category, np.concatenate([front, behind]), front, [(link, joints[link])])


def _is_front(piece: Piece) -> bool:
    """Whether a mesh of a leaf is its front, not the box of a drawer."""
    return "_board_" not in piece.name or piece.name.endswith("_board_0")


def _thing(name: str, category: str, whole: np.ndarray, front: np.ndarray, moved: list[tuple[str, Any]]) -> TrueObject:
    size, pose = box_of(whole, front, 0.0)
    return TrueObject(
        name=name,
        category=category,
        dimensions_m=size,
        kitchen_from_object=pose,
        joints=tuple(_joint(link, joint, pose) for link, joint in moved),
    )


def _joint(link: str, joint: tuple[str, np.ndarray, np.ndarray, tuple[float, float]], pose: Rigid3) -> TrueJoint:
    kind, axis, origin, limits = joint
    made = joint_of(_name_of(link), kind, axis, origin, limits, pose)
    hangs = kind == "revolute" and abs(axis[2]) < 0.5
    return replace(made, hinge="bottom" if pose.inverse.apply(origin)[2] < 0 else "top") if hangs else made


def _name_of(link: str) -> str:
    return link.replace("/", "_")


def _colour(piece: Piece, colours: dict[str, tuple[float, float, float]]) -> tuple[float, float, float]:
    if "handle" in piece.name or "knob" in piece.name or piece.name.endswith("/sink"):
        return _STEEL
    if "countertop" in piece.name:
        return colours["top"]
    if "window" in piece.name or "heater" in piece.name:
        return _BLACK
    return colours["machine"] if piece.unit in _APPLIANCES else colours["front"]


if __name__ == "__main__":
    main()
