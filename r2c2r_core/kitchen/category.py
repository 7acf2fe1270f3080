"""What a line of the category table says of a kind of object."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.materials import UNKNOWN_THING, Material
from r2c2r_core.tuning import param, tuned

Kind = Literal["front", "appliance", "thing"]
"""How it is looked for: a panel among lines, a box behind a front, or the part of the scan that stands on something."""

Opening = Literal["drawer", "side", "pair", "bottom", "sideways", "fixed", "rigid"]
"""How it opens: slides out, one side-hinged door, two doors, a bottom-hinged door, slides along its front, not at all; or it is
a loose thing."""

Way = Literal["hinge", "out", "along", "none"]
"""What a front does: it turns about an edge, is drawn out, slides along itself, or stays."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How strictly sizes are judged."""

    slack: float = param(0.1, "log", "by which what was cut may miss what is sold: a seam or a shadow on either side", gt=0)
    range_sigmas: float = param(
        4.0,
        "σ",
        "from the least to the greatest size that is sold",
        source="19 of 20 lie between them where the logarithm is normal",
        gt=0,
    )


@dataclass(frozen=True, slots=True)
class Size:
    """One measure of a kind: the least, the usual and the greatest in metres, and who says so."""

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

    def deviation(self, value_m: float | np.ndarray) -> np.ndarray:
        """How far sizes are from the usual one, in standard deviations of their logarithm."""
        return np.asarray(np.log(np.asarray(value_m) / self.usual) / self.spread)

    def log_likelihood(self, value_m: float) -> float:
        """Log density of a size, up to a constant: its logarithm is normal."""
        return float(-(self.deviation(value_m) ** 2) / 2 - np.log(self.spread))

    def fit(self, value_m: float) -> float:
        """1 for a possible size, falling smoothly to 0 over about a fifth of it outside."""
        outside = max(float(np.log(self.low / value_m)), float(np.log(value_m / self.high)), 0.0)
        return float(np.exp(-((outside / tuned(Params).slack) ** 2)))


@dataclass(frozen=True, slots=True)
class Place:
    """Where a kind is found that is proposed without a click: at which heights above the floor, and how often."""

    bottom_m: tuple[float, float]  # its lower edge: least and greatest
    top_m: float  # its upper edge: greatest
    per_kitchen: float
    source: str

    def holds(self, bottom_m: float) -> bool:
        """Whether something may begin at this height; a floor is level to a centimetre only."""
        return self.bottom_m[0] <= max(bottom_m, 0.0) <= self.bottom_m[1]

    def fit(self, bottom_m: float, top_m: float) -> float:
        """1 for what lies at these heights, falling smoothly to 0 over about a fifth of them beyond."""
        bounds = ((self.bottom_m[0], bottom_m), (bottom_m, self.bottom_m[1]), (top_m, self.top_m))  # each below the next
        beyond = max(float(np.log(max(low, 0.01) / max(high, 0.01))) for low, high in bounds)
        return float(np.exp(-((max(beyond, 0.0) / tuned(Params).slack) ** 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Category:
    """A kind of object: what it is called, how large it is, how it opens and what it is made of. One line of one table."""

    name: str  # words joined by underscores
    aliases: tuple[str, ...] = ()
    kind: Kind
    opens: Opening
    width: Size  # across the front; the larger side of a thing
    depth: Size  # from the outer face of the front to the back
    height: Size
    material: Material = UNKNOWN_THING
    fixture: str | None = None  # what builds it: "module" or "module:NAME" of synthesize/fixtures or of a plug-in
    hinge: HingeSide | None = None  # of a single door, where nothing tells; one that slides sideways goes there
    hinge_share: float = 0.5  # of those sold that are hinged there; some are not, so below 1
    one_front: bool = False  # a machine, or a stack: one front whatever lines it carries
    several_fronts: bool = False  # that are one object, told apart by their handles
    stands: bool = False  # rests on what is below it; a wall cabinet and a built-in front do not
    on_floor: bool = False
    round: bool = False  # a body of revolution
    open_vessel: bool = False  # hollow and open upwards
    on_legs: bool = False  # a level slab on posts
    flat_top: bool = False  # that slab is its highest part: what rises above stands on it
    dark: bool = False  # its front is dark glass
    flap: bool = False  # hung on its upper edge where it is wider than high and gripped at its lower edge
    place: Place | None = None  # where it is proposed; None: never
    over_drawer: str | None = None  # the fixture that builds it where a drawer was filmed below its doors
    wider: tuple[float, str] | None = None  # from this width (metres) on it is that category

    @property
    def names(self) -> tuple[str, ...]:
        """Its name and what else people call it."""
        return self.name, *self.aliases

    @property
    def label(self) -> str:
        """Its name as people read it."""
        return self.name.replace("_", " ")

    @property
    def may_be_pair(self) -> bool:
        """Whether two doors side by side may be one object."""
        return self.opens == "pair" or self.wider is not None

    @property
    def motion(self) -> Way:
        """How its front moves."""
        moves: dict[Opening, Way] = {"drawer": "out", "sideways": "along", "fixed": "none", "rigid": "none"}
        return moves.get(self.opens, "hinge")

    @property
    def handle_lies(self) -> bool:
        """Whether a bar on its front is usually level, as on what is pulled out or down; on side-hung doors it is upright."""
        return self.opens in ("drawer", "bottom")

    @property
    def longest_m(self) -> float:
        """The largest side it can have."""
        return max(self.width.high, self.depth.high, self.height.high)

    @property
    def usual_m(self) -> tuple[float, float, float]:
        """Usual width, depth and height."""
        return self.width.usual, self.depth.usual, self.height.usual
