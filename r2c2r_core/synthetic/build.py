"""Surfaces of a planned kitchen: fronts, carcasses, handles, appliances, bottles and the room."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from r2c2r_core.synthetic.fixed import fixed_patches
from r2c2r_core.synthetic.fronts import handle_patches, leaf_patches
from r2c2r_core.synthetic.insides import (
    Hollow,
    carcass_behind,
    facing_quads,
    hollow_patches,
    pierced_front,
    tray_patches,
)
from r2c2r_core.synthetic.kitchen import Appliance, Bottle, Carcass, Furniture, Handle, Kitchen, Leaf, Paint, Run
from r2c2r_core.synthetic.patches import Patch, box, inner_walls, lathe, moving, quad, shifted, turned
from r2c2r_core.synthetic.props import crockery, prop_patches, sink_bounds, window_frame

_SHADOW = Paint(kind="plain", colour=(0.05, 0.05, 0.05), texel_m=0.004)


Hollows = Mapping[str, Hollow]
_NONE: Hollows = MappingProxyType({})


def build_kitchen(kitchen: Kitchen, hollows: Hollows = _NONE) -> list[Patch]:
    """All surfaces with every front closed, and instance ids 1 + position in `kitchen.object_names` (0: background).

    `hollows` are the visible interiors, by the name of the unit or of the machine's joint; all else is solid.
    """
    ids = {name: position + 1 for position, name in enumerate(kitchen.object_names)}
    patches = _room(kitchen)
    for number, run in enumerate(kitchen.runs):
        own = _run(kitchen, run, ids, hollows)
        if number and run.has_wall:
            own += _splashback(kitchen, run)
        patches += _posed(own, run)
    patches += _fridge(kitchen, ids[kitchen.fridge.name], hollows)
    if kitchen.microwave is not None:
        patches += _microwave(kitchen, kitchen.microwave, ids[kitchen.microwave.name], hollows)
    for run in kitchen.runs:
        for prop in run.props:
            patches += _posed(prop_patches(kitchen, prop), run)
    for bottle in kitchen.bottles:
        patches += _bottle(kitchen, bottle, ids.get(bottle.name, 0))
    return patches


def _run(kitchen: Kitchen, run: Run, ids: Mapping[str, int], hollows: Hollows) -> list[Patch]:
    style = kitchen.style
    patches = [*_base_body(kitchen, run, hollows), *_upper_body(kitchen, run, hollows)]
    for board in run.boards:
        patches += box(board.low, board.high, board.paint, lumel_m=0.01)
    for furniture in run.base:
        patches += _furniture(kitchen, furniture, style.base_front, ids[furniture.name], hollows.get(furniture.name))
    for furniture in run.upper:
        patches += _furniture(kitchen, furniture, style.wall_front, ids[furniture.name], hollows.get(furniture.name))
    for thing in run.fixed:
        patches += fixed_patches(thing, style, ids[thing.name])
    return patches


def _room(kitchen: Kitchen) -> list[Patch]:
    x0, x1, y0, y1, ceiling = kitchen.room
    style = kitchen.style
    white = Paint(kind="plaster", colour=(0.82, 0.82, 0.80), texel_m=0.02)
    dx, dy, dz = np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, y1 - y0, 0.0]), np.array([0.0, 0.0, ceiling])
    patches = [
        quad(np.array([x0, y1, 0.0]), dx, -dy, style.floor, lumel_m=0.05),
        quad(np.array([x0, y0, ceiling]), dx, dy, white, lumel_m=0.08),
        quad(np.array([x0, y1, ceiling]), dx, -dz, style.wall, lumel_m=0.05),
        quad(np.array([x1, y0, ceiling]), -dx, -dz, style.wall, lumel_m=0.1),
        quad(np.array([x0, y0, ceiling]), dy, -dz, style.wall, lumel_m=0.06),
        quad(np.array([x1, y1, ceiling]), -dy, -dz, style.wall, lumel_m=0.06),
    ]
    patches += _lights(kitchen)
    patches += _splashback(kitchen, kitchen.runs[0])
    skirting = Paint(kind="laminate", colour=(0.78, 0.78, 0.76), texel_m=0.004)
    patches += box((x0, -0.015, 0.0), (x1, 0.0, 0.08), skirting, faces="front top")
    patches += box((x0, y0, 0.0), (x0 + 0.015, y1, 0.08), skirting, faces="right top")
    patches += box((x1 - 0.015, y0, 0.0), (x1, y1, 0.08), skirting, faces="left top")
    return patches


def _splashback(kitchen: Kitchen, run: Run) -> list[Patch]:
    """Splashback on the wall behind a run, from the worktop to the wall cabinets."""
    top = min((c.z for c in run.upper_carcasses), default=kitchen.worktop_top_m + 0.5)
    left, right = run.ends
    low, high = (left, -0.009, kitchen.worktop_top_m), (right, -0.0005, top)
    return box(low, high, kitchen.style.splash, faces="front left right top")


def _posed(patches: list[Patch], run: Run) -> list[Patch]:
    """Patches transformed from the run's frame to the kitchen's."""
    return (
        shifted(turned(patches, run.yaw_rad, (0.0, 0.0)), np.array([*run.place, 0.0]))
        if run.yaw_rad or any(run.place)
        else patches
    )


def _lights(kitchen: Kitchen) -> list[Patch]:
    """A ceiling panel and a window in the side wall beside the run, both emitting."""
    x0, x1, y0, _, ceiling = kitchen.room
    day = kitchen.style.daylight
    lamp = Paint(kind="emitter", colour=(1.0, 0.93, 0.82), accent=((1 - day) * 9.0,) * 3, texel_m=0.02)
    sky = Paint(kind="emitter", colour=(0.85, 0.93, 1.0), accent=(day * 7.0,) * 3, texel_m=0.02)
    centre_x, centre_y = (x0 + x1) / 2, -1.7
    lamp_quad = quad(
        np.array([centre_x - 0.45, centre_y - 0.25, ceiling - 0.02]),
        np.array([0.9, 0.0, 0.0]),
        np.array([0.0, 0.5, 0.0]),
        lamp,
        lumel_m=0.2,
    )
    height = np.array([0.0, 0.0, -1.1])
    middle = max(y0 + 0.9, -2.4)
    if kitchen.window_on_left:
        window = quad(np.array([x0 + 0.01, middle - 0.6, 2.15]), np.array([0.0, 1.2, 0.0]), height, sky, lumel_m=0.2)
    else:
        window = quad(np.array([x1 - 0.01, middle + 0.6, 2.15]), np.array([0.0, -1.2, 0.0]), height, sky, lumel_m=0.2)
    return [lamp_quad, window, *window_frame(window)]


def _base_body(kitchen: Kitchen, run: Run, hollows: Hollows) -> list[Patch]:
    style, left, right = kitchen.style, *run.ends
    patches: list[Patch] = []
    for carcass in run.base_carcasses:
        low = (carcass.x, -carcass.depth_m, carcass.z)
        high = (carcass.x + carcass.width_m, 0.0, carcass.z + carcass.height_m)
        if behind := _behind(carcass, run, hollows):
            patches += box(low, high, style.carcass, faces="left right") + _opened_carcass(carcass, behind, style.carcass)
        else:
            patches += box(low, high, style.carcass, faces="front left right")
    front = -kitchen.base_depth_m
    overhang = 0.018
    top, bottom = kitchen.worktop_top_m, kitchen.worktop_top_m - kitchen.worktop_thickness_m
    patches += box((left, front - overhang, bottom), (right, 0.0, top), style.worktop, faces="front left right bottom")
    patches += _worktop_surface(kitchen, run, front - overhang)
    patches += box(
        (left + 0.005, front + 0.06, 0.0),
        (right - 0.005, front + 0.076, kitchen.plinth_m),
        style.plinth,
        faces="front left right top",
    )
    return patches


def _worktop_surface(kitchen: Kitchen, run: Run, front: float) -> list[Patch]:
    """Top of the worktop, with a hole for the sink."""
    left, right = run.ends
    top = kitchen.worktop_top_m
    sink = next((p for p in run.props if p.kind == "sink"), None)
    pieces = [(left, right, front, 0.0)]
    if sink is not None:
        x0, x1, y0, y1 = sink_bounds(sink)
        pieces = [(left, x0, front, 0.0), (x1, right, front, 0.0), (x0, x1, front, y0), (x0, x1, y1, 0.0)]
    return [
        quad(np.array([x0, y1, top]), np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, y0 - y1, 0.0]), kitchen.style.worktop)
        for x0, x1, y0, y1 in pieces
    ]


def _behind(carcass: Carcass, run: Run, hollows: Hollows) -> list[Hollow]:
    """Visible compartments of a carcass."""
    units = [unit for unit in (*run.base, *run.upper) if unit.name in hollows]
    return [hollows[unit.name] for unit in units if carcass_behind(run, unit) is carcass]


def _opened_carcass(carcass: Carcass, hollows: list[Hollow], paint: Paint) -> list[Patch]:
    """The front edges of a carcass's boards, and its compartments."""
    return [*pierced_front(carcass, hollows, paint), *(patch for each in hollows for patch in hollow_patches(each))]


def _upper_body(kitchen: Kitchen, run: Run, hollows: Hollows) -> list[Patch]:
    patches: list[Patch] = []
    for carcass in run.upper_carcasses:
        low = (carcass.x, -carcass.depth_m, carcass.z)
        high = (carcass.x + carcass.width_m, 0.0, carcass.z + carcass.height_m)
        if carcass.glazed:
            patches += box(low, high, kitchen.style.carcass, faces="left right top bottom") + _glazed(carcass, kitchen)
        elif behind := _behind(carcass, run, hollows):
            patches += box(low, high, kitchen.style.carcass, faces="left right top bottom")
            patches += _opened_carcass(carcass, behind, kitchen.style.carcass)
        else:
            patches += box(low, high, kitchen.style.carcass, faces="front left right top bottom")
    return patches


def _glazed(carcass: Carcass, kitchen: Kitchen) -> list[Patch]:
    """Interior visible through panes: boards of 16 mm, and cups and plates on two shelves."""
    inside, wall = kitchen.style.carcass, 0.016
    x0, x1 = carcass.x + wall, carcass.x + carcass.width_m - wall
    z0, z1 = carcass.z + wall, carcass.z + carcass.height_m - wall
    low, high = (x0, -carcass.depth_m, z0), (x1, -0.01, z1)
    patches = inner_walls(low, high, inside)
    for edge_low, edge_high in (
        ((carcass.x, carcass.z), (x0, carcass.z + carcass.height_m)),
        ((x1, carcass.z), (carcass.x + carcass.width_m, carcass.z + carcass.height_m)),
        ((x0, carcass.z), (x1, z0)),
        ((x0, z1), (x1, carcass.z + carcass.height_m)),
    ):
        edge = (edge_low[0], -carcass.depth_m, edge_low[1]), (edge_high[0], -carcass.depth_m + 0.001, edge_high[1])
        patches += box(*edge, inside, faces="front")
    levels = [z0, z0 + (z1 - z0) / 3, z0 + 2 * (z1 - z0) / 3]
    for level in levels[1:]:
        patches += box((x0, -carcass.depth_m + 0.02, level - wall), (x1, -0.01, level), inside, faces="front top bottom")
    return [*patches, *(cup for level in levels for cup in crockery(x0, x1, -carcass.depth_m / 2, level))]


def _furniture(
    kitchen: Kitchen, furniture: Furniture, paint: Paint, object_id: int, behind: Hollow | None = None
) -> list[Patch]:
    style = kitchen.style
    face = -furniture.depth_m
    patches: list[Patch] = []
    for leaf in furniture.leaves:
        front = leaf_patches(leaf, face, style.front_thickness_m, paint, style.handle, object_id)
        if behind is not None:
            front += _back(leaf, face + style.front_thickness_m, style.carcass, object_id)
        patches += moving(front, furniture.joint_name(leaf))
    if behind is not None:
        patches += tray_patches(behind, furniture.joint_name(furniture.leaves[0]), object_id)
    first, last = furniture.leaves[0], furniture.leaves[-1]
    back = face + style.front_thickness_m
    edge = style.gap_m / 2 + 0.0005  # the carcass is as wide as the unit, the front a gap narrower
    low, high = first.z, first.z + first.height_m
    if furniture.shows_left_side:
        x = first.x - edge
        patches += box((x, back, low), (x + 0.0005, 0.0, high), style.carcass, faces="left", object_id=object_id)
    if furniture.shows_right_side:
        x = last.x + last.width_m + edge
        patches += box((x - 0.0005, back, low), (x, 0.0, high), style.carcass, faces="right", object_id=object_id)
    return patches


def _back(leaf: Leaf, y: float, paint: Paint, object_id: int) -> list[Patch]:
    """Inner face of a front."""
    low, high = (leaf.x, y - 0.001, leaf.z), (leaf.x + leaf.width_m, y, leaf.z + leaf.height_m)
    return box(low, high, paint, faces="back", object_id=object_id)


def _fridge(kitchen: Kitchen, object_id: int, hollows: Hollows) -> list[Patch]:
    fridge = kitchen.fridge
    x0, x1, y0, y1, _, z1 = _bounds(fridge)
    z0 = 0.018  # above its feet
    seal = y0 + fridge.door_thickness_m
    patches = []
    for (left, right, low, high), name in zip(_fridge_fronts(fridge, x0, x1, z0, z1), fridge.fronts, strict=True):
        patches += moving(box((left, y0, low), (right, seal, high), fridge.door, object_id=object_id), name)
    patches += box(
        (x0 + 0.008, seal, z0), (x1 - 0.008, seal + 0.012, z1 - 0.008), _SHADOW, faces="left right top", object_id=object_id
    )
    patches += _machine_body(fridge, (x0, seal + 0.012, z0), (x1, y1, z1), object_id, hollows)
    foot = Paint(kind="plain", colour=(0.03, 0.03, 0.03), texel_m=0.004)
    patches += box((x0 + 0.02, y0 + 0.07, 0.0), (x1 - 0.02, y1, z0), foot, faces="front left right", object_id=object_id)
    for handle, name in zip(_fridge_handles(fridge), fridge.fronts, strict=True):
        own = handle_patches(handle, np.array([x0, y0, 0.0]), _appliance_handle(fridge), object_id)
        patches += moving(own, name)
    return patches


def _machine_body(
    thing: Appliance, low: tuple[float, float, float], high: tuple[float, float, float], object_id: int, hollows: Hollows
) -> list[Patch]:
    """Box behind a machine's fronts, open to its visible compartments, with the drawers in them."""
    seen = {name: hollows[name] for name in thing.fronts if name in hollows}
    if not seen:
        return box(low, high, thing.body, object_id=object_id)
    patches = box(low, high, thing.body, faces="back left right top bottom", object_id=object_id)
    centre = np.array(thing.centre)
    compartments = sorted({id(each): each for each in seen.values()}.values(), key=lambda each: each.low[2])
    spans, z = [], low[2]
    for each in compartments:
        (left, _, bottom), (right, _, top) = np.array(each.low) + centre, np.array(each.high) + centre
        spans += [(low[0], high[0], z, bottom), (low[0], left, bottom, top), (right, high[0], bottom, top)]
        z = top
    patches += facing_quads([*spans, (low[0], high[0], z, high[2])], low[1], thing.body, object_id)
    inner = [patch for each in compartments for patch in hollow_patches(each)]  # masks cover moving parts and the outside only
    inner += [patch for name, each in seen.items() for patch in tray_patches(each, name, object_id)]
    return patches + shifted(inner, centre)


def _fridge_fronts(fridge: Appliance, x0: float, x1: float, z0: float, z1: float) -> list[tuple[float, float, float, float]]:
    """Left, right, bottom and top of its door, or of its two doors and the drawer under them."""
    if not fridge.drawer_m:
        return [(x0, x1, z0, z1)]
    middle, top = (x0 + x1) / 2, z0 + fridge.drawer_m
    doors = [(x0, middle - 0.002, top + 0.002, z1), (middle + 0.002, x1, top + 0.002, z1)]
    return [*doors, (x0, x1, z0, top - 0.002)]


def _fridge_handles(fridge: Appliance) -> list[Handle]:
    """Its handle; for french doors one next to the middle on either side, and one along the drawer's upper edge."""
    if not fridge.drawer_m:
        return [fridge.handle]
    middle = fridge.size_m[0] / 2
    doors = [replace(fridge.handle, x=middle + side) for side in (-0.05, 0.05)]
    return [*doors, replace(fridge.handle, vertical=False, x=middle, z=fridge.drawer_m - 0.06)]


def _microwave(kitchen: Kitchen, oven: Appliance, object_id: int, hollows: Hollows) -> list[Patch]:
    """Door on the hinge side, control panel beside it; rotated by its yaw on the worktop."""
    x0, x1, y0, y1, z0, z1 = _bounds(oven)
    z0 += 0.012  # above its feet
    split = y0 + oven.door_thickness_m
    left_hinged = oven.hinge == "left"
    door_x = (x0, x0 + oven.door_width_m - 0.001) if left_hinged else (x1 - oven.door_width_m + 0.001, x1)
    panel_x = (x0 + oven.door_width_m + 0.001, x1) if left_hinged else (x0, x1 - oven.door_width_m - 0.001)
    controls = Paint(kind="controls", colour=oven.body.colour, accent=_contrast(oven.body.colour), gloss=0.3, texel_m=0.001)
    door = box((door_x[0], y0, z0), (door_x[1], split, z1), {"front": oven.door, "": oven.body}, object_id=object_id)
    patches = moving(door, oven.fronts[0])
    patches += box((panel_x[0], y0, z0), (panel_x[1], split, z1), {"front": controls, "": oven.body}, object_id=object_id)
    patches += _machine_body(oven, (x0, split + 0.002, z0), (x1, y1, z1), object_id, hollows)
    patches += box(
        (x0 + 0.004, split, z0 + 0.004),
        (x1 - 0.004, split + 0.002, z1 - 0.004),
        _SHADOW,
        faces="left right top",
        object_id=object_id,
    )
    for foot_x in (x0 + 0.03, x1 - 0.05):
        for foot_y in (y0 + 0.03, y1 - 0.05):
            foot = (foot_x, foot_y, kitchen.worktop_top_m), (foot_x + 0.02, foot_y + 0.02, z0)
            patches += box(*foot, _SHADOW, faces="front left right", object_id=object_id)
    own = handle_patches(oven.handle, np.array([door_x[0], y0, z0]), _appliance_handle(oven), object_id)
    patches += moving(own, oven.fronts[0])
    return turned(patches, oven.yaw_rad, (oven.centre[0], oven.centre[1]))


def _bottle(kitchen: Kitchen, bottle: Bottle, object_id: int) -> list[Patch]:
    """Body with a label, shoulder and neck, cap."""
    r, h, n = bottle.radius_m, bottle.height_m, bottle.neck_radius_m
    shoulder, neck, cap = bottle.shoulder * h, (bottle.shoulder + 0.18) * h, h - 0.022
    centre = (bottle.x, bottle.y, kitchen.worktop_top_m)
    ease = np.linspace(0, np.pi, 9)
    bend = [(n + (r - n) * (1 - np.cos(t)) / 2, neck + (shoulder - neck) * t / np.pi) for t in ease]
    label_top, label_bottom = shoulder - 0.01, 0.18 * h
    return [
        lathe(centre, [(0.0, h), (n + 0.0015, h), (n + 0.0015, cap)], bottle.cap, object_id=object_id),
        lathe(centre, [(n, cap), *bend, (r, label_top)], bottle.glass, object_id=object_id),
        lathe(centre, [(r, label_top), (r, label_bottom)], bottle.label, object_id=object_id),
        lathe(centre, [(r, label_bottom), (r, 0.006), (r - 0.006, 0.0)], bottle.glass, object_id=object_id),
    ]


def _bounds(thing: Appliance) -> tuple[float, float, float, float, float, float]:
    (x, y, z), (w, d, h) = thing.centre, thing.size_m
    return x - w / 2, x + w / 2, y - d / 2, y + d / 2, z - h / 2, z + h / 2


def _appliance_handle(thing: Appliance) -> Paint:
    return Paint(kind="steel", colour=_contrast(thing.door.colour, 0.5, 0.25), gloss=0.8, texel_m=0.002)


def _contrast(colour: tuple[float, float, float], light: float = 0.6, dark: float = 0.12) -> tuple[float, float, float]:
    tone = light if sum(colour) / 3 < 0.35 else dark
    return (tone, tone, tone)
