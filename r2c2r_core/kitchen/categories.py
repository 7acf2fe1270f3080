"""Category table: every kind of object that the pipeline knows.

A new kind is a line here and, where it is built in a new way, a file in synthesize/fixtures that its line names. Sizes are
those of the front or of the whole object without handles, as sellers or standards of such objects state them.
"""

from functools import partial

from r2c2r_core.kitchen.category import Category, Place, Size
from r2c2r_core.model import materials
from r2c2r_core.plugins import added

_EN_1116 = "EN 1116:2018: modules of 100 mm, 600 mm deep with the worktop, working heights of 850 and 900 mm"
_US_STOCK = "US stock units (thespruce.com, Standard Dimensions for Kitchen Cabinets): 12-48 in wide, 24 in deep, 34.5 in high"
_UNITS = f"{_EN_1116}; {_US_STOCK}"
_CARCASSES = "European lists: carcasses 28, 35, 46, 56, 60 and 73 cm deep behind a front of 2 cm"
_WALL_UNITS = "European lists 30-37 cm, US stock 12-13 in deep and 12-42 in high; over a refrigerator up to 24 in"
_FRIDGES = "makers: free-standing models 0.54-0.70 m wide, doors in; US top freezers 28-36 in, side-by-sides to 37 x 72 x 33 in"
_PAIRED = f"{_FRIDGES}; pairs sold as one to 1.21 m"
_MICROWAVES = "countertop models of 17-32 l: 19 x 10.5 in on average, 0.43-0.55 m; over the range 30 x 14-18 x 15-17 in"
_OVENS = "EN 1116 niches of 560 and 600 mm for fronts of 455 and 595 mm; ranges 0.5-0.9 m, US 30 x 36 x 25 in"
_DISHWASHERS = "EN 1116 niches of 450 and 600 mm, 820-870 mm high with the plinth; US 24 x 35 x 24 in"
_LAUNDRY = "makers: front loaders 0.595-0.60 x 0.845-0.85 x 0.40-0.65 m; US 27 x 39 x 34 in"
_HOODS = "makers: 0.5-1.2 m wide, flat visors 5 cm to chimneys of 1 m high"
_BOARDS = "European lists: fronts of 16-22 mm, fillers of 2-10 cm, plinths of 6-20 cm; US toe kicks 4.5 in high"
_WORKTOPS = "EN 1116 worktops 600 mm and deeper, lists of 0.6-1.2 m; boards of 12-60 mm"
_SHELVES = "furniture sold as wall shelves and bookcases: 0.2-1.2 m wide, 0.15-0.6 m deep"
_SLIDING = "makers: 0.3-1.5 m wide, before carcasses of wall units to wardrobes of 2.6 m"
_OWN = "own estimate of household things as sold"

DEPTHS_SOLD_M = (0.30, 0.37, 0.48, 0.58, 0.62, 0.75)
"""Depths of cabinets with their fronts: most makers list carcasses of 28, 35, 46, 56, 60 and 73 cm."""

_OFTEN = "how often: own estimate of a fitted kitchen of some fifteen fronts"


def _below_worktop(per_kitchen: float) -> Place:
    return Place((0.0, 0.85), 0.95, per_kitchen, f"EN 1116: working heights of 850 and 900 mm, more for tall people; {_OFTEN}")


def _hung(per_kitchen: float) -> Place:
    return Place(
        (1.15, 2.3), 2.6, per_kitchen, f"worktops end at 0.95 m, and nothing hangs closer above them than this; {_OFTEN}"
    )


_BASE_DEPTH = Size(0.28, 0.58, 0.80, f"{_CARCASSES}; 61-63 cm in US stock units")
_BASE_HEIGHT = Size(0.35, 0.72, 0.92, f"{_UNITS}, less a plinth of 10-15 cm")
_DOOR_WIDTH = Size(0.20, 0.60, 0.95, f"{_UNITS}; doors end at 0.6 m, two of them unparted at 0.95 m")
_PAIR_WIDTH = Size(0.45, 0.80, 1.25, _UNITS)
_WALL_DEPTH = Size(0.20, 0.35, 0.62, _WALL_UNITS)
_WALL_HEIGHT = Size(0.28, 0.70, 1.10, _WALL_UNITS)
_FRIDGE_DEPTH = Size(0.45, 0.65, 0.90, _FRIDGES)
_FRIDGE_HEIGHT = Size(0.75, 1.78, 2.20, _FRIDGES)


def _thing(
    name: str,
    width: tuple[float, float, float],
    height: tuple[float, float, float],
    *aliases: str,
    material: materials.Material = materials.UNKNOWN_THING,
    round: bool = False,
    open_vessel: bool = False,
    on_floor: bool = False,
    on_legs: bool = False,
    flat_top: bool = False,
    place: Place | None = None,
) -> Category:
    """A free-standing object, as deep as wide."""
    across = Size(*width, _OWN)
    return Category(
        name=name,
        aliases=aliases,
        kind="thing",
        opens="rigid",
        width=across,
        depth=across,
        height=Size(*height, _OWN),
        material=material,
        stands=True,
        on_floor=on_floor,
        round=round,
        open_vessel=open_vessel,
        on_legs=on_legs,
        flat_top=flat_top,
        place=place,
    )


_base_unit = partial(Category, kind="front", depth=_BASE_DEPTH, height=_BASE_HEIGHT, material=materials.CHIPBOARD)
_wall_unit = partial(Category, kind="front", depth=_WALL_DEPTH, height=_WALL_HEIGHT, material=materials.CHIPBOARD)
_machine = partial(Category, kind="front", one_front=True)  # a machine shows one front, regardless of the lines on it
_appliance = partial(Category, kind="appliance", stands=True)

_FRONTS = (
    Category(
        name="drawer",
        aliases=("drawer_front", "pull_out", "pull_out_drawer"),
        kind="front",
        opens="drawer",
        fixture="drawer",
        width=Size(0.20, 0.60, 1.25, _UNITS),
        depth=_BASE_DEPTH,
        height=Size(0.08, 0.20, 0.45, f"{_BASE_HEIGHT.source}, in two to five rows"),
        material=materials.CHIPBOARD,
        place=_below_worktop(5.0),
    ),
    _base_unit(
        name="drawer_stack",
        aliases=("drawers", "chest_of_drawers", "drawer_unit", "drawer_cabinet", "stack_of_drawers", "drawer_chest"),
        opens="drawer",
        fixture="drawer_stack",
        one_front=True,
        several_fronts=True,
        width=Size(0.25, 0.60, 1.25, _UNITS),
    ),
    _base_unit(
        name="cabinet",
        aliases=("door", "cabinet_door", "cupboard", "base_cabinet", "base_unit", "floor_cabinet", "single_door_cabinet"),
        opens="side",
        hinge="left",
        fixture="cabinet",
        width=_DOOR_WIDTH,
        place=_below_worktop(4.0),
    ),
    Category(
        name="tall_cabinet",
        aliases=("pantry", "pantry_cabinet", "tall_unit", "high_cabinet", "broom_cabinet", "larder_cabinet"),
        kind="front",
        opens="side",
        hinge="left",
        fixture="cabinet",
        width=_DOOR_WIDTH,
        depth=_BASE_DEPTH,
        height=Size(0.92, 2.0, 2.4, "European lists: 1.4, 2.0 and 2.2 m; US stock 84, 90 and 96 in"),
        material=materials.CHIPBOARD,
    ),
    _base_unit(
        name="double_door_cabinet",
        aliases=("double_door", "double_cabinet", "two_door_cabinet", "cabinet_double", "double_base_cabinet"),
        opens="pair",
        fixture="double_door_cabinet",
        width=_PAIR_WIDTH,
        place=_below_worktop(1.0),
    ),
    Category(
        name="sliding_door",
        aliases=(
            *("sliding_cabinet_door", "sliding_cabinet", "sliding_wardrobe_door", "sliding_closet_door", "sliding_front"),
            *("sliding_leaf", "lateral_sliding_door"),
        ),
        kind="front",
        opens="sideways",
        hinge="right",
        fixture="sliding_door",
        width=Size(0.30, 0.62, 1.5, _SLIDING),
        depth=Size(0.20, 0.58, 0.80, f"{_CARCASSES}; {_WALL_UNITS}"),
        height=Size(0.28, 0.75, 2.6, f"{_SLIDING}; base units the most"),
        material=materials.CHIPBOARD,
    ),
    _wall_unit(
        name="wall_cabinet",
        aliases=(
            *("upper_cabinet", "wall_unit", "upper", "hanging_cabinet", "overhead_cabinet", "top_cabinet"),
            *("wall_cupboard", "upper_cupboard", "hanging_cupboard"),
        ),
        opens="side",
        hinge="left",
        fixture="wall_cabinet",
        width=Size(0.20, 0.60, 1.0, _UNITS),
        flap=True,
        place=_hung(4.0),
    ),
    _wall_unit(
        name="double_door_wall_cabinet",
        aliases=("double_wall_cabinet", "two_door_wall_cabinet", "double_upper_cabinet", "double_door_upper_cabinet"),
        opens="pair",
        fixture="double_door_cabinet:HANGING",
        width=_PAIR_WIDTH,
        place=_hung(1.0),
    ),
    _base_unit(
        name="sink_cabinet",
        aliases=("sink", "sink_unit", "sink_base", "sink_base_cabinet"),
        opens="side",
        hinge="left",
        fixture="sink_cabinet",
        wider=(0.65, "double_sink_cabinet"),  # European lists hang one door on sink units up to 0.6 m wide
        width=Size(0.40, 0.60, 1.25, _UNITS),
    ),
    _base_unit(
        name="double_sink_cabinet",
        aliases=("two_door_sink_cabinet", "double_door_sink_cabinet", "double_sink"),
        opens="pair",
        fixture="sink_cabinet:DOUBLE",
        width=_PAIR_WIDTH,
    ),
    _machine(
        name="oven",
        aliases=("wall_oven", "built_in_oven", "baking_oven"),
        opens="bottom",
        hinge="bottom",
        fixture="oven",
        width=Size(0.42, 0.60, 0.95, _OVENS),
        depth=Size(0.40, 0.58, 0.80, f"{_OVENS}; {_CARCASSES}"),
        height=Size(
            0.38, 0.68, 0.95, f"{_OVENS}; the middle between a front of 0.595 m and a range's, for people call both so"
        ),
        material=materials.OVEN,
        dark=True,
        place=_below_worktop(0.5),
    ),
    _machine(
        name="range",
        aliases=("stove", "cooker", "kitchen_range", "range_cooker", "gas_stove", "electric_stove"),
        opens="bottom",
        hinge="bottom",
        fixture="oven",
        width=Size(0.42, 0.60, 1.0, _OVENS),
        depth=Size(0.40, 0.62, 0.80, _OVENS),
        height=Size(0.38, 0.72, 0.95, f"{_OVENS}; its front begins over the plinth or a drawer"),
        material=materials.OVEN,
    ),
    _machine(
        name="dishwasher",
        opens="bottom",
        hinge="bottom",
        fixture="dishwasher",
        width=Size(0.38, 0.60, 0.68, _DISHWASHERS),
        depth=Size(0.40, 0.58, 0.80, _DISHWASHERS),
        height=Size(0.50, 0.74, 0.92, f"{_DISHWASHERS}; its door alone 0.65-0.78 m"),
        material=materials.DISHWASHER,
        place=_below_worktop(0.5),
    ),
    _machine(
        name="washing_machine",
        aliases=("washer", "clothes_washer", "tumble_dryer", "clothes_dryer", "dryer", "washer_dryer"),
        opens="fixed",
        fixture="solid",
        width=Size(0.50, 0.60, 0.75, _LAUNDRY),
        depth=Size(0.40, 0.60, 0.88, _LAUNDRY),
        height=Size(0.65, 0.85, 1.0, _LAUNDRY),
        material=materials.WASHING_MACHINE,
    ),
    Category(
        name="fixed_panel",
        aliases=("panel", "filler", "end_panel", "blind_front", "plinth", "toe_kick", "kickboard"),
        kind="front",
        opens="fixed",
        fixture="solid",
        width=Size(0.02, 0.60, 3.0, _BOARDS),
        depth=Size(0.006, 0.018, 0.06, f"{_BOARDS}; what lies behind it is not its own"),
        height=Size(0.05, 0.72, 2.4, _BOARDS),
        material=materials.CHIPBOARD,
    ),
)
_APPLIANCES = (
    _appliance(
        name="refrigerator",
        aliases=("fridge", "single_door_refrigerator", "single_door_fridge"),
        opens="side",
        hinge="right",
        fixture="refrigerator",
        over_drawer="refrigerator_drawer",
        wider=(0.8, "side_by_side_refrigerator"),  # single doors end at 0.7 m, side-by-side models begin at 0.83 m
        width=Size(0.42, 0.60, 1.25, _PAIRED),
        depth=_FRIDGE_DEPTH,
        height=_FRIDGE_HEIGHT,
        material=materials.REFRIGERATOR,
        place=Place((0.0, 0.5), 2.4, 1.0, f"on the floor, a plinth or a drawer; {_OFTEN}"),
    ),
    _appliance(
        name="side_by_side_refrigerator",
        aliases=(
            *("french_door_refrigerator", "double_door_refrigerator", "american_fridge", "side_by_side_fridge"),
            *("french_door_fridge", "double_door_fridge", "american_refrigerator"),
        ),
        opens="pair",
        fixture="refrigerator:SIDE_BY_SIDE",
        over_drawer="refrigerator_drawer:PAIR",
        width=Size(0.60, 0.91, 1.25, _PAIRED),
        depth=Size(0.45, 0.70, 0.95, _FRIDGES),
        height=_FRIDGE_HEIGHT,
        material=materials.REFRIGERATOR,
    ),
    _appliance(
        name="fridge_freezer",
        aliases=(
            *("two_door_refrigerator", "two_door_fridge", "refrigerator_freezer", "top_freezer_refrigerator", "combi_fridge"),
            *("bottom_freezer_refrigerator", "fridge_freezer_combination"),
        ),
        opens="side",
        hinge="right",
        fixture="fridge_freezer",
        several_fronts=True,
        width=Size(0.42, 0.60, 0.95, _FRIDGES),
        depth=_FRIDGE_DEPTH,
        height=_FRIDGE_HEIGHT,
        material=materials.REFRIGERATOR,
    ),
    _appliance(
        name="freezer",
        aliases=("upright_freezer", "deep_freezer"),
        opens="side",
        hinge="right",
        fixture="refrigerator",
        width=Size(0.42, 0.60, 0.95, _FRIDGES),
        depth=Size(0.45, 0.62, 0.95, _FRIDGES),
        height=Size(0.75, 1.40, 2.20, _FRIDGES),
        material=materials.REFRIGERATOR,
    ),
    _appliance(
        name="microwave",
        aliases=("microwave_oven", "countertop_microwave"),
        opens="side",
        hinge="left",
        hinge_share=0.98,  # keypad and latch are on the right of all but a few of them
        fixture="microwave",
        beside_panel=True,
        width=Size(0.36, 0.49, 0.77, _MICROWAVES),
        depth=Size(0.25, 0.38, 0.50, f"{_MICROWAVES}; 0.30-0.48 m deep: a wall behind it may be farther"),
        height=Size(0.21, 0.28, 0.46, _MICROWAVES),
        material=materials.MICROWAVE,
        dark=True,
        place=Place((0.7, 1.5), 2.0, 0.5, f"on worktops, shelves and in tall units; {_OFTEN}"),
    ),
    Category(
        name="hood",
        aliases=("range_hood", "extractor", "cooker_hood", "extractor_hood", "extractor_fan", "vent_hood"),
        kind="appliance",
        opens="fixed",
        fixture="solid",
        width=Size(0.40, 0.60, 1.25, _HOODS),
        depth=Size(0.25, 0.45, 0.70, _HOODS),
        height=Size(0.05, 0.30, 1.0, _HOODS),
        no_front=True,
        material=materials.HOOD,
    ),
)
_FIXED = (
    Category(
        name="counter",
        aliases=("countertop", "worktop"),
        kind="thing",
        opens="fixed",
        fixture="solid",
        flat_top=True,
        width=Size(0.3, 1.2, 4.0, _WORKTOPS),
        depth=Size(0.1, 0.62, 1.6, _WORKTOPS),
        height=Size(0.01, 0.04, 0.12, _WORKTOPS),
        material=materials.WORKTOP,
    ),
    Category(
        name="open_shelf",
        aliases=("shelf", "bookcase", "bookshelf", "wall_shelf", "rack", "open_cabinet", "shelving_unit"),
        kind="thing",
        opens="fixed",
        fixture="open_shelf",
        width=Size(0.2, 0.60, 1.2, _SHELVES),
        depth=Size(0.1, 0.30, 0.70, _SHELVES),
        height=Size(0.015, 0.70, 1.2, f"{_SHELVES}; a higher one is clicked in parts"),
        material=materials.CHIPBOARD,
    ),
)
_ON_WORKTOP = Place((0.3, 2.0), 2.3, 2.0, f"worktops, tables and shelves; {_OFTEN}")
_ON_FLOOR = Place((0.0, 0.15), 1.2, 1.0, f"their own heights; {_OFTEN}")
_THINGS = (
    _thing("object", (0.02, 0.10, 0.4), (0.02, 0.20, 0.4), "thing", "rigid"),
    _thing(
        *("bottle", (0.05, 0.075, 0.13), (0.16, 0.25, 0.34), "flask"),
        material=materials.BOTTLE,
        round=True,
        place=_ON_WORKTOP,
    ),
    _thing("can", (0.05, 0.075, 0.11), (0.08, 0.12, 0.13), "tin", material=materials.CAN, round=True),
    _thing("jar", (0.05, 0.085, 0.15), (0.06, 0.12, 0.22), round=True),
    _thing("glass", (0.05, 0.085, 0.11), (0.07, 0.12, 0.22), round=True),
    _thing("tumbler", (0.05, 0.085, 0.11), (0.07, 0.12, 0.13), round=True, open_vessel=True),
    _thing(
        "mug", (0.06, 0.085, 0.14), (0.05, 0.095, 0.13), material=materials.MUG, round=True, open_vessel=True, place=_ON_WORKTOP
    ),
    _thing("cup", (0.06, 0.085, 0.13), (0.05, 0.075, 0.13), "teacup", material=materials.CUP, round=True, open_vessel=True),
    _thing("bowl", (0.08, 0.16, 0.30), (0.03, 0.07, 0.15), material=materials.BOWL, round=True, open_vessel=True),
    _thing("plate", (0.15, 0.25, 0.32), (0.01, 0.025, 0.05), "dish", material=materials.PLATE),
    _thing("carafe", (0.08, 0.12, 0.16), (0.18, 0.25, 0.32), "decanter", round=True),
    _thing("vase", (0.07, 0.12, 0.2), (0.12, 0.25, 0.32), round=True, open_vessel=True),
    _thing("jug", (0.08, 0.14, 0.25), (0.12, 0.22, 0.4), "pitcher", open_vessel=True),
    _thing("bucket", (0.2, 0.28, 0.4), (0.2, 0.28, 0.4), open_vessel=True),
    _thing("pot", (0.12, 0.22, 0.4), (0.06, 0.14, 0.35), "saucepan", "casserole", open_vessel=True),
    _thing("pan", (0.15, 0.26, 0.4), (0.03, 0.06, 0.15), "skillet", open_vessel=True),
    _thing("planter", (0.1, 0.2, 0.4), (0.1, 0.2, 0.4), "plant_pot", "flower_pot", open_vessel=True),
    _thing("teapot", (0.12, 0.2, 0.3), (0.1, 0.16, 0.4)),
    _thing("kettle", (0.14, 0.20, 0.3), (0.16, 0.24, 0.4), material=materials.KETTLE),
    _thing("toaster", (0.15, 0.28, 0.4), (0.15, 0.19, 0.25), material=materials.TOASTER),
    _thing("blender", (0.12, 0.18, 0.3), (0.25, 0.38, 0.4)),
    _thing("coffee_machine", (0.12, 0.25, 0.4), (0.2, 0.33, 0.4), "coffee_maker", "espresso_machine"),
    _thing("plant", (0.1, 0.2, 0.4), (0.1, 0.3, 0.4), "potted_plant", "house_plant"),
    _thing("box", (0.04, 0.15, 0.36), (0.03, 0.2, 0.36), "carton", material=materials.BOX),
    _thing("book", (0.1, 0.2, 0.36), (0.01, 0.03, 0.36)),
    _thing("bag", (0.1, 0.25, 0.36), (0.1, 0.3, 0.36)),
    _thing(
        "bin",
        (0.15, 0.3, 0.5),
        (0.25, 0.5, 1.0),
        "trash",
        "trash_can",
        "garbage_can",
        "waste_basket",
        on_floor=True,
        place=_ON_FLOOR,
    ),
    _thing(
        *("chair", (0.32, 0.45, 0.8), (0.6, 0.88, 1.1), "armchair", "highchair", "wheelchair"),
        material=materials.CHAIR,
        on_floor=True,
        on_legs=True,
        place=_ON_FLOOR,
    ),
    _thing("stool", (0.28, 0.38, 0.6), (0.3, 0.65, 1.0), "barstool", "footstool", on_floor=True, on_legs=True, flat_top=True),
    _thing("table", (0.4, 1.2, 2.0), (0.4, 0.75, 1.1), on_floor=True, on_legs=True, flat_top=True),
    _thing("desk", (0.6, 1.2, 2.0), (0.6, 0.74, 1.1), on_floor=True, on_legs=True, flat_top=True),
    _thing("bench", (0.6, 1.2, 2.0), (0.35, 0.45, 1.0), "workbench", on_floor=True, on_legs=True),
    _thing("sofa", (0.8, 1.8, 2.0), (0.6, 0.85, 1.0), "couch", on_floor=True),
)
CATEGORIES: tuple[Category, ...] = (*_FRONTS, *_APPLIANCES, *_FIXED, *_THINGS)
"""The project's own categories; `every_category()` also includes those of other packages."""


def every_category() -> tuple[Category, ...]:
    """Every known category, the project's own first; a plug-in cannot redefine a name in use."""
    taken = {name for category in CATEGORIES for name in category.names}
    return (*CATEGORIES, *(kind for kind in added("r2c2r.fixtures", Category) if not taken & set(kind.names)))
