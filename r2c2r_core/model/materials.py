"""Masses, friction and joint resistance: every physical number with its source.

For whole appliances and objects the weight is known, not a density: an effective density converts a fixture's panels, or an
object's colliders, into a weight within that range. Values without a published table are marked as own estimates or own
choices.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Density of the panels of a fixture, or of the colliders of an object."""

    density_kg_m3: float
    source: str
    weight_kg: tuple[float, float] | None = None  # minimum and maximum of a usual complete one; None: a material, not an object


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFeel:
    """Resistance and strength of a joint (units: rad or m, N m or N)."""

    damping: float
    friction: float
    effort: float
    velocity: float
    source: str


_BOARD = "ANSI A208.1 grade M particleboard, 640-800 kg/m3; European melamine-faced boards of 16-19 mm lie at 600-720"

CHIPBOARD = Material(density_kg_m3=680.0, source=_BOARD)
WORKTOP = Material(density_kg_m3=700.0, source=f"{_BOARD}; a laminate on either side")
REFRIGERATOR = Material(
    density_kg_m3=340.0,
    source="sellers' tables: 50-150 kg, one door and no side-by-side 50-100 kg; steel skin, foam and compressor shared out",
    weight_kg=(50.0, 100.0),
)
OVEN = Material(
    density_kg_m3=540.0,
    source="own estimate: built-in ovens 0.6 m wide weigh 28-40 kg; sheet steel, wool and glass shared out",
    weight_kg=(28.0, 40.0),
)
DISHWASHER = Material(
    density_kg_m3=480.0,
    source="sellers' tables: built-in dishwashers 27-45 kg; tub, motor and racks shared out",
    weight_kg=(27.0, 45.0),
)
MICROWAVE = Material(
    density_kg_m3=850.0,
    source="sellers' tables: countertop microwaves 9-23 kg; sheet steel, transformer and magnetron shared out",
    weight_kg=(9.0, 23.0),
)
HOOD = Material(
    density_kg_m3=150.0,
    source="own estimate: wall hoods 0.6 m wide weigh 8-16 kg; sheet steel round a fan, over the whole box",
    weight_kg=(8.0, 16.0),
)

WASHING_MACHINE = Material(
    density_kg_m3=210.0,
    source="sellers' tables: front loaders for 7-9 kg of laundry 55-85 kg, ballast included; over the whole box",
    weight_kg=(55.0, 85.0),
)

_STONEWARE = "own estimate: stoneware and porcelain weigh 2.0-2.4 g/cm3"

BOTTLE = Material(
    density_kg_m3=950.0,
    source="own estimate: 0.25-1.5 l of water or oil (0.92-1.0 kg/l) and 20-500 g of bottle",
    weight_kg=(0.2, 2.2),
)
CAN = Material(density_kg_m3=1000.0, source="own estimate: filled cans of 0.33-0.85 l", weight_kg=(0.3, 1.0))
MUG = Material(density_kg_m3=2000.0, source=f"{_STONEWARE}; mugs of 0.25-0.4 l 250-450 g", weight_kg=(0.2, 0.5))
CUP = Material(density_kg_m3=2000.0, source=f"{_STONEWARE}; cups 120-350 g", weight_kg=(0.12, 0.35))
BOWL = Material(density_kg_m3=2000.0, source=f"{_STONEWARE}; bowls of 14-25 cm 300-1200 g", weight_kg=(0.2, 1.2))
PLATE = Material(density_kg_m3=2000.0, source=f"{_STONEWARE}; plates of 18-28 cm 300-900 g", weight_kg=(0.2, 0.9))
BOX = Material(density_kg_m3=350.0, source="own choice: filled cartons, flour 600 and cereal 120 kg/m3", weight_kg=(0.05, 12.0))
CHAIR = Material(
    density_kg_m3=120.0,
    source="own estimate: wooden kitchen chairs weigh 4-8 kg; over the hulls of its parts, air between them",
    weight_kg=(3.5, 8.0),
)
TOASTER = Material(density_kg_m3=300.0, source="own estimate: two-slice toasters 1-2 kg", weight_kg=(0.9, 2.5))
KETTLE = Material(density_kg_m3=400.0, source="own estimate: kettles of 1-1.7 l 0.8-1.5 kg, empty", weight_kg=(0.7, 3.0))
UNKNOWN_THING = Material(density_kg_m3=400.0, source="own choice: household things lie between 100 and 1000 kg/m3")

_OPENED = "own choice, opened by one hand with less than the 22.2 N of 2010 ADA Standards 309.4"
_RELEASED = "enough to come to rest: lids without were measured to slam at 6.9 rad/s (Articraft, pull request 81)"

HINGE_FEEL = JointFeel(damping=0.3, friction=0.15, effort=30.0, velocity=3.0, source=f"{_OPENED}; {_RELEASED}")
SLIDE_FEEL = JointFeel(damping=8.0, friction=1.5, effort=80.0, velocity=1.0, source=f"{_OPENED}; {_RELEASED}")
HEAVY_DOOR_FEEL = JointFeel(damping=0.8, friction=0.4, effort=40.0, velocity=3.0, source=f"{_OPENED}, seals; {_RELEASED}")

SURFACE_FRICTION = 0.5
"""Friction of every surface; dry wood on wood 0.25-0.5 and laminate 0.2-0.4 in tables. A gripper has its own: MuJoCo takes
the larger of two, PhysX their mean."""

ARMATURE = {"revolute": 0.005, "prismatic": 0.02}
"""kg m^2 and kg added to a joint for solver stability: own choice, under 2 % of a cabinet door's or a drawer's own."""
