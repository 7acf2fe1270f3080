"""The leaves of one object as they were filmed: the motions they were seen to make, found once, and where they stand open."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category, Opening
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.segment.motion.hypotheses import Way, moved
from r2c2r_core.segment.motion.inside import measure_inside
from r2c2r_core.segment.motion.leaf import Leaf, OpenLeaf
from r2c2r_core.segment.motion.leaf import Params as LeafParams
from r2c2r_core.segment.motion.track import find_motion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What a category says of a joint before any frame."""

    usual: float = param(
        8.0,
        "log",
        "by which a category's own way of opening is likelier",
        source="few frames overrule it: each is worth up to 80",
    )
    ajar_rad: float = param(float(np.deg2rad(25.0)), "rad", "that a door stands open, from where one sees behind it")
    ajar_m: float = param(0.08, "m", "that what slides stands open, from where one sees behind it")


_USUAL: Mapping[Opening, tuple[Way, ...]] = {
    "drawer": ("out",),
    "side": ("left", "right"),
    "bottom": ("bottom",),
    "sideways": ("slides_left", "slides_right"),
}


@dataclass(slots=True, eq=False)
class FilmedLeaves:
    """What moves of an object. Its motions are looked for when they are first asked for."""

    whole: Leaf
    category: Category
    scene: Scene
    _filmed: tuple[tuple[Leaf, JointMotion | None], ...] | None = field(default=None, init=False, repr=False)

    @property
    def motions(self) -> tuple[JointMotion, ...]:
        """One of each leaf that was seen to move."""
        return tuple(motion for _, motion in self._all() if motion is not None)

    def open_in(self, frame_index: int) -> tuple[OpenLeaf, ...]:
        """Its leaves that stand open in a frame."""
        return tuple(
            _opened(leaf, motion, state)
            for leaf, motion in self._all()
            if motion is not None and (state := _state(motion, frame_index))
        )

    def closed_in(self, frame_index: int) -> tuple[Leaf, ...]:
        """Its leaves that stand in their place."""
        return tuple(leaf for leaf, motion in self._all() if motion is None or not _state(motion, frame_index))

    def _all(self) -> tuple[tuple[Leaf, JointMotion | None], ...]:
        if self._filmed is None:
            usual = tuned(Params).usual
            found = [
                (leaf, find_motion(leaf, self.scene, dict.fromkeys(ways, usual), part, only=bool(part)))
                for part, leaf, ways in _leaves(self.whole, self.category)
            ]
            self._filmed = tuple((leaf, motion and _with_inside(leaf, motion, self.scene)) for leaf, motion in found)
        return self._filmed


def _state(motion: JointMotion, frame_index: int) -> float:
    state = motion.states.get(frame_index)
    return 0.0 if state is None or state.value is None else state.value


def _with_inside(leaf: Leaf, motion: JointMotion, scene: Scene) -> JointMotion:
    """The motion with what the frames show behind the leaf, where it stands open far enough to be looked behind."""
    params = tuned(Params)
    ajar = params.ajar_rad if motion.kind == "revolute" else params.ajar_m
    drawn_out = _way(motion, leaf) == "out"

    def place(frame: Frame) -> Rigid3 | None:
        state = _state(motion, frame.index)
        if state < ajar:
            return None
        return _opened(leaf, motion, state).world_from_leaf if drawn_out else leaf.world_from_front

    return replace(motion, inside=measure_inside(leaf, place, scene, drawn_out_m=motion.largest if drawn_out else 0.0))


def _way(motion: JointMotion, leaf: Leaf) -> Literal["hinge", "out", "along"]:
    assert motion.axis_world is not None  # what is fixed is never open
    if motion.kind == "revolute":
        return "hinge"
    return "out" if abs(float(motion.axis_world @ leaf.outward)) > np.sqrt(0.5) else "along"


def _opened(leaf: Leaf, motion: JointMotion, state: float) -> OpenLeaf:
    assert motion.axis_world is not None  # what is fixed is never open
    assert motion.pivot_world is not None
    opening = moved(motion.axis_world, motion.pivot_world, motion.kind == "revolute", state)
    depth_m = None if motion.inside is None else motion.inside.depth_m
    rear_m = None if depth_m is None else depth_m + tuned(LeafParams).thickness_m
    return OpenLeaf(leaf=leaf, world_from_leaf=opening @ leaf.world_from_front, way=_way(motion, leaf), rear_m=rear_m)


def _leaves(whole: Leaf, category: Category) -> list[tuple[str, Leaf, tuple[Way, ...]]]:
    """Name, closed rectangle and usual ways of each leaf: of a pair two halves, else the front."""
    if category.opens in ("fixed", "rigid") or category.several_fronts:  # of which only handles tell where one ends
        return []
    if category.opens != "pair":
        return [("", whole, _USUAL[category.opens])]
    half = whole.width_m / 2
    return [("left", _part(whole, -half / 2, half), ("left",)), ("right", _part(whole, half / 2, half), ("right",))]


def _part(whole: Leaf, x_m: float, width_m: float) -> Leaf:
    """The part of a front about x_m from its middle."""
    place = whole.world_from_front @ Rigid3(np.eye(3), np.array([x_m, 0.0, 0.0]))
    return Leaf(world_from_front=place, width_m=width_m, height_m=whole.height_m)
