"""Ground truth of a sample in the capture frame: boxes, joints, clicks, and the axes that the camera could observe."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics, unproject
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.synthetic.kitchen import Appliance, Fixed, Furniture, Hinge, Kitchen, Leaf, Run
from r2c2r_core.synthetic.render import View

_BINS = 16  # slices of an axis
_MIN_SHARE = 0.002  # a slice counts as observed when this fraction of all pixels showed it
_SAMPLE_STEP = 3
_FEWEST_PX = 12
_CLICKED_OPEN = 0.3  # probability of a click on an open front, if it was filmed open
_Click = tuple[float, int, float, float]  # clarity of the view, frame, x, y


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueJoint:
    """One joint in the kitchen frame; 0 is closed, positive opens by the right-hand rule."""

    name: str
    type: str
    axis: np.ndarray
    origin: np.ndarray
    lower: float
    upper: float
    hinge: str | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueObject:
    """One prompted object; its box excludes the handle."""

    name: str
    category: str
    dimensions_m: np.ndarray  # width, depth, height
    kitchen_from_object: Rigid3
    joints: tuple[TrueJoint, ...]
    is_round: bool = False  # about its vertical axis: its yaw is undefined


def true_objects(kitchen: Kitchen) -> tuple[TrueObject, ...]:
    """All prompted objects, in the order of `kitchen.object_names`."""
    furniture = [_furniture(f, run) for run in kitchen.runs for f in run.base]
    furniture += [_furniture(f, run) for run in kitchen.runs for f in run.upper]
    furniture += [_fixed(each, run) for run in kitchen.runs for each in run.fixed]
    machines = [_appliance(each) for each in (kitchen.fridge, kitchen.microwave) if each is not None]
    bottles = [
        TrueObject(
            name=b.name,
            category="bottle",
            dimensions_m=np.array([2 * b.radius_m, 2 * b.radius_m, b.height_m]),
            kitchen_from_object=Rigid3(np.eye(3), np.array([b.x, b.y, kitchen.worktop_top_m + b.height_m / 2])),
            joints=(),
            is_round=True,
        )
        for b in kitchen.bottles
        if b.prompted
    ]
    return (*furniture, *machines, *bottles)


def capture_from_kitchen(kitchen: Kitchen, first_eye: np.ndarray) -> Rigid3:
    """ARKit's world: +Y up, its origin at the start of the recording, its heading arbitrary."""
    y_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    rotation = y_up @ rotation_about_z(kitchen.yaw_rad)
    return Rigid3(rotation, -rotation @ first_eye)


class Sightings:
    """Observed extents and possible clicks of every object, accumulated frame by frame.

    `moved` has the frames in which a front of an object is not closed: they do not count for its extents.
    """

    def __init__(self, objects: tuple[TrueObject, ...], moved: Mapping[str, frozenset[int]] = MappingProxyType({})) -> None:
        self._objects = objects
        self._moved = moved
        self._bins = np.zeros((len(objects), 3, _BINS), np.int64)
        self._clicks: list[list[_Click]] = [[] for _ in objects]
        self._open_clicks: list[list[_Click]] = [[] for _ in objects]

    def add(
        self,
        frame: int,
        view: View,
        ids: np.ndarray,
        is_handle: np.ndarray,
        is_front: np.ndarray,
        camera: Intrinsics,
        kitchen_from_camera: Rigid3,
        rng: np.random.Generator,
    ) -> None:
        """Add one frame; `ids` (h, w) are instance ids, the others mark the pixels of handles and of fronts."""
        v, u = np.mgrid[_SAMPLE_STEP // 2 : camera.height : _SAMPLE_STEP, _SAMPLE_STEP // 2 : camera.width : _SAMPLE_STEP]
        seen, body = ids[v, u], ~is_handle[v, u]
        for index, thing in enumerate(self._objects):
            if frame in self._moved.get(thing.name, ()):
                self._propose_click(self._open_clicks[index], frame, (ids == index + 1) & is_front, is_handle, rng)
                continue
            chosen = (seen == index + 1) & body
            if np.count_nonzero(chosen) < _FEWEST_PX:
                continue
            uv = np.column_stack([u[chosen], v[chosen]]) + 0.5
            points = kitchen_from_camera.apply(unproject(uv, view.depth_m[v[chosen], u[chosen]].astype(float), camera))
            share = thing.kitchen_from_object.inverse.apply(points) / thing.dimensions_m + 0.5
            for axis in range(3):
                within = share[(share[:, axis] > -0.02) & (share[:, axis] < 1.02), axis]
                place = np.clip((within * _BINS).astype(int), 0, _BINS - 1)
                self._bins[index, axis] += np.bincount(place, minlength=_BINS)
            self._propose_click(self._clicks[index], frame, ids == index + 1, is_handle, rng)

    def observed_axes(self, index: int) -> list[bool]:
        """Whether the object's width, depth and height were observed from end to end: in all of 16 slices but at most one."""
        bins = self._bins[index]
        enough = np.maximum(_MIN_SHARE * bins.sum(axis=1, keepdims=True), 1)
        return [bool(seen[0] and seen[-1] and seen.sum() >= _BINS - 1) for seen in bins >= enough]

    def click(self, index: int, rng: np.random.Generator) -> tuple[int, float, float] | None:
        """A frame and pixel where a person might click the object: one of the ten clearest views, sometimes of it open."""
        clicks, ajar = self._clicks[index], self._open_clicks[index]
        if ajar and rng.random() < _CLICKED_OPEN:
            clicks = ajar
        ranked = sorted(clicks, reverse=True)[:10]
        if not ranked:
            return None
        _, frame, x, y = ranked[int(rng.integers(len(ranked)))]
        return frame, x, y

    def _propose_click(
        self, clicks: list[_Click], frame: int, mask: np.ndarray, is_handle: np.ndarray, rng: np.random.Generator
    ) -> None:
        if np.count_nonzero(mask) < _FEWEST_PX:
            return
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        top, bottom, left, right = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
        border = top == 0 or left == 0 or bottom == mask.shape[0] or right == mask.shape[1]
        handle = cv2.dilate(is_handle[top:bottom, left:right].astype(np.uint8), np.ones((5, 5), np.uint8))
        inner = (mask[top:bottom, left:right] & (handle == 0)).astype(np.uint8)
        distance = cv2.distanceTransform(np.pad(inner, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        rows, columns = np.nonzero(distance > 0.45 * distance.max())
        if len(rows) == 0 or distance.max() < 2:
            return
        pick = int(rng.integers(len(rows)))
        score = float(np.count_nonzero(mask)) * (0.05 if border else 1.0)
        clicks.append((score, frame, left + float(columns[pick]) + 0.5, top + float(rows[pick]) + 0.5))


def truth_document(
    objects: tuple[TrueObject, ...],
    capture_from_kitchen: Rigid3,
    sightings: Sightings,
    motions: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
) -> dict[str, object]:
    """Content of truth.json; `motions` adds entries to a joint, by its name, where fronts are opened."""
    entries = []
    for index, thing in enumerate(objects):
        joints = [{**_joint_entry(joint, capture_from_kitchen), **motions.get(joint.name, {})} for joint in thing.joints]
        hinges = {joint.hinge for joint in thing.joints}
        entries.append(
            {
                "name": thing.name,
                "category": thing.category,
                "dimensions_m": [float(v) for v in thing.dimensions_m],
                "capture_from_object": (capture_from_kitchen @ thing.kitchen_from_object).matrix.tolist(),
                "joint": joints[0] if joints else None,
                "joints": joints,
                "hinge": hinges.pop() if len(hinges) == 1 else None,
                "symmetry": "axial" if thing.is_round else None,
                "observed_axes": sightings.observed_axes(index),
                "opened": [joint.name for joint in thing.joints if any(motions.get(joint.name, {}).get("states", ()))] or None,
            }
        )
    return {"version": 1, "objects": entries}


def prompts_document(objects: tuple[TrueObject, ...], sightings: Sightings, rng: np.random.Generator) -> dict[str, object]:
    """Content of prompts.json: one click for every visible object."""
    entries = []
    for index, thing in enumerate(objects):
        click = sightings.click(index, rng)
        if click is not None:
            point = {"frame": click[0], "x": click[1], "y": click[2], "label": 1}
            entries.append({"name": thing.name, "category": thing.category, "points": [point]})
    return {"version": 1, "objects": entries}


def _furniture(furniture: Furniture, run: Run) -> TrueObject:
    first, last = furniture.leaves[0], furniture.leaves[-1]
    width, height = last.x + last.width_m - first.x, first.height_m
    centre = np.array([first.x + width / 2, -furniture.depth_m / 2, first.z + height / 2])
    joints = tuple(_posed(_leaf_joint(furniture, leaf), run.kitchen_from_run) for leaf in furniture.leaves)
    return TrueObject(
        name=furniture.name,
        category=furniture.category,
        dimensions_m=np.array([width, furniture.depth_m, height]),
        kitchen_from_object=run.kitchen_from_run @ Rigid3(np.eye(3), centre),
        joints=joints,
    )


def _fixed(thing: Fixed, run: Run) -> TrueObject:
    low, high = np.array(thing.low), np.array(thing.high)
    return TrueObject(
        name=thing.name,
        category=thing.category,
        dimensions_m=high - low,
        kitchen_from_object=run.kitchen_from_run @ Rigid3(np.eye(3), (low + high) / 2),
        joints=(),
    )


def _posed(joint: TrueJoint, kitchen_from_run: Rigid3) -> TrueJoint:
    axis, origin = kitchen_from_run.turn(joint.axis), kitchen_from_run.apply(joint.origin)
    return replace(joint, axis=axis, origin=origin)


def _leaf_joint(furniture: Furniture, leaf: Leaf) -> TrueJoint:
    """Joint of a leaf, in the frame of its run."""
    middle_z, face = leaf.z + leaf.height_m / 2, -furniture.depth_m
    centre = np.array([leaf.x + leaf.width_m / 2, face, middle_z])
    if leaf.slides is not None:
        origin, axis, kind = centre, np.array([1.0 if leaf.slides == "right" else -1.0, 0.0, 0.0]), "prismatic"
    elif leaf.hinge is None:
        origin, axis, kind = centre, np.array([0.0, -1.0, 0.0]), "prismatic"
    elif leaf.hinge == "bottom":
        origin, axis, kind = np.array([centre[0], face, leaf.z]), np.array([1.0, 0.0, 0.0]), "revolute"
    elif leaf.hinge == "top":
        origin, axis, kind = np.array([centre[0], face, leaf.z + leaf.height_m]), np.array([-1.0, 0.0, 0.0]), "revolute"
    else:
        # A door hinged on the left turns its free edge towards -Y: negative about +Z.
        edge = leaf.x if leaf.hinge == "left" else leaf.x + leaf.width_m
        origin, axis, kind = (
            np.array([edge, face, middle_z]),
            np.array([0.0, 0.0, -1.0 if leaf.hinge == "left" else 1.0]),
            "revolute",
        )
    return TrueJoint(
        name=furniture.joint_name(leaf),
        type=kind,
        axis=axis,
        origin=origin,
        lower=0.0,
        upper=leaf.open_limit,
        hinge=leaf.hinge,
    )


def _appliance(thing: Appliance) -> TrueObject:
    _, depth, height = thing.size_m
    pose = Rigid3(rotation_about_z(thing.yaw_rad), np.array(thing.centre))
    hinges: tuple[Hinge, ...] = ("left", "right") if thing.drawer_m else (thing.hinge,)
    joints = [_swinging(thing, pose, hinge, name) for hinge, name in zip(hinges, thing.fronts, strict=False)]
    if thing.drawer_m:
        face = pose.apply(np.array([0.0, -depth / 2, (thing.drawer_m - height) / 2]))
        out = pose.turn(np.array([0.0, -1.0, 0.0]))
        joints.append(
            TrueJoint(name=thing.fronts[-1], type="prismatic", axis=out, origin=face, lower=0.0, upper=0.6 * depth, hinge=None)
        )
    return TrueObject(
        name=thing.name,
        category=thing.category,
        dimensions_m=np.array(thing.size_m),
        kitchen_from_object=pose,
        joints=tuple(joints),
    )


def _swinging(thing: Appliance, pose: Rigid3, hinge: Hinge, name: str) -> TrueJoint:
    width, depth, _ = thing.size_m
    edge = -width / 2 if hinge == "left" else width / 2
    return TrueJoint(
        name=name,
        type="revolute",
        axis=np.array([0.0, 0.0, -1.0 if hinge == "left" else 1.0]),
        origin=pose.apply(np.array([edge, -depth / 2, thing.drawer_m / 2])),
        lower=0.0,
        upper=thing.open_limit,
        hinge=hinge,
    )


def _joint_entry(joint: TrueJoint, capture_from_kitchen: Rigid3) -> dict[str, object]:
    return {
        "name": joint.name,
        "type": joint.type,
        "axis": capture_from_kitchen.turn(joint.axis).tolist(),
        "origin": capture_from_kitchen.apply(joint.origin).tolist(),
        "lower": joint.lower,
        "upper": joint.upper,
        "hinge": joint.hinge,
    }
