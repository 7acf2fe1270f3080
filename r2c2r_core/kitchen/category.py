"""Fields of the category table: names, sizes, expected position, joints and material of a kind of object."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.materials import UNKNOWN_THING, Material
from r2c2r_core.model.motion import Movement
from r2c2r_core.tuning import param, tuned

Kind = Literal["front", "appliance", "thing"]
"""How it is detected: a panel among lines, a box behind a front, or the part of the scan that stands on a support."""

Opening = Literal["drawer", "side", "pair", "bottom", "sideways", "fixed", "rigid"]
"""How it opens: slides out, one side-hinged door, two doors, a bottom-hinged door, slides along its front, not at all; or it is
a free-standing object."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned size tolerances."""

    slack: float = param(
        0.1, "log", "Tolerance of a segmented size outside the range sold: a seam or a shadow on either side", gt=0
    )
    range_sigmas: float = param(
        4.0,
        "σ",
        "Number of standard deviations between the smallest and the largest size sold",
        source="19 of 20 sizes lie between them if the logarithm is normally distributed",
        gt=0,
    )


@dataclass(frozen=True, slots=True)
class Size:
    """One dimension of a kind: minimum, usual and maximum in metres, with the source."""

    low: float
    usual: float
    high: float
    source: str

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of the size."""
        return float(np.log(self.high / self.low)) / tuned(Params).range_sigmas

    def holds(self, value_m: float) -> bool:
        """Whether a size is possible."""
        return self.low <= value_m <= self.high

    def allows(self, values_m: float | np.ndarray) -> np.ndarray:
        """Mask of the sizes within the range sold, extended by the slack of a segmented size."""
        slack = np.exp(tuned(Params).slack)
        return np.asarray((values_m >= self.low / slack) & (values_m <= self.high * slack))

    def deviation(self, value_m: float | np.ndarray) -> np.ndarray:
        """Deviation of sizes from the usual one, in standard deviations of their logarithm."""
        return np.asarray(np.log(np.asarray(value_m) / self.usual) / self.spread)

    def log_likelihood(self, value_m: float) -> float:
        """Log density of a size, up to a constant: log-normal."""
        return float(-(self.deviation(value_m) ** 2) / 2 - np.log(self.spread))

    def fit(self, value_m: float) -> float:
        """1 for a possible size, falling smoothly to 0 over about a fifth of it outside."""
        outside = max(float(np.log(self.low / value_m)), float(np.log(value_m / self.high)), 0.0)
        return float(np.exp(-((outside / tuned(Params).slack) ** 2)))


@dataclass(frozen=True, slots=True)
class Place:
    """Expected position of a kind that is proposed without a click: heights above the floor, and frequency."""

    bottom_m: tuple[float, float]  # lower edge: minimum and maximum
    top_m: float  # upper edge: maximum
    per_kitchen: float
    source: str

    def holds(self, bottom_m: float) -> bool:
        """Whether an object may begin at this height; a floor is level to a centimetre only."""
        return self.bottom_m[0] <= max(bottom_m, 0.0) <= self.bottom_m[1]

    def fit(self, bottom_m: float, top_m: float) -> float:
        """1 for an object at these heights, falling smoothly to 0 over about a fifth of them beyond."""
        bounds = ((self.bottom_m[0], bottom_m), (bottom_m, self.bottom_m[1]), (top_m, self.top_m))  # each below the next
        beyond = max(float(np.log(max(low, 0.01) / max(high, 0.01))) for low, high in bounds)
        return float(np.exp(-((max(beyond, 0.0) / tuned(Params).slack) ** 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Category:
    """A kind of object: names, sizes, joints and material. One row of the category table."""

    name: str  # words joined by underscores
    aliases: tuple[str, ...] = ()
    kind: Kind
    opens: Opening
    width: Size  # across the front; the larger side of a free object
    depth: Size  # from the outer face of the front to the back
    height: Size
    material: Material = UNKNOWN_THING
    fixture: str | None = None  # its builder: "module" or "module:NAME" of synthesize/fixtures or of a plug-in
    hinge: HingeSide | None = None  # default side of a single door's hinge, or towards which a sliding door goes
    hinge_share: float = 0.5  # fraction sold with the hinge on that side, always below 1
    no_front: bool = False  # an appliance of several faces, such as a hood's slopes and chimney
    one_front: bool = False  # a machine, or a stack: one front, regardless of the lines on it
    several_fronts: bool = False  # several fronts are one object, separated by their handles
    stands: bool = False  # rests on a support; a wall cabinet and a built-in front do not
    on_floor: bool = False
    round: bool = False  # a body of revolution
    open_vessel: bool = False  # hollow and open upwards
    on_legs: bool = False  # a level slab on posts
    flat_top: bool = False  # that slab is its highest part: anything above stands on it
    dark: bool = False  # its front is dark glass
    flap: bool = False  # hinged at its upper edge if it is wider than high with its handle at the lower edge
    place: Place | None = None  # where it is proposed; None: it is never proposed
    beside_panel: bool = False  # its door leaves room for a control panel
    over_drawer: str | None = None  # its fixture if a drawer was filmed below its doors
    wider: tuple[float, str] | None = None  # from this width (metres) on it is that category

    @property
    def names(self) -> tuple[str, ...]:
        """Its name and aliases."""
        return self.name, *self.aliases

    @property
    def label(self) -> str:
        """Its name in readable form."""
        return self.name.replace("_", " ")

    @property
    def may_be_pair(self) -> bool:
        """Whether two doors side by side may be one object."""
        return self.opens == "pair" or self.wider is not None

    @property
    def motion(self) -> Movement:
        """Motion of its front."""
        moves: dict[Opening, Movement] = {"drawer": "out", "sideways": "along", "fixed": "none", "rigid": "none"}
        return moves.get(self.opens, "hinge")

    @property
    def handle_lies(self) -> bool:
        """Whether a bar handle is usually horizontal, as on drawers and flaps; on side-hinged doors it is vertical."""
        return self.opens in ("drawer", "bottom")

    @property
    def longest_m(self) -> float:
        """Largest possible side."""
        return max(self.width.high, self.depth.high, self.height.high)

    @property
    def usual_m(self) -> tuple[float, float, float]:
        """Usual width, depth and height."""
        return self.width.usual, self.depth.usual, self.height.usual
