"""Random kitchen of a seed."""

from dataclasses import replace

import numpy as np

from r2c2r_core.synthetic.kitchen import (
    Appliance,
    Bottle,
    Carcass,
    Frame,
    Furniture,
    Handle,
    HandleKind,
    Hinge,
    Kitchen,
    Leaf,
    Paint,
    Prop,
    Run,
    Style,
)
from r2c2r_core.synthetic.style import pick_style, rgb

_CATALOGUE_WIDTHS_M = (0.40, 0.45, 0.50, 0.60)
_STACKS = ((0.25, 0.25, 0.25, 0.25), (0.2, 0.4, 0.4), (1 / 3, 1 / 3, 1 / 3), (0.18, 0.27, 0.27, 0.28))


def plan_kitchen(seed: int) -> Kitchen:
    """The kitchen of a seed; every fixture closed."""
    rng = np.random.default_rng([seed, 1])
    style, shaker = pick_style(rng)
    worktop_top = float(rng.uniform(0.87, 0.93))
    thickness = float(rng.uniform(0.022, 0.042))
    plinth = float(rng.uniform(0.10, 0.15))
    base_depth = float(rng.uniform(0.57, 0.62))
    handle_kind: HandleKind = str(rng.choice(["bar", "bar", "flat", "bow", "knob"]))  # type: ignore[assignment]

    units = _plan_base_units(rng)
    bottom, top = plinth + 0.002, worktop_top - thickness - float(rng.uniform(0.003, 0.012))
    base, base_carcasses, right = _place_base(rng, units, style, handle_kind, base_depth, bottom, top)

    fridge_left = bool(rng.random() < 0.5)
    upper_depth = float(rng.uniform(0.31, 0.37))
    upper_bottom = worktop_top + float(rng.uniform(0.47, 0.55))
    upper, upper_carcasses = _place_upper(rng, style, handle_kind, right, fridge_left, upper_depth, upper_bottom)

    fridge = place_fridge(rng, right, fridge_left)
    fridge_edge = fridge.size_m[0] + 0.04
    x_min = -(fridge_edge if fridge_left else 0.0) - float(rng.uniform(0.05, 0.9))
    x_max = right + (0.0 if fridge_left else fridge_edge) + float(rng.uniform(0.05, 0.9))
    microwave = place_microwave(rng, right, worktop_top)
    props, bottles = fill_worktop(rng, right, microwave, base, base_depth)
    props = (*props, *hang_on_wall(rng, right, upper))
    run = Run(
        base=_framed(base) if shaker else base,
        upper=_framed(upper) if shaker else upper,
        base_carcasses=base_carcasses,
        upper_carcasses=upper_carcasses,
        ends=(-0.0 if fridge_left else -0.01, right + (0.01 if fridge_left else 0.0)),
        props=props,
    )
    return Kitchen(
        style=style,
        runs=(run,),
        plinth_m=plinth,
        worktop_top_m=worktop_top,
        worktop_thickness_m=thickness,
        base_depth_m=base_depth,
        upper_depth_m=upper_depth,
        fridge=fridge,
        microwave=microwave,
        bottles=bottles,
        room=(x_min, x_max, -float(rng.uniform(3.7, 4.3)), 0.0, float(rng.uniform(2.45, 2.65))),
        window_on_left=not fridge_left,
        yaw_rad=float(rng.uniform(-np.pi, np.pi)),
    )


def _framed(units: tuple[Furniture, ...]) -> tuple[Furniture, ...]:
    """The units with a frame around a recessed panel on every front that is high enough for one."""
    return tuple(
        replace(
            unit,
            leaves=tuple(
                leaf
                if leaf.height_m < 0.2
                else replace(leaf, frame=Frame(rail_m=min(0.065, 0.25 * leaf.height_m), recess_m=0.007))
                for leaf in unit.leaves
            ),
        )
        for unit in units
    )


def _plan_base_units(rng: np.random.Generator) -> list[tuple[str, float]]:
    """Kinds and widths of the base units from left to right; at least three doors and one stack of drawers."""
    kinds = ["door", "door", "door", "drawers"]
    if rng.random() < 0.45:
        kinds[2] = "double"
    elif rng.random() < 0.5:
        kinds.append("door")
    rng.shuffle(kinds)
    units = []
    for kind in kinds:
        width = float(rng.choice((0.80, 0.90))) if kind == "double" else float(rng.choice(_CATALOGUE_WIDTHS_M))
        units.append((kind, width + float(rng.uniform(-0.012, 0.012))))
    return units


def _place_base(
    rng: np.random.Generator,
    units: list[tuple[str, float]],
    style: Style,
    handle_kind: HandleKind,
    depth: float,
    bottom: float,
    top: float,
) -> tuple[tuple[Furniture, ...], tuple[Carcass, ...], float]:
    furniture: list[Furniture] = []
    carcasses: list[Carcass] = []
    gap, x = style.gap_m, 0.0
    doors = drawers = doubles = 0
    for position, (kind, width) in enumerate(units):
        ends = {
            "shows_left_side": position == 0 and kind != "drawers",
            "shows_right_side": position == len(units) - 1 and kind != "drawers",
        }
        carcass_depth = depth - style.front_thickness_m
        carcasses.append(Carcass(x=x, z=bottom, width_m=width, height_m=top - bottom, depth_m=carcass_depth))
        left, front_width = x + gap / 2, width - gap
        if kind == "drawers":
            for leaf in _drawer_stack(rng, left, front_width, bottom, top, gap, depth, handle_kind):
                drawers += 1
                furniture.append(Furniture(name=f"drawer_{drawers}", category="drawer", leaves=(leaf,), depth_m=depth))
        elif kind == "double":
            doubles += 1
            half = (front_width - gap) / 2
            pair = tuple(
                _door(rng, left + offset, half, bottom, top, hinge, handle_kind, upper=False)
                for offset, hinge in ((0.0, "left"), (half + gap, "right"))
            )
            name = f"double_door_{doubles}"
            furniture.append(Furniture(name=name, category="double_door_cabinet", leaves=pair, depth_m=depth, **ends))
        else:
            doors += 1
            leaf = _door(rng, left, front_width, bottom, top, str(rng.choice(["left", "right"])), handle_kind, upper=False)
            furniture.append(Furniture(name=f"cabinet_{doors}", category="cabinet", leaves=(leaf,), depth_m=depth, **ends))
        x += width
    return tuple(furniture), tuple(carcasses), x


def _drawer_stack(
    rng: np.random.Generator, x: float, width: float, bottom: float, top: float, gap: float, depth: float, kind: HandleKind
) -> list[Leaf]:
    """Fronts from top to bottom that fill the height, `gap` apart."""
    shares = _STACKS[int(rng.integers(len(_STACKS)))]
    usable = top - bottom - gap * (len(shares) - 1)
    length = _handle_length(rng, kind, width)
    leaves, upper_edge = [], top
    for share in shares:
        height = usable * share
        handle = _handle(rng, kind, length, vertical=False, x=width / 2, z=height * (0.5 if height < 0.22 else 0.68))
        leaves.append(
            Leaf(
                x=x,
                z=upper_edge - height,
                width_m=width,
                height_m=height,
                hinge=None,
                handle=handle,
                open_limit=round(0.8 * depth, 3),
            )
        )
        upper_edge -= height + gap
    return leaves


def _door(
    rng: np.random.Generator, x: float, width: float, bottom: float, top: float, hinge: str, kind: HandleKind, *, upper: bool
) -> Leaf:
    height = top - bottom
    length = min(_handle_length(rng, kind, width), 0.45 * height)
    inset = float(rng.uniform(0.035, 0.055))
    from_edge = length / 2 + float(rng.uniform(0.04, 0.07))
    handle = _handle(
        rng,
        kind,
        length,
        vertical=True,
        x=inset if hinge == "right" else width - inset,
        z=from_edge if upper else height - from_edge,
    )
    return Leaf(
        x=x,
        z=bottom,
        width_m=width,
        height_m=height,
        hinge="left" if hinge == "left" else "right",
        handle=handle,
        open_limit=round(float(rng.uniform(1.65, 1.92)), 3),
    )


def _handle_length(rng: np.random.Generator, kind: HandleKind, width: float) -> float:
    return 0.03 if kind == "knob" else min(float(rng.choice((0.128, 0.16, 0.192))) + 0.03, 0.6 * width)


def _handle(rng: np.random.Generator, kind: HandleKind, length: float, *, vertical: bool, x: float, z: float) -> Handle:
    thickness = {"bar": 0.012, "flat": 0.014, "bow": 0.011, "knob": 0.03}[kind]
    reach = {"bar": 0.036, "flat": 0.030, "bow": 0.034, "knob": 0.028}[kind]
    return Handle(kind=kind, length_m=length, thickness_m=thickness, reach_m=reach, vertical=vertical, x=x, z=z)


def _place_upper(
    rng: np.random.Generator, style: Style, kind: HandleKind, right: float, fridge_left: bool, depth: float, bottom: float
) -> tuple[tuple[Furniture, ...], tuple[Carcass, ...]]:
    """Three wall cabinets, the row starting at one end of the run."""
    height = float(rng.uniform(0.58, 0.72))
    widths = [float(rng.choice((0.40, 0.45, 0.50, 0.60))) + float(rng.uniform(-0.01, 0.01)) for _ in range(3)]
    while sum(widths) > right - 0.1:
        widths = [w - 0.05 for w in widths]
    spare = right - sum(widths)
    x = float(rng.uniform(0.0, spare)) if rng.random() < 0.5 else (spare if fridge_left else 0.0)
    furniture, carcasses, gap = [], [], style.gap_m
    for position, width in enumerate(widths):
        carcasses.append(Carcass(x=x, z=bottom, width_m=width, height_m=height, depth_m=depth - style.front_thickness_m))
        hinge = str(rng.choice(["left", "right"]))
        leaf = _door(rng, x + gap / 2, width - gap, bottom, bottom + height, hinge, kind, upper=True)
        furniture.append(
            Furniture(
                name=f"wall_cabinet_{position + 1}",
                category="wall_cabinet",
                leaves=(leaf,),
                depth_m=depth,
                shows_left_side=position == 0,
                shows_right_side=position == len(widths) - 1,
            )
        )
        x += width
    return tuple(furniture), tuple(carcasses)


def place_fridge(rng: np.random.Generator, right: float, on_left: bool) -> Appliance:
    """A refrigerator beside a run that ends at `right`."""
    width, depth, height = float(rng.uniform(0.55, 0.68)), float(rng.uniform(0.60, 0.68)), float(rng.uniform(1.45, 1.78))
    space = float(rng.uniform(0.012, 0.03))
    x = -space - width / 2 if on_left else right + space + width / 2
    hinge: Hinge = "left" if rng.random() < 0.5 else "right"
    length = float(rng.uniform(0.35, 0.6))
    handle = Handle(
        kind="bar" if rng.random() < 0.6 else "flat",
        length_m=length,
        thickness_m=0.02,
        reach_m=0.05,
        vertical=True,
        x=0.05 if hinge == "right" else width - 0.05,
        z=height * float(rng.uniform(0.55, 0.65)),
    )
    steel = rng.random() < 0.5
    colour = (
        (0.50, 0.51, 0.52)
        if steel
        else tuple(
            float(c) for c in rng.choice([(0.80, 0.80, 0.78), (0.16, 0.17, 0.18), (0.35, 0.06, 0.04)], p=[0.6, 0.25, 0.15])
        )
    )
    front = Paint(kind="steel" if steel else "laminate", colour=rgb(colour), gloss=0.5, texel_m=0.002)
    body = Paint(kind="laminate", colour=(0.42, 0.43, 0.44) if steel else rgb(colour), gloss=0.2, texel_m=0.004)
    return Appliance(
        name="refrigerator",
        category="refrigerator",
        centre=(x, -depth / 2 - float(rng.uniform(0.03, 0.06)), height / 2),
        size_m=(width, depth, height),
        yaw_rad=0.0,
        hinge=hinge,
        handle=handle,
        door_thickness_m=0.06,
        door_width_m=width,
        open_limit=round(float(rng.uniform(1.6, 1.92)), 3),
        body=body,
        door=front,
    )


def place_microwave(rng: np.random.Generator, right: float, worktop_top: float) -> Appliance:
    """A microwave on the worktop of a run that ends at `right`."""
    width, depth, height = float(rng.uniform(0.44, 0.52)), float(rng.uniform(0.33, 0.40)), float(rng.uniform(0.26, 0.31))
    x = float(rng.uniform(0.45, 0.55)) * right + float(rng.choice((-1.0, 1.0))) * 0.28 * right
    hinge: Hinge = "left" if rng.random() < 0.85 else "right"
    door_width = 0.76 * width
    handle = Handle(
        kind="bar",
        length_m=0.62 * height,
        thickness_m=0.014,
        reach_m=0.035,
        vertical=True,
        x=door_width - 0.028 if hinge == "left" else 0.028,
        z=height / 2,
    )
    tone = float(rng.choice((0.72, 0.08, 0.4)))
    body = Paint(kind="laminate", colour=(tone, tone, tone * 1.02), gloss=0.3, texel_m=0.0016)
    return Appliance(
        name="microwave",
        category="microwave",
        centre=(x, -depth / 2 - float(rng.uniform(0.06, 0.12)), worktop_top + height / 2),
        size_m=(width, depth, height),
        yaw_rad=float(rng.uniform(-0.12, 0.12)),
        hinge=hinge,
        handle=handle,
        door_thickness_m=0.03,
        door_width_m=door_width,
        open_limit=round(float(rng.uniform(1.6, 1.8)), 3),
        body=body,
        door=Paint(kind="microwave_door", colour=(tone, tone, tone), gloss=0.5, texel_m=0.001),
    )


def fill_worktop(
    rng: np.random.Generator, right: float, microwave: Appliance | None, base: tuple[Furniture, ...], base_depth: float
) -> tuple[tuple[Prop, ...], tuple[Bottle, ...]]:
    """Three bottles, and props that fit beside the microwave, without overlaps along the run."""
    stays = [] if microwave is None else [(microwave.centre[0], microwave.size_m[0] / 2 + 0.05)]
    taken = list(stays)
    props: list[Prop] = []
    steel = Paint(kind="steel", colour=(0.50, 0.51, 0.52), gloss=0.6, texel_m=0.002)
    doors = [f.leaves[0].x + f.leaves[-1].width_m * len(f.leaves) / 2 for f in base if f.category != "drawer"]
    sink_x = float(rng.choice(doors))
    if right > 1.85 and all(abs(sink_x - x) > 0.56 for x, _ in stays) and 0.3 < sink_x < right - 0.3:
        props.append(Prop(kind="sink", x=sink_x, y=-base_depth / 2 - 0.02, width_m=0.44, paint=steel))
        taken.append((sink_x, 0.27))
    black = Paint(kind="hob", colour=(0.012, 0.012, 0.013), accent=(0.12, 0.12, 0.12), gloss=0.9)
    wanted = [("hob", 0.29, black)] if right > 2.2 else []
    bottles: list[Bottle] = []
    for kind, half, paint in wanted:
        x = _free_place(rng, right, taken, half + 0.02)
        if x is not None:
            props.append(Prop(kind=kind, x=x, y=-base_depth / 2, width_m=2 * half, paint=paint))
    while len(bottles) < 3:
        x = _free_place(rng, right, taken, 0.065)
        if x is None:  # too full: retry without the sink and the hob
            props, bottles, taken = [], [], list(stays)
            continue
        bottles.append(_pick_bottle(rng, f"bottle_{len(bottles) + 1}", x, base_depth))
    for kind, half in (("kettle", 0.09), ("board", 0.14), ("jar", 0.055), ("plant", 0.075)):
        x = _free_place(rng, right, taken, half)
        if x is not None and rng.random() < 0.7:
            paint = Paint(
                kind="wood" if kind == "board" else "laminate",
                colour=rgb(rng.uniform(0.15, 0.7, 3)),
                accent=(0.3, 0.18, 0.08),
                gloss=0.2,
            )
            y = -0.05 if kind == "board" else -float(rng.uniform(0.13, 0.22))
            props.append(Prop(kind=kind, x=x, y=y, width_m=2 * half, paint=paint))
    return tuple(props), tuple(bottles)


def _free_place(rng: np.random.Generator, right: float, taken: list[tuple[float, float]], half: float) -> float | None:
    """An x on the worktop clear of the occupied intervals, which it reserves; None without one."""
    for _ in range(60):
        x = float(rng.uniform(half + 0.03, right - half - 0.03))
        if all(abs(x - other) > half + other_half for other, other_half in taken):
            taken.append((x, half))
            return x
    return None


def hang_on_wall(rng: np.random.Generator, right: float, upper: tuple[Furniture, ...]) -> tuple[Prop, ...]:
    """A shelf of books beside the wall cabinets where there is space, and sockets."""
    left_end, right_end = upper[0].leaves[0].x, upper[-1].leaves[0].x + upper[-1].leaves[0].width_m
    white = Paint(kind="laminate", colour=(0.80, 0.80, 0.78), texel_m=0.002)
    props = [
        Prop(kind="socket", x=float(rng.uniform(0.2, right - 0.2)), y=0.0, width_m=0.08, paint=white, z=0.22) for _ in range(2)
    ]
    room_left, room_right = left_end, right - right_end
    if max(room_left, room_right) > 0.36:
        width = min(max(room_left, room_right) - 0.08, 0.7)
        x = room_left / 2 if room_left > room_right else right_end + room_right / 2
        wood = Paint(
            kind="wood", colour=(0.50, 0.34, 0.2), accent=(0.34, 0.2, 0.1), texel_m=0.002, seed=int(rng.integers(1 << 30))
        )
        props.append(Prop(kind="shelf", x=x, y=0.0, width_m=width, paint=wood, z=0.62))
    return tuple(props)


def _pick_bottle(rng: np.random.Generator, name: str, x: float, base_depth: float) -> Bottle:
    hues = [(0.03, 0.14, 0.06), (0.18, 0.09, 0.02), (0.10, 0.20, 0.38), (0.50, 0.40, 0.10), (0.45, 0.06, 0.05)]
    label = Paint(
        kind="label",
        colour=rgb(rng.uniform(0.45, 0.85, 3)),
        accent=rgb(rng.uniform(0.02, 0.5, 3)),
        texel_m=0.0008,
        seed=int(rng.integers(1 << 30)),
    )
    return Bottle(
        name=name,
        x=x,
        y=-float(rng.uniform(0.16, base_depth - 0.18)),
        radius_m=float(rng.uniform(0.034, 0.046)),
        height_m=float(rng.uniform(0.22, 0.32)),
        neck_radius_m=float(rng.uniform(0.013, 0.017)),
        shoulder=float(rng.uniform(0.58, 0.72)),
        glass=Paint(kind="laminate", colour=rgb(rng.choice(hues)), gloss=0.4, texel_m=0.002),
        label=label,
        cap=Paint(kind="laminate", colour=rgb(rng.uniform(0.05, 0.7, 3)), texel_m=0.002),
    )
