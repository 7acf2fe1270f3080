"""The leaves of one object as they were filmed: the motions they were seen to make, found once, and where they stand open."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category, Opening
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.segment.motion.hypotheses import Way, moved
from r2c2r_core.segment.motion.leaf import Leaf, OpenLeaf
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
            self._filmed = tuple(
                (leaf, find_motion(leaf, self.scene, dict.fromkeys(ways, usual), part, only=bool(part)))
                for part, leaf, ways in _leaves(self.whole, self.category)
            )
        return self._filmed


def _state(motion: JointMotion, frame_index: int) -> float:
    state = motion.states.get(frame_index)
    return 0.0 if state is None or state.value is None else state.value


def _opened(leaf: Leaf, motion: JointMotion, state: float) -> OpenLeaf:
    assert motion.axis_world is not None  # what is fixed is never open
    assert motion.pivot_world is not None
    opening = moved(motion.axis_world, motion.pivot_world, motion.kind == "revolute", state)
    outward = abs(float(motion.axis_world @ leaf.outward)) > np.sqrt(0.5)
    way: Literal["hinge", "out", "along"] = "hinge" if motion.kind == "revolute" else "out" if outward else "along"
    return OpenLeaf(leaf=leaf, world_from_leaf=opening @ leaf.world_from_front, way=way)


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
