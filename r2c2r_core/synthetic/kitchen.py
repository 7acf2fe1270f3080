"""Plan of a kitchen: sizes, positions, hinge sides and looks, before anything is built.

Kitchen frame: metres, +Z up, floor z = 0, back wall at y = 0, fronts face -Y, +X to the right of a person facing them.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z

Hinge = Literal["left", "right", "bottom", "top"]
Way = Literal["left", "right"]
HandleKind = Literal["bar", "flat", "bow", "knob", "cup", "finger"]
Filling = Literal["panel", "glass", "frosted"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Paint:
    """A surface's look; `kind` names its painter in textures.py, colours are linear RGB 0..1."""

    kind: str
    colour: tuple[float, float, float]
    accent: tuple[float, float, float] = (0.5, 0.5, 0.5)
    texel_m: float = 0.0016
    gloss: float = 0.0  # 0 matt .. 1 mirror-like
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Handle:
    """A handle on a front; lengths in metres."""

    kind: HandleKind
    length_m: float
    thickness_m: float
    reach_m: float  # protrusion from the front
    vertical: bool
    x: float  # its centre, from the front's left edge
    z: float  # its centre, from the front's bottom edge


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """Four rails around the filling of a front: a recessed panel, clear glass, or frosted glass."""

    rail_m: float
    recess_m: float
    filling: Filling = "panel"


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaf:
    """One moving front panel, in the frame of its run."""

    x: float  # left edge
    z: float  # bottom edge
    width_m: float
    height_m: float
    hinge: Hinge | None  # None: it slides
    handle: Handle | None
    open_limit: float  # rad, or metres where it slides
    slides: Way | None = None  # along the run; without it, and without a hinge, it is a drawer
    frame: Frame | None = None  # None: a slab
    look: Paint | None = None  # paint of an appliance's front; None: as its run's fronts


@dataclass(frozen=True, slots=True, kw_only=True)
class Furniture:
    """A prompted built-in object: one front, or the two of a double door."""

    name: str
    category: str
    leaves: tuple[Leaf, ...]
    depth_m: float  # from the outer face of the front to the back
    shows_left_side: bool = False
    shows_right_side: bool = False

    def joint_name(self, leaf: Leaf) -> str:
        """Name of the joint that moves one of its leaves."""
        return f"{self.name}_joint{f'_{leaf.hinge}' if len(self.leaves) > 1 else ''}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Carcass:
    """The box behind one or more fronts."""

    x: float
    z: float
    width_m: float
    height_m: float
    depth_m: float  # without the front panel
    glazed: bool = False  # open behind panes, with shelves of crockery


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A fixed background part: a face frame, a channel, a filler, an end panel."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    paint: Paint


@dataclass(frozen=True, slots=True, kw_only=True)
class Fixed:
    """A prompted object of a run without joints, as a box: an open shelf, a hood."""

    name: str
    category: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Appliance:
    """A free-standing box with one hinged door, or with two of them over a drawer (french doors)."""

    name: str
    category: str
    centre: tuple[float, float, float]
    size_m: tuple[float, float, float]  # width, depth, height, without the handle
    yaw_rad: float
    hinge: Hinge
    handle: Handle
    drawer_m: float = 0.0  # height of a freezer drawer under two doors; 0: one door over the whole front
    door_thickness_m: float
    door_width_m: float  # narrower than the appliance where a control panel stands beside it
    open_limit: float
    body: Paint
    door: Paint

    @property
    def fronts(self) -> tuple[str, ...]:
        """Names of its joints: of its door; or of the left door, the right one, and the drawer under them."""
        return tuple(f"{self.name}_joint{part}" for part in (("_left", "_right", "_drawer") if self.drawer_m else ("",)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Bottle:
    """A bottle standing on the worktop."""

    name: str
    x: float
    y: float
    radius_m: float
    height_m: float
    neck_radius_m: float
    shoulder: float  # where the neck begins, 0..1 of the height
    glass: Paint
    label: Paint
    cap: Paint
    prompted: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Prop:
    """An unprompted object at (x, y): a sink, a hob, a kettle, a shelf …"""

    kind: str
    x: float
    y: float
    width_m: float
    paint: Paint
    z: float = 0.0  # above the worktop


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Units in a row. Its frame: x along it, the back at y = 0, fronts facing -Y, z up from the floor.

    The first run's frame is the kitchen's.
    """

    base: tuple[Furniture, ...]
    upper: tuple[Furniture, ...]
    base_carcasses: tuple[Carcass, ...]
    upper_carcasses: tuple[Carcass, ...]
    ends: tuple[float, float]  # x of the worktop's ends
    fixed: tuple[Fixed, ...] = ()
    boards: tuple[Board, ...] = ()
    props: tuple[Prop, ...] = ()
    place: tuple[float, float] = (0.0, 0.0)  # of its origin in the kitchen
    yaw_rad: float = 0.0
    has_wall: bool = True  # behind it, with a splashback

    @property
    def kitchen_from_run(self) -> Rigid3:
        """Pose of the run."""
        return Rigid3(rotation_about_z(self.yaw_rad), np.array([*self.place, 0.0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Paints and dimensions common to all units of one kitchen."""

    base_front: Paint
    wall_front: Paint
    carcass: Paint
    plinth: Paint
    worktop: Paint
    splash: Paint
    wall: Paint
    floor: Paint
    handle: Paint
    gap_m: float
    front_thickness_m: float
    daylight: float  # share of the light that comes through the window


@dataclass(frozen=True, slots=True, kw_only=True)
class Kitchen:
    """Complete plan for the builder."""

    style: Style
    runs: tuple[Run, ...]  # the first stands along the back wall
    plinth_m: float
    worktop_top_m: float
    worktop_thickness_m: float
    base_depth_m: float  # outer face of the fronts to the wall
    upper_depth_m: float
    fridge: Appliance
    microwave: Appliance | None  # on the worktop
    bottles: tuple[Bottle, ...]
    room: tuple[float, float, float, float, float]  # x_min, x_max, y_min, y_max, ceiling
    window_on_left: bool
    yaw_rad: float  # of the kitchen in the capture frame

    @property
    def base(self) -> tuple[Furniture, ...]:
        """The prompted units under the worktops."""
        return tuple(unit for run in self.runs for unit in run.base)

    @property
    def upper(self) -> tuple[Furniture, ...]:
        """The prompted units on the walls."""
        return tuple(unit for run in self.runs for unit in run.upper)

    @property
    def object_names(self) -> tuple[str, ...]:
        """The prompted objects; instance ids are 1 + their position."""
        furniture = [f.name for f in (*self.base, *self.upper)]
        fixed = [thing.name for run in self.runs for thing in run.fixed]
        bottles = [b.name for b in self.bottles if b.prompted]
        machines = [self.fridge.name, *([self.microwave.name] if self.microwave is not None else [])]
        return (*furniture, *fixed, *machines, *bottles)
