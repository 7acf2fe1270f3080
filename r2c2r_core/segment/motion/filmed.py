"""Leaves of one object in the recording: their observed motions, estimated once, and their poses where they stand open."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import DOOR, DRAWER, JointMotion
from r2c2r_core.segment.motion.hypotheses import USUAL_WAYS, Way
from r2c2r_core.segment.motion.inside import Params as InsideParams
from r2c2r_core.segment.motion.inside import front_thickness, measure_inside
from r2c2r_core.segment.motion.leaf import Leaf, OpenLeaf
from r2c2r_core.segment.motion.leaf import Params as LeafParams
from r2c2r_core.segment.motion.track import find_motion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of a category's joint prior and of open leaves."""

    usual: float = param(
        8.0,
        "log",
        "Log prior odds of the category's own way of opening",
        source="few frames overrule it: each carries up to 80",
    )
    beyond_m: float = param(0.05, "m", "Maximum excess of a unit's depth over the expected one: usual depths differ by as much")


@dataclass(slots=True, eq=False)
class FilmedLeaves:
    """The moving leaves of an object. Motions are estimated on first use."""

    whole: Leaf
    category: Category
    scene: Scene
    depth_m: float  # of its unit: to the wall behind it, or the usual depth of its category
    seams_m: tuple[float, ...] = ()  # heights in the front frame at which a drawer below its doors may end, likeliest first
    panels_m: tuple[float, ...] = ()  # places across it at which its door may end, beside a control panel, likeliest first
    _filmed: tuple[tuple[Leaf, JointMotion | None], ...] | None = field(default=None, init=False, repr=False)

    @property
    def motions(self) -> tuple[JointMotion, ...]:
        """Motions of the leaves that were observed to move."""
        return tuple(motion for _, motion in self._all() if motion is not None)

    def open_in(self, frame_index: int) -> tuple[OpenLeaf, ...]:
        """Leaves that stand open in a frame."""
        return tuple(
            _opened(leaf, motion, state)
            for leaf, motion in self._all()
            if motion is not None and (state := motion.state_in(frame_index))
        )

    def closed_in(self, frame_index: int) -> tuple[Leaf, ...]:
        """Leaves that are closed in a frame."""
        return tuple(leaf for leaf, motion in self._all() if motion is None or not motion.state_in(frame_index))

    def _all(self) -> tuple[tuple[Leaf, JointMotion | None], ...]:
        if self._filmed is None:
            found = (
                self._over_drawer()
                or self._beside_panel()
                or [self._looked_for(*leaf) for leaf in _leaves(self.whole, self.category)]
            )
            self._filmed = tuple(
                (leaf, motion and _with_inside(leaf, motion, self.scene, self.depth_m)) for leaf, motion in found
            )
        return self._filmed

    def _over_drawer(self) -> list[tuple[Leaf, JointMotion | None]]:
        """A drawer observed to move below its doors, and those doors; none where nothing below a seam was drawn out."""
        for seam_m in self.seams_m:
            half_w, half_h = self.whole.half_m
            below, above = (self.whole.part((-half_w, half_w), ends) for ends in ((-half_h, seam_m), (seam_m, half_h)))
            drawer = self._looked_for(DRAWER, below, USUAL_WAYS["drawer"])
            if drawer[1] is not None:
                return [
                    drawer,
                    *(self._looked_for(part or DOOR, leaf, ways) for part, leaf, ways in _leaves(above, self.category)),
                ]
        return []

    def _beside_panel(self) -> list[tuple[Leaf, JointMotion | None]]:
        """A door observed to move beside a control panel; none where no part of the front up to a seam moved."""
        half_w, half_h = self.whole.half_m
        for x in self.panels_m:
            ends = (-half_w, x) if x > 0 else (x, half_w)
            door = self._looked_for("", self.whole.part(ends, (-half_h, half_h)), ("left",) if x > 0 else ("right",))
            if door[1] is not None:
                return [door]
        return []

    def _looked_for(self, part: str, leaf: Leaf, ways: tuple[Way, ...]) -> tuple[Leaf, JointMotion | None]:
        """Leaf with its motion, which is estimated again where its edge shows a thickness that the motion did not.

        A motion that shows both faces tells a thin door's thickness better than its edge; a drawer's tells nothing of it.
        """
        usual = dict.fromkeys(ways, tuned(Params).usual)
        moved_leaf, motion = find_motion(leaf, self.scene, usual, part, only=bool(part))
        edge_m = None if motion is None else front_thickness(moved_leaf, _places(moved_leaf, motion), self.scene)
        if edge_m is None or _is_known(moved_leaf, edge_m):
            return moved_leaf, motion
        return find_motion(replace(leaf, thickness_m=edge_m), self.scene, usual, part, only=bool(part))


def _is_known(leaf: Leaf, edge_m: float) -> bool:
    """Whether a leaf's thickness need not be corrected to that of its edge."""
    sigma_m = leaf.sigma_thickness_m
    is_sure = sigma_m <= tuned(LeafParams).sigma_thickness_m
    return bool(np.isclose(edge_m, leaf.thickness_m)) or (is_sure and edge_m < leaf.thickness_m + 3 * sigma_m)


def _with_inside(leaf: Leaf, motion: JointMotion, scene: Scene, depth_m: float) -> JointMotion:
    """Motion with the inside measured behind the leaf, from frames where it is open far enough to see behind it."""
    params, places = tuned(Params), _places(leaf, motion)
    drawn_out = motion.movement(leaf.outward) == "out"
    inside = measure_inside(
        leaf,
        places if drawn_out else lambda frame: leaf.world_from_front if places(frame) is not None else None,
        scene,
        drawn_out_m=motion.largest if drawn_out else 0.0,
        deepest_m=depth_m + params.beyond_m,
    )
    return replace(motion, inside=inside)


def _places(leaf: Leaf, motion: JointMotion) -> Callable[[Frame], Rigid3 | None]:
    """Pose function (world_from_leaf) for frames in which a leaf is open far enough to see behind it; None in others."""
    params = tuned(InsideParams)
    ajar = params.ajar_rad if motion.kind == "revolute" else params.ajar_m

    def place(frame: Frame) -> Rigid3 | None:
        state = motion.state_in(frame.index)
        return _opened(leaf, motion, state).leaf.world_from_front if state >= ajar else None

    return place


def _opened(leaf: Leaf, motion: JointMotion, state: float) -> OpenLeaf:
    depth_m = None if motion.inside is None else motion.inside.depth_m
    rear_m = None if depth_m is None else depth_m + leaf.thickness_m
    moved_leaf = replace(leaf, world_from_front=motion.opening(state) @ leaf.world_from_front)
    return OpenLeaf(leaf=moved_leaf, movement=motion.movement(leaf.outward), out_m=state, rear_m=rear_m)


def _leaves(whole: Leaf, category: Category) -> list[tuple[str, Leaf, tuple[Way, ...]]]:
    """Name, closed rectangle and usual ways of each leaf: the two halves of a pair, else the whole front."""
    if category.opens in ("fixed", "rigid") or category.several_fronts:  # only handles show where one of several fronts ends
        return []
    if category.opens != "pair":
        return [("", whole, USUAL_WAYS[category.opens])]
    half_w, half_h = whole.half_m
    left, right = (whole.part(ends, (-half_h, half_h)) for ends in ((-half_w, 0.0), (0.0, half_w)))
    return [("left", left, ("left",)), ("right", right, ("right",))]
